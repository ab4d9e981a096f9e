"""Files of pictures: what is in them, and that they are whole or not there."""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taichi_ants import AntsError, rendering
from taichi_ants.learners.policies import trail_follower
from taichi_ants.rendering import Episode, colours, save_animation, save_picture
from taichi_ants.rendering.writers import check_animation
from taichi_ants.worlds import paper

SIZE = (330, 324)


@pytest.fixture(scope="module")
def frames() -> list[np.ndarray]:
    episode = Episode.play(paper(), trail_follower(), max_steps=24)
    return list(rendering.frames(episode.snapshots(), SIZE, title="a title"))


def decoded(path: Path) -> tuple[list[np.ndarray], list[float]]:
    """All pictures of an animation, and for how many milliseconds each is shown."""
    pictures, durations = [], []
    with Image.open(path) as image:
        for number in range(image.n_frames):
            image.seek(number)
            pictures.append(np.asarray(image.convert("RGB")))
            durations.append(image.info["duration"])
    return pictures, durations


def leftovers(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*"))


def test_a_gif_has_all_frames_and_stores_only_changes(tmp_path, frames) -> None:
    save_animation(tmp_path / "a.gif", iter(frames), 8)
    pictures, durations = decoded(tmp_path / "a.gif")
    for picture, frame in zip(pictures, frames, strict=True):
        error = np.abs(picture.astype(int) - frame)
        assert error.mean() < 0.6
        assert np.percentile(error, 99.9) < 24
    # 8 frames per second take 12.5 hundredths each: 12 and 13 in turn.
    assert sum(durations) == pytest.approx(len(frames) * 125, abs=10)
    assert set(durations) == {120, 130}
    # The first picture alone takes a good part of the file.
    save_animation(tmp_path / "first.gif", frames[:1], 8)
    assert (tmp_path / "a.gif").stat().st_size < 6 * (tmp_path / "first.gif").stat().st_size


def test_a_gif_keeps_the_colours_of_the_legend(tmp_path, frames) -> None:
    """All nests, kinds of food and fields, also those that the first frame lacks."""
    fields = [colours.field_ramp(number)[-1] for number in range(colours.N_FIELDS)]
    words = np.concatenate(
        [
            *(colours.QUEENS, colours.ANTS, colours.FOODS),
            *(colours.QUEEN_FLOORS, colours.FOOD_FLOORS, fields),
            [colours.CELL_EMPTY, colours.CELL_OBSTACLE, colours.INK],
        ]
    )
    flat = frames[0].copy()
    flat[: len(words)] = colours.channels(words)[:, None]
    noise = np.random.default_rng(0).integers(0, 256, frames[0].shape, np.uint8)
    for first in (frames[0], noise):
        save_animation(tmp_path / "a.gif", [first, flat])
        pictures, _ = decoded(tmp_path / "a.gif")
        assert (pictures[1][: len(words)] == flat[: len(words)]).all()


def test_pictures_of_a_gif_that_stay_the_same_are_joined(tmp_path, frames) -> None:
    save_animation(tmp_path / "a.gif", [frames[0]] * 3 + [frames[1]] + [frames[2]] * 4, 10, pause=1)
    pictures, durations = decoded(tmp_path / "a.gif")
    assert durations == [300, 100, 1300]
    assert len(pictures) == 3
    # A GIF cannot show one picture for longer than 655 seconds.
    save_animation(tmp_path / "b.gif", [frames[0][:9, :9]] * 80 + [frames[1][:9, :9]] * 2, 0.1)
    assert 500_000 < decoded(tmp_path / "b.gif")[1][0] <= 655_350


def test_frames_may_be_drawn_into_one_array_and_a_single_pixel_may_change(tmp_path) -> None:
    def drawn() -> Iterator[np.ndarray]:
        frame = np.full((64, 64, 3), 255, np.uint8)
        for row in range(4):
            frame[row, 33] = (0x14, 0x17, 0x1C)  # an ant's
            yield frame

    save_animation(tmp_path / "a.gif", drawn(), 8)
    pictures, _ = decoded(tmp_path / "a.gif")
    assert all((a == b).all() for a, b in zip(pictures, drawn(), strict=True))


def test_a_picture_has_the_pixels_of_its_frame(tmp_path, frames) -> None:
    save_picture(tmp_path / "new" / "a.png", frames[0])
    assert (np.asarray(Image.open(tmp_path / "new" / "a.png")) == frames[0]).all()
    with pytest.raises(AntsError, match=r"\.png"):
        save_picture(tmp_path / "a.jpg", frames[0])


def test_a_failure_leaves_nothing_behind_and_old_files_alone(tmp_path, frames) -> None:
    name = "a.gif"
    (tmp_path / f"old{name}").write_bytes(b"old")

    def failing() -> Iterator[np.ndarray]:
        yield from frames[:4]
        raise KeyboardInterrupt

    for path in (tmp_path / "sub" / name, tmp_path / f"old{name}"):
        with pytest.raises(KeyboardInterrupt):
            save_animation(path, failing(), 8)
    assert leftovers(tmp_path) == [f"old{name}"]
    assert (tmp_path / f"old{name}").read_bytes() == b"old"


def test_a_full_disk_is_reported_with_the_file(tmp_path, frames, monkeypatch) -> None:
    def full(*given: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(AntsError, match=r"cannot write .*a\.gif.*: no space left on device"):
        save_animation(tmp_path / "a.gif", frames)
    assert not list(tmp_path.iterdir())


REFUSED = {
    **{name: ({"path": name}, r"\.png or \.gif") for name in ("a.avi", "frames")},
    **{f"fps {one}": ({"fps": one}, "fps") for one in (0, 51, float("nan"), True, "8")},
    "no frames": ({"frames": []}, "frames is empty"),
    "no iterable": ({"frames": 7}, "frames is 7"),
    "no array": ({"frames": [7]}, "a frame is 7"),
    "floats": ({"frames": [np.zeros((9, 9, 3))]}, "frame 0 is float64"),
    "no channels": ({"frames": [np.zeros((9, 9), np.uint8)]}, r"uint8 \(height, width, 3\)"),
    "shapes": ({"frames": [np.zeros((n, 9, 3), np.uint8) for n in (9, 8)]}, "frame 1 is uint8"),
    "a device": ({"path": "/dev/null/a.gif"}, "cannot write"),
    "a long name": ({"path": "n" * 300 + ".gif"}, "cannot write"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_leaves_nothing_behind(tmp_path, monkeypatch, name) -> None:
    monkeypatch.chdir(tmp_path)
    changed, message = REFUSED[name]
    with pytest.raises(AntsError, match=message):
        save_animation(
            **{"path": "new/a.gif", "frames": [np.zeros((9, 9, 3), np.uint8)], **changed}
        )
    assert leftovers(tmp_path) == []


def test_a_check_leaves_no_folder(tmp_path) -> None:
    check_animation(tmp_path / "new" / "a.gif", 8)
    assert leftovers(tmp_path) == []
