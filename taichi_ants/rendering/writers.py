"""Writers of pictures and animations; files appear only once they are complete."""

from __future__ import annotations

import io
import os
import struct
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain, groupby
from numbers import Real
from pathlib import Path
from typing import BinaryIO

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, expect, imported, shown
from taichi_ants.rendering import colours

DEFAULT_FPS = 8.0
PAUSE = 1.5  # seconds for which the last frame of an episode is shown
# The shortest and the longest side of a picture in pixels, by file type. PNG is limited by memory.
_SIDES = {".gif": (1, 65_535), ".mp4": (2, 16_384), "": (1, 2**31 - 1)}

_SAME = 255  # colour index of unchanged pixels in a GIF; palettes use fewer colours
_LONGEST = 600  # seconds for which a GIF shows one picture; the format allows 655

# Colours of scenes, which are in every palette. Steps of ramps are too small to see.
_KEPT = np.unique(
    [
        *(colours.PAGE, colours.CELL_EMPTY, colours.CELL_OBSTACLE, colours.CELL_NEARER),
        *(colours.INK, colours.FAINT_INK, colours.RULE, colours.CHOSEN, colours.FOOD_DOT),
        *(*colours.QUEENS, *colours.ANTS, *colours.FOODS),
        *colours.floors(colours.QUEENS, colours.FLOOR_QUEEN),
        *colours.floors(colours.FOODS, colours.FLOOR_FOOD),
        *colours.TRAIL_RAMP[::6],
        *(word for n in range(colours.N_FIELDS) for word in colours.field_ramp(n)[255::-36]),
    ]
)


def check_animation(path: files.PathLike, fps: float = DEFAULT_FPS) -> Path:
    """Return the path of an animation after checking that it can be written.

    Args:
        path: A .gif or .mp4 file; without an extension, a new folder for numbered PNG pictures.
        fps: Frames per second, 0.1 to 50.

    Raises:
        AntsError: An argument is not allowed, the path is not writable, or PyAV is missing.
    """
    expect("path", path, str, os.PathLike)
    target = Path(path)
    is_old_folder = not target.suffix and os.path.lexists(target)
    if not is_old_folder:
        files.check_writable_file(target)
    if target.suffix.lower() not in (".gif", ".mp4", ""):
        raise AntsError(
            f"{str(path)!r} ends in {target.suffix!r}; an animation must end in .gif or .mp4, or "
            "have no extension to make a folder of PNG pictures."
        )
    _check_number("fps", fps, "number", 0.1, 50)  # viewers slow down faster GIFs
    if target.suffix.lower() == ".mp4":
        imported("an MP4 file", "av", "video")
    if is_old_folder:
        files.check_writable_folder(target.absolute().parent)
        named = target.name not in ("", "..") and not target.is_symlink()
        if not (named and target.is_dir() and not any(target.iterdir())):
            raise AntsError(
                f"{str(path)!r} already exists and is not an empty folder; choose a new folder, or "
                "a file that ends in .gif or .mp4."
            )
    return target


def _check_number(name: str, value: float, kind: str, least: float, most: float) -> None:
    if isinstance(value, bool) or not isinstance(value, Real) or not least <= value <= most:
        raise AntsError(f"{name} is {shown(value)}; it must be a {kind} from {least} to {most}.")


def is_picture(path: files.PathLike) -> bool:
    """Return whether a path names a single picture rather than an animation."""
    return Path(path).suffix.lower() == ".png"


def check_picture(path: files.PathLike) -> Path:
    """Return the path of a picture after checking it; raises as `save_picture` does."""
    return check_single(path, "one picture", ".png")


def check_single(path: files.PathLike, holds: str, *endings: str) -> Path:
    """Return a path after checking its extension and that it is writable; AntsError if not."""
    target = files.check_writable_file(path)
    if target.suffix.lower() not in endings:
        raise AntsError(
            f"{str(path)!r} cannot hold {holds}; choose a file name that ends in {endings[0]}."
        )
    return target


def save_animation(
    path: files.PathLike,
    frames: Iterable[np.ndarray],
    fps: float = DEFAULT_FPS,
    *,
    pause: float = 0.0,
) -> None:
    """Write an animation frame by frame; checks and raises as `check_animation` does.

    Args:
        path: The file or folder, see `check_animation`. An existing file is replaced.
        frames: One or more frames, uint8 (height, width, 3), all of the same size.
        fps: Frames per second.
        pause: Seconds, at most 60, for which the last frame is shown before the animation repeats.
    """
    target = check_animation(path, fps)
    _check_number("pause", pause, "number of seconds", 0, 60)
    sides = _SIDES.get(target.suffix.lower(), _SIDES[""])
    checked = _checked(frames, round(pause * fps) - 1, sides)
    encode = _mp4 if target.suffix.lower() == ".mp4" else _gif
    missing = [folder for folder in target.absolute().parents if not folder.exists()]
    try:
        files.check_writable_folder(target.parent)
        if target.suffix:
            first = next(checked)
            every = chain([first], checked)
            files.write_atomically(target, lambda file: encode(file, first, every, fps))
        else:
            _write_folder(target, checked)
    except BaseException:
        for folder in missing:
            with suppress(OSError):
                folder.rmdir()
        raise


def save_picture(path: files.PathLike, frame: np.ndarray) -> None:
    """Write a picture, uint8 (height, width, 3), as PNG.

    Raises:
        AntsError: The file does not end in .png, or is not writable.
    """
    target = check_picture(path)
    _check_frame(frame)
    write(target, png(frame, optimize=True))


def write(target: Path, content: bytes) -> None:
    """Write a file, and create its folder if it is missing."""
    files.check_writable_folder(target.parent)
    files.write_atomically(target, lambda file: file.write(content))


def _write_folder(folder: Path, frames: Iterable[np.ndarray]) -> None:
    """Write numbered pictures to a folder that appears only once it is complete."""
    with files.writing(folder), files.unfinished(folder) as whole:
        whole.mkdir()
        for number, frame in enumerate(frames):
            (whole / f"frame_{number:06d}.png").write_bytes(png(frame))
        if folder.exists():
            folder.rmdir()  # `check_animation` has checked that it is empty
        os.replace(whole, folder)


def _checked(
    frames: Iterable[np.ndarray], more: int, sides: tuple[int, int]
) -> Iterator[np.ndarray]:
    """Yield the frames after checking their sizes, and the last one `more` times again."""
    try:
        coming = iter(frames)
    except TypeError:
        raise AntsError(f"frames is {shown(frames)}; it must be an iterable of arrays.") from None
    shape = None
    for number, frame in enumerate(coming):
        _check_frame(frame, sides)
        shape = shape or frame.shape
        if frame.shape != shape:
            raise AntsError(
                f"frame {number} has shape {frame.shape}, but frame 0 has {shape}; give all frames "
                "the same shape."
            )
        yield frame
    if shape is None:
        raise AntsError("frames is empty; give at least one frame.")
    for _ in range(more):
        yield frame


def _check_frame(frame: np.ndarray, sides: tuple[int, int] = _SIDES[""]) -> None:
    expect("a frame", frame, np.ndarray)
    if frame.dtype != np.uint8 or frame.shape[2:] != (3,) or 0 in frame.shape:
        raise AntsError(
            f"a frame is {frame.dtype} {frame.shape}; it must be uint8 (height, width, 3)."
        )
    height, width = frame.shape[:2]
    least, most = sides
    if not least <= min(height, width) <= max(height, width) <= most:
        raise AntsError(
            f"a frame is {width} pixels wide and {height} high; each side must be from {least} to "
            f"{most} for this file type, so choose another size or file type."
        )


def png(frame: np.ndarray, optimize: bool = False) -> bytes:
    """Return a picture, uint8 (height, width, 3), as the bytes of a PNG file."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(frame).save(buffer, "PNG", optimize=optimize)
    return buffer.getvalue()


def _gif(file: BinaryIO, first: np.ndarray, frames: Iterable[np.ndarray], fps: float) -> None:
    """Write a GIF that repeats forever.

    Pillow's own writer holds all frames in memory. This one holds two, lets Pillow compress the
    difference, and merges equal frames.
    """
    from PIL import GifImagePlugin, Image

    palette = _palette(first)
    nearest = np.full(1 << 24, -1, np.int16)  # the index of each colour in the palette, once known
    height, width = first.shape[:2]
    file.write(b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0))
    file.write(palette.tobytes().ljust(3 * 256, b"\0"))
    file.write(b"!\xff\x0bNETSCAPE2.0\x03\x01\0\0\0")  # repeat without end

    def drawn() -> Iterator[tuple[int, bytes]]:
        for number, frame in enumerate(frames, start=1):
            words = frame.astype(np.int32) @ (1 << 16, 1 << 8, 1)
            new = np.unique(words[nearest[words] < 0])
            for some in np.array_split(new, 1 + len(new) // 4096):
                away = colours.channels(some)[:, None].astype(np.int32) - palette
                nearest[some] = (away**2).sum(axis=2).argmin(axis=1)
            yield number, nearest[words].astype(np.uint8).tobytes()

    before, shown = np.full((height, width), _SAME, np.uint8), 0
    most = _LONGEST * fps
    for _, same in groupby(drawn(), key=lambda frame: (frame[1], (frame[0] - 1) // most)):
        ((number, content),) = deque(same, maxlen=1)
        picture = np.frombuffer(content, np.uint8).reshape(height, width)
        differs = picture != before
        box = Image.fromarray(differs).getbbox() or (0, 0, 1, 1)
        change = Image.fromarray(np.where(differs, picture, np.uint8(_SAME))).crop(box)
        # GIF durations are in hundredths of a second. Rounding the end time keeps their sum exact.
        until = 10 * round(100 * number / fps)
        options = {"duration": until - shown, "transparency": _SAME, "disposal": 1}
        for part in GifImagePlugin.getdata(change, box[:2], **options):
            file.write(part)
        before, shown = picture, until
    file.write(b";")


def _palette(first: np.ndarray) -> np.ndarray:
    """Return a palette for all frames, uint8 (n, 3): the colours of scenes and the first frame."""
    from PIL import Image

    kept = colours.channels(_KEPT)
    # Colours packed into integers sort several times faster than rows.
    sample = colours.channels(np.unique(first.astype(np.int32) @ (1 << 16, 1 << 8, 1)))
    free = Image.fromarray(sample[None]).quantize(_SAME - len(kept)).getpalette()
    return np.concatenate([kept, np.array(free, dtype=np.uint8).reshape(-1, 3)])[:_SAME]


def _mp4(file: BinaryIO, first: np.ndarray, frames: Iterable[np.ndarray], fps: float) -> None:
    """Write an MP4 (H.264), without the last column or row of an odd width or height."""
    av = imported("an MP4 file", "av", "video")
    from fractions import Fraction

    height, width = first.shape[0] // 2 * 2, first.shape[1] // 2 * 2
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1000))
        stream.width, stream.height = width, height
        stream.pix_fmt = "yuv420p"
        stream.options = {
            **{"crf": "17", "preset": "superfast", "tune": "animation"},
            "x264-params": "colorprim=bt709:transfer=bt709:colormatrix=bt709",
        }
        for frame in frames:
            picture = np.ascontiguousarray(frame[:height, :width])
            video = av.VideoFrame.from_ndarray(picture, format="rgb24")
            # Players assume BT.709 for such videos, but PyAV's default is BT.601.
            video = video.reformat(format="yuv420p", dst_colorspace="ITU709")
            container.mux(stream.encode(video))
        container.mux(stream.encode())
