"""Files of pictures: what is in them, and that they are whole or not there."""

from __future__ import annotations

import errno
import io
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
    animated_files,
    check_animation,
    save_animation,
    save_picture,
)
from taichi_ants.worlds import paper

SIZE = (330, 324)


@pytest.fixture(scope="module")
def frames() -> list[np.ndarray]:
    episode = Episode.play(paper(), trail_follower(), max_steps=24)
    return list(rendering.frames(episode.moments(), SIZE, title="a title"))


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


def test_webp_is_lossless(tmp_path, frames) -> None:
    save_animation(tmp_path / "a.webp", frames, 30)
    pictures, durations = decoded(tmp_path / "a.webp")
    assert all((a == b).all() for a, b in zip(pictures, frames, strict=True))
    assert sum(durations) == pytest.approx(len(frames) * 1000 / 30, abs=1)


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
        assert picture.shape == (324, 330, 3)
        # Edges lose some colour; the large patches must not.
        error = np.abs(picture[:, :329].astype(int) - frame)
        assert error.mean() < 4
        assert np.median(error) <= 2
        # Trails and bars keep their hue, so the colour space is the one that the file names.
        bright = frame.max(axis=2).astype(int) - frame.min(axis=2) > 100
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


@pytest.mark.parametrize("ending", [".gif", ".webp"])
def test_pictures_that_stay_the_same_are_joined(tmp_path, frames, ending) -> None:
    shown = [frames[0]] * 3 + [frames[1]] + [frames[2]] * 4
    save_animation(tmp_path / f"a{ending}", shown, 10)
    pictures, durations = decoded(tmp_path / f"a{ending}")
    assert durations == [300, 100, 400]
    assert len(pictures) == 3


@pytest.mark.parametrize("ending", [".gif", ".webp"])
def test_a_single_pixel_may_change(tmp_path, ending) -> None:
    first = np.full((70, 81, 3), 255, dtype=np.uint8)
    second = first.copy()
    second[33, 57] = (0x14, 0x17, 0x1C)  # an ant's
    save_animation(tmp_path / f"a{ending}", [first, second, first], 10)
    pictures, _ = decoded(tmp_path / f"a{ending}")
    assert all((a == b).all() for a, b in zip(pictures, [first, second, first], strict=True))


@pytest.mark.parametrize("name", ["a.gif", "a.webp", "a.mp4", "frames"])
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


class FullDisk(io.BytesIO):
    """Takes only so many bytes."""

    def __init__(self, room: int) -> None:
        super().__init__()
        self.room = room

    def write(self, part: bytes) -> int:
        if self.tell() + len(part) > self.room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(part)


@pytest.mark.parametrize("room", [0, 40, 100, 20_000, -200, -1])
@pytest.mark.parametrize("ending", ["gif", "webp", "mp4"])
def test_a_disk_that_fills_up_is_named_as_it_is(ending, room) -> None:
    """Not as an error of PyAV's; `room` counts from the end if it is below 0."""
    if ending == "mp4":
        pytest.importorskip("av")
    write = getattr(animated_files, f"write_{ending}")
    noise = np.random.default_rng(0).integers(0, 256, (30, 96, 96, 3)).astype(np.uint8)
    whole = FullDisk(10**9)
    write(whole, iter(noise), 8)
    assert len(whole.getvalue()) > 20_000
    with pytest.raises(OSError, match="No space left") as caught:
        write(FullDisk(room % len(whole.getvalue())), iter(noise), 8)
    assert type(caught.value) is OSError


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


@pytest.mark.parametrize("name", ["a.gif", "a.webp", "a.mp4", "frames"])
def test_memory_does_not_grow(tmp_path, name) -> None:
    if name == "a.mp4":
        pytest.importorskip("av")
    alive: weakref.WeakSet = weakref.WeakSet()
    most = 0

    class Picture(np.ndarray):
        """An array that can be counted."""

        __hash__ = object.__hash__

    def many() -> Iterator[np.ndarray]:
        nonlocal most
        for number in range(30):
            frame = np.full((64, 64, 3), number, dtype=np.uint8).view(Picture)
            alive.add(frame)
            most = max(most, len(alive))
            yield frame
            del frame

    save_animation(tmp_path / name, many(), 10)
    assert most <= 6


@pytest.mark.parametrize("name", ["a.avi", "a.png", "a.jpeg", "a.gif.zip", "a.7"])
def test_wrong_endings(tmp_path, name) -> None:
    with pytest.raises(AntsError, match=r"\.gif, \.webp, \.mp4"):
        check_animation(tmp_path / name, 8)
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize("name", ["a.gif", "a.png", "a.folder"])
def test_a_file_with_a_slash_is_refused(tmp_path, frames, name) -> None:
    path = f"{tmp_path}/{name}/"
    with pytest.raises(AntsError, match="leave out the one or the other"):
        check_animation(path, 8)
    with pytest.raises(AntsError, match="leave out the one or the other"):
        save_picture(path, frames[0])
    assert leftovers(tmp_path) == []
    save_animation(f"{tmp_path}/frames/", frames[:1], 8)
    assert leftovers(tmp_path / "frames") == ["frame_000000.png"]


@pytest.mark.parametrize("fps", [0, -1, 51, float("nan"), float("inf"), True, "8"])
def test_wrong_speeds(tmp_path, fps) -> None:
    with pytest.raises(AntsError, match="fps"):
        check_animation(tmp_path / "a.gif", fps)


def test_a_missing_pyav_is_named(tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(AntsError, match=r"pip install -e '\.\[video\]'"):
        check_animation(tmp_path / "a.mp4", 8)


@pytest.mark.parametrize("place", ["/proc/nope/a.gif", "/proc/nope", "/dev/null/a.webp"])
def test_places_that_cannot_be_written(place) -> None:
    with pytest.raises(AntsError, match="cannot write"):
        check_animation(place, 8)


def test_a_folder_is_no_file(tmp_path, frames) -> None:
    (tmp_path / "a.gif").mkdir()
    with pytest.raises(AntsError, match="not a regular file"):
        save_animation(tmp_path / "a.gif", frames, 8)


@pytest.mark.parametrize(("name", "most"), [("a.gif", 65_535), ("a.webp", 16_383)])
@pytest.mark.parametrize("upright", [False, True])
def test_pictures_that_a_kind_of_file_cannot_hold(tmp_path, name, most, upright) -> None:
    """Refused before a file is begun, where the file's format ends."""

    def frame(side: int) -> np.ndarray:
        return np.zeros((side, 1, 3) if upright else (1, side, 3), np.uint8)

    drawn = []

    def many():
        for number in range(3):
            drawn.append(number)
            yield frame(most + 1)

    with pytest.raises(AntsError, match=f"{most} in width"):
        save_animation(tmp_path / "new" / name, many(), 8)
    assert drawn == [0]
    assert leftovers(tmp_path) == []
    save_animation(tmp_path / name, [frame(most)], 8)
    with Image.open(tmp_path / name) as image:
        assert max(image.size) == most


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


def test_the_last_picture_stays_and_progress_is_told(tmp_path, frames) -> None:
    shares: list[float] = []
    options = {"pause": 1.5, "n": len(frames), "progress": shares.append}
    save_animation(tmp_path / "a.gif", frames, 10, **options)
    assert shares == [(done + 1) / len(frames) for done in range(len(frames))]
    _, durations = decoded(tmp_path / "a.gif")
    assert durations == [100] * (len(frames) - 1) + [1500]
