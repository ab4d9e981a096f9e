"""Files of pictures: they appear when they are whole, or not at all."""

from __future__ import annotations

import math
import os
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from numbers import Real
from pathlib import Path
from typing import BinaryIO

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, expect, shown
from taichi_ants.rendering import animated_files

PathLike = str | os.PathLike[str]
Progress = Callable[[float], None]  # called with the share of the work that is done, 0 to 1

DEFAULT_FPS = 8.0
PAUSE = 1.5  # seconds, for which episodes are shown as they ended

_ANIMATIONS: dict[str, Callable[[BinaryIO, Iterable[np.ndarray], float], None]] = {
    ".gif": animated_files.write_gif,
    ".webp": animated_files.write_webp,
    ".mp4": animated_files.write_mp4,
}
# The widest and highest picture that a kind of file can hold.
_LARGEST = {".gif": 65_535, ".webp": 16_383, ".mp4": 16_384}
# Viewers slow a GIF down whose frames are shorter than two hundredths of a second.
_FASTEST = {".gif": 50.0}
_MAX_FPS = 240.0


def check_animation(path: PathLike, fps: float) -> Path:
    """Make sure, before the work begins, that an animation can be written.

    Args:
        path: The file, its ending is the kind; without an ending a folder for numbered pictures.
        fps: Frames per second.

    Returns:
        The path.

    Raises:
        AntsError: The ending or the speed is not allowed, PyAV is missing for an .mp4, or the place
            cannot be written to.
    """
    target = _named_place(path)
    kind = target.suffix.lower()
    if kind and kind not in _ANIMATIONS:
        raise AntsError(
            f"{str(path)!r} ends in {target.suffix!r}; an animation ends in "
            f"{', '.join(_ANIMATIONS)}, or in nothing for a folder of PNG pictures."
        )
    fastest = _FASTEST.get(kind, _MAX_FPS)
    if (
        isinstance(fps, bool)
        or not isinstance(fps, Real)
        or not 0.1 <= fps <= fastest
        or not math.isfinite(fps)
    ):
        raise AntsError(
            f"fps is {shown(fps)}; it must be a number from 0.1 to {fastest:g} for "
            f"{kind or 'pictures'}."
        )
    if kind == ".mp4":
        animated_files.import_av()
    if not kind and target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise AntsError(
            f"{str(path)!r} exists already and is no empty folder; name a new folder, or a file "
            f"that ends in {', '.join(_ANIMATIONS)}."
        )
    with _folder_of(target, keep=False):
        pass
    return target


def save_animation(
    path: PathLike,
    frames: Iterable[np.ndarray],
    fps: float = DEFAULT_FPS,
    *,
    pause: float = 0.0,
    n: int = 0,
    progress: Progress | None = None,
) -> None:
    """Write frames as they come; raises as `check_animation` does, which it calls first.

    Args:
        path: The file or folder, see `check_animation`. A file that exists is replaced.
        frames: At least one, uint8 (height, width, 3), all of one size.
        fps: Frames per second.
        pause: Seconds for which the last one is shown, so that it can be looked at before all
            begins anew.
        n: How many frames there are, for `progress`.
        progress: Called after each frame with the share of the work that is done.
    """
    target = check_animation(path, fps)
    kind = target.suffix.lower()
    checked = _checked(frames, kind, round(pause * fps) - 1, n, progress)
    with _folder_of(target):
        if kind:
            write = _ANIMATIONS[kind]
            files.write_atomically(target, lambda file: write(file, checked, fps))
        else:
            _save_pictures(target, checked)


def save_picture(path: PathLike, frame: np.ndarray) -> None:
    """Write a picture, uint8 (height, width, 3), as PNG.

    Raises:
        AntsError: The file does not end in .png, or cannot be written.
    """
    target = check_picture(path)
    _check_frame(frame)
    with _folder_of(target):
        files.write_atomically(target, lambda file: _write_png(file, frame, optimize=True))


def check_picture(path: PathLike) -> Path:
    """Make sure that a picture can be written; raises as `save_picture` does."""
    target = _named_place(path)
    if target.suffix.lower() != ".png":
        raise AntsError(f"{str(path)!r} is to hold one picture; give it a name that ends in .png.")
    with _folder_of(target, keep=False):
        pass
    return target


def _named_place(path: PathLike) -> Path:
    """The path, unless it ends both as a folder and as a file do."""
    expect("path", path, str, os.PathLike)
    target, name = Path(path), os.fspath(path)
    if target.suffix and name.endswith(("/", os.sep)):
        raise AntsError(
            f"{name!r} ends in {target.suffix!r} as a file and in {name[-1]!r} as a folder; leave "
            "out the one or the other."
        )
    return target


def _write_png(file: BinaryIO, frame: np.ndarray, optimize: bool = False) -> None:
    from PIL import Image

    Image.fromarray(frame).save(file, "PNG", optimize=optimize)


def _save_pictures(folder: Path, frames: Iterable[np.ndarray]) -> None:
    """Write numbered pictures to a folder that appears when all of them exist."""
    temporary = folder.parent / f".{secrets.token_hex(8)}.tmp"
    try:
        temporary.mkdir()
        for number, frame in enumerate(frames):
            with open(temporary / f"frame_{number:06d}.png", "xb") as file:
                _write_png(file, frame)
        if folder.exists():
            folder.rmdir()  # it was empty
        os.replace(temporary, folder)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise AntsError(f"cannot write {str(folder)!r}: {reason}; choose another place.") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _checked(
    frames: Iterable[np.ndarray], kind: str, more: int, n: int, progress: Progress | None
) -> Iterator[np.ndarray]:
    """The frames, if they are what the kind of file can hold, the last one so many times more."""
    if not isinstance(frames, Iterable):
        raise AntsError(f"frames is {shown(frames)}; it must be several pictures.")
    shape = None
    for done, frame in enumerate(frames, start=1):
        _check_frame(frame)
        if shape is None:
            height, width, _ = shape = frame.shape
            most = _LARGEST.get(kind, max(width, height))
            if max(width, height) > most:
                raise AntsError(
                    f"the frames are {width} x {height} pixels; a {kind} holds at most {most} in "
                    "width and height, draw them smaller."
                )
        if frame.shape != shape:
            raise AntsError(
                f"a frame is {frame.shape}, the first one {shape}; all must be of one size."
            )
        yield frame
        if progress is not None:
            progress(done / max(n, done))
    if shape is None:
        raise AntsError("there are no frames; an animation needs at least one.")
    for _ in range(more):
        yield frame


def _check_frame(frame: np.ndarray) -> None:
    expect("a frame", frame, np.ndarray)
    if frame.dtype != np.uint8 or frame.shape[2:] != (3,) or 0 in frame.shape:
        raise AntsError(
            f"a frame is {frame.dtype} {frame.shape}; it must be uint8 (height, width, 3)."
        )


@contextmanager
def _folder_of(target: Path, keep: bool = True) -> Iterator[None]:
    """Make the folder that a file goes to; without `keep`, or on failure, it goes again."""
    missing = [folder for folder in target.parents if not folder.exists()]
    done = False
    try:
        files.check_writable_folder(target.parent)
        yield
        done = keep
    finally:
        if not done:
            for folder in missing:
                with suppress(OSError):
                    folder.rmdir()
