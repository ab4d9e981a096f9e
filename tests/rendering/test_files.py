"""Files of pictures: what is in them, and that they are whole or not there."""

from __future__ import annotations

import gc
import os
import sys
import weakref
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taichi_ants import AntsError, rendering
from taichi_ants.learners.policies import trail_follower
from taichi_ants.rendering import (
    Episode,
    check_animation,
    colours,
    save_animation,
    save_picture,
)
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


def test_gif(tmp_path, frames) -> None:
    save_animation(tmp_path / "a.gif", frames, 8)
    pictures, durations = decoded(tmp_path / "a.gif")
    assert len(pictures) == len(frames)
    for picture, frame in zip(pictures, frames, strict=True):
        error = np.abs(picture.astype(int) - frame)
        assert error.mean() < 0.6
        assert np.percentile(error, 99.9) < 24
    # 8 frames a second take 12.5 hundredths each: 12 and 13 in turn.
    assert sum(durations) == pytest.approx(len(frames) * 125, abs=10)
    assert set(durations) == {120, 130}


def test_a_gif_keeps_the_colours_of_the_legend(tmp_path, frames) -> None:
    """All nests, kinds of food and fields, also those that the first frame lacks."""
    fields = [colours.field_ramp(number)[-1] for number in range(colours.N_FIELDS)]
    several = [colours.QUEENS, colours.ANTS, colours.FOODS, fields]
    several.append(colours.floors(colours.QUEENS, colours.FLOOR_QUEEN))
    several.append(colours.floors(colours.FOODS, colours.FLOOR_FOOD))
    words = [*(colours.CELL_EMPTY, colours.CELL_OBSTACLE, colours.INK), *np.concatenate(several)]
    flat = frames[0].copy()
    flat[: len(words)] = colours.channels(np.array(words))[:, None]
    noise = np.random.default_rng(0).integers(0, 256, frames[0].shape, np.uint8)
    for first in (frames[0], noise):
        save_animation(tmp_path / "a.gif", [first, flat])
        pictures, _ = decoded(tmp_path / "a.gif")
        assert (pictures[1][: len(words)] == flat[: len(words)]).all()


def test_frames_may_be_drawn_into_one_array(tmp_path) -> None:
    def drawn() -> Iterator[np.ndarray]:
        frame = np.zeros((64, 64, 3), np.uint8)
        for row in range(4):
            frame[row] = 255
            yield frame

    save_animation(tmp_path / "one.gif", drawn(), 8)
    save_animation(tmp_path / "several.gif", map(np.copy, drawn()), 8)
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "several.gif").read_bytes()


def test_mp4(tmp_path, frames) -> None:
    av = pytest.importorskip("av")
    odd = [frame[:, :-1] for frame in frames]
    save_animation(tmp_path / "a.mp4", odd, 12.5)
    with av.open(str(tmp_path / "a.mp4")) as container:
        stream = container.streams.video[0]
        assert float(stream.average_rate) == pytest.approx(12.5)
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(pictures) == len(odd)
    for picture, frame in zip(pictures, odd, strict=True):
        assert picture.shape == (324, 328, 3)
        # Edges lose some colour; the large patches must not.
        error = np.abs(picture.astype(int) - frame[:, :328])
        assert error.mean() < 4
        assert np.median(error) <= 2
        # Trails and bars keep their hue, so the colour space is the one that the file names.
        hue = frame[:, :328].astype(int)
        bright = hue.max(axis=2) - hue.min(axis=2) > 100
        assert bright.sum() > 500
        assert np.median(error[bright], axis=0).max() <= 8


def test_numbered_pictures(tmp_path, frames) -> None:
    folder = tmp_path / "new" / "frames"
    save_animation(folder, iter(frames[:3]), 8)
    assert leftovers(folder) == ["frame_000000.png", "frame_000001.png", "frame_000002.png"]
    assert (np.asarray(Image.open(folder / "frame_000002.png")) == frames[2]).all()
    with pytest.raises(AntsError, match="empty folder"):
        save_animation(folder, frames, 8)
    (tmp_path / "empty").mkdir()
    save_animation(tmp_path / "empty", frames[:1], 8)
    assert leftovers(tmp_path / "empty") == ["frame_000000.png"]


def test_one_picture(tmp_path, frames) -> None:
    save_picture(tmp_path / "a.png", frames[0])
    assert (np.asarray(Image.open(tmp_path / "a.png")) == frames[0]).all()
    with pytest.raises(AntsError, match=r"\.png"):
        save_picture(tmp_path / "a.jpg", frames[0])


@pytest.mark.parametrize("name", ["a.gif", "frames", "new/frames"])
def test_a_disk_that_is_full_is_told_of_the_file(tmp_path, frames, monkeypatch, name) -> None:
    def full(*given: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(AntsError, match=f"cannot write .*{name}.*: no space left on device"):
        save_animation(tmp_path / name, frames)
    assert not list(tmp_path.iterdir())


def test_pictures_that_stay_the_same_are_joined(tmp_path, frames) -> None:
    shown = [frames[0]] * 3 + [frames[1]] + [frames[2]] * 4
    save_animation(tmp_path / "a.gif", shown, 10)
    pictures, durations = decoded(tmp_path / "a.gif")
    assert durations == [300, 100, 400]
    assert len(pictures) == 3


class Watched(np.ndarray):
    """A frame of which one can ask whether anybody still has it."""

    __hash__ = object.__hash__


@pytest.mark.parametrize("name", ["a.gif", "a.mp4", "frames"])
def test_frames_are_forgotten_once_they_are_written(tmp_path, frames, name) -> None:
    """So that the length of an animation takes no memory."""
    if name == "a.mp4":
        pytest.importorskip("av")
    held: weakref.WeakSet[Watched] = weakref.WeakSet()
    kept = []

    def drawn() -> Iterator[np.ndarray]:
        for number in range(30):
            frame = frames[number % len(frames)][:60, :60].copy().view(Watched)
            held.add(frame)
            yield frame
            del frame
        pictures = sum(isinstance(one, Image.Image) for one in gc.get_objects())
        kept.extend((len(held), pictures - before))

    before = sum(isinstance(one, Image.Image) for one in gc.get_objects())
    save_animation(tmp_path / name, drawn(), 8)
    assert kept[0] <= 2
    assert kept[1] <= 4


def test_a_picture_may_stay_longer_than_a_gif_can_tell(tmp_path, frames) -> None:
    save_animation(tmp_path / "a.gif", [frames[0][:9, :9]] * 80, 0.1)
    pictures, durations = decoded(tmp_path / "a.gif")
    assert sum(durations) == 800_000
    assert all((picture == pictures[0]).all() for picture in pictures)


def test_a_single_pixel_may_change(tmp_path) -> None:
    first = np.full((70, 81, 3), 255, dtype=np.uint8)
    second = first.copy()
    second[33, 57] = (0x14, 0x17, 0x1C)  # an ant's
    save_animation(tmp_path / "a.gif", [first, second, first], 10)
    pictures, _ = decoded(tmp_path / "a.gif")
    assert all((a == b).all() for a, b in zip(pictures, [first, second, first], strict=True))


@pytest.mark.parametrize("name", ["a.gif", "a.mp4", "frames"])
@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_nothing_is_left_behind(tmp_path, frames, name, error) -> None:
    if name == "a.mp4":
        pytest.importorskip("av")

    def failing() -> Iterator[np.ndarray]:
        yield from frames[:4]
        raise error

    with pytest.raises(error):
        save_animation(tmp_path / "sub" / name, failing(), 8)
    assert leftovers(tmp_path) == []


def test_an_old_file_survives_a_failure(tmp_path, frames) -> None:
    path = tmp_path / "a.gif"
    path.write_bytes(b"old")

    def failing() -> Iterator[np.ndarray]:
        yield frames[0]
        raise RuntimeError

    with pytest.raises(RuntimeError):
        save_animation(path, failing(), 8)
    assert path.read_bytes() == b"old"
    assert leftovers(tmp_path) == ["a.gif"]


@pytest.mark.parametrize("name", ["a.avi", "a.png", "a.webp", "a.gif.zip", "a.7"])
def test_wrong_endings(tmp_path, name) -> None:
    with pytest.raises(AntsError, match=r"\.gif or \.mp4"):
        check_animation(tmp_path / name, 8)
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize("fps", [0, -1, 51, float("nan"), float("inf"), True, "8"])
def test_wrong_speeds(tmp_path, fps) -> None:
    with pytest.raises(AntsError, match="fps"):
        check_animation(tmp_path / "a.gif", fps)


def test_a_missing_pyav_is_named(tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(AntsError, match=r'pip install -e "\.\[video\]"'):
        check_animation(tmp_path / "a.mp4", 8)


@pytest.mark.parametrize("place", ["/proc/nope/a.gif", "/proc/nope", "/dev/null/a.gif"])
def test_places_that_cannot_be_written(place) -> None:
    with pytest.raises(AntsError, match="cannot write"):
        check_animation(place, 8)


def test_a_folder_is_no_file(tmp_path, frames) -> None:
    (tmp_path / "a.gif").mkdir()
    with pytest.raises(AntsError, match="not a regular file"):
        save_animation(tmp_path / "a.gif", frames, 8)


@pytest.mark.parametrize("place", ["link", "dangling", "full", "file", ".", "..", ""])
def test_a_folder_that_cannot_be_made_is_refused_before_frames_are_drawn(
    tmp_path, monkeypatch, place
) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to(tmp_path / "empty")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    monkeypatch.chdir(tmp_path / "empty")
    before, path = leftovers(tmp_path), place if place in (".", "..", "") else tmp_path / place
    with pytest.raises(AntsError, match="is not an empty folder; choose a new folder"):
        check_animation(path)
    assert leftovers(tmp_path) == before


def test_frames_must_fit(tmp_path, frames) -> None:
    for wrong in (
        [],
        [frames[0], frames[0][:-1]],
        [frames[0].astype(float)],
        [frames[0][..., 0]],
        [np.zeros((9, 9, 4), np.uint8)],
    ):
        with pytest.raises(AntsError, match="frame"):
            save_animation(tmp_path / "a.gif", wrong, 8)
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "shape"), [("a.gif", (1, 65_536)), ("a.mp4", (64, 16_386)), ("a.mp4", (64, 1))]
)
def test_pictures_too_large_for_a_kind_of_file_are_refused(name, shape, tmp_path) -> None:
    pytest.importorskip("av")
    frame = np.zeros((*shape, 3), np.uint8)
    with pytest.raises(AntsError, match=r"must be from . to .* for this file type, so choose"):
        save_animation(tmp_path / name, [frame])
    assert leftovers(tmp_path) == []
    save_picture(tmp_path / "a.png", frame)


@pytest.mark.parametrize("pause", [None, -1, 61, float("nan"), float("inf"), 2**70, True, "1"])
def test_wrong_pauses(tmp_path, frames, pause) -> None:
    with pytest.raises(AntsError, match=r"^pause is .* a number of seconds from 0 to 60"):
        save_animation(tmp_path / "a.gif", frames, pause=pause)


@pytest.mark.parametrize("path", ["n" * 300, "a\0b", "\ud800"])
def test_names_that_no_folder_can_have(tmp_path, path) -> None:
    with pytest.raises(AntsError, match=r"cannot write|null character"):
        check_animation(tmp_path / path)


def test_the_last_picture_stays(tmp_path, frames) -> None:
    save_animation(tmp_path / "a.gif", frames, 10, pause=1.5)
    _, durations = decoded(tmp_path / "a.gif")
    assert durations == [100] * (len(frames) - 1) + [1500]


def test_a_check_leaves_no_folder_behind(tmp_path) -> None:
    check_animation(tmp_path / "new" / "a.gif", 8)
    assert leftovers(tmp_path) == []
