"""Writers of pictures and animations; files appear only once they are complete."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, BinaryIO

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, expect, imported
from taichi_ants.rendering import colours
from taichi_ants.settings import Setting, checked_arguments

if TYPE_CHECKING:
    from PIL.Image import Image

PAUSE = 1.5  # seconds for which the last frame of an episode is shown
_UNCHANGED = 255  # colour index of unchanged pixels in a GIF; palettes use fewer colours
_LONGEST = 600_000  # milliseconds for which a GIF shows one picture; the format allows 655 350
Fps = Annotated[float, Setting(least=0.1, most=50)]  # viewers slow down faster GIFs

# Colours of scenes, which are in every palette. Steps of ramps are too small to see.
_KEPT = np.unique(
    [
        *(colours.PAGE, colours.CELL_EMPTY, colours.CELL_OBSTACLE, colours.CELL_NEARER),
        *(colours.INK, colours.FAINT_INK, colours.RULE, colours.CHOSEN, colours.FOOD_DOT),
        *(*colours.QUEENS, *colours.ANTS, *colours.FOODS),
        *(*colours.QUEEN_FLOORS, *colours.FOOD_FLOORS),
        *colours.TRAIL_RAMP[::6],
        *(word for n in range(colours.N_FIELDS) for word in colours.field_ramp(n)[255::-36]),
    ]
)


@checked_arguments
def check_animation(path: files.PathLike, fps: Fps = 8.0) -> Path:
    """Return the path of an animation after checking that it can be written.

    Args:
        path: A .gif or .mp4 file, or a .png file for the last frame.
        fps: Frames per second, 0.1 to 50.

    Raises:
        AntsError: An argument is not allowed, the path is not writable, or PyAV is missing.
    """
    target = check_file(path, "an animation", *_ENCODERS)
    if target.suffix.lower() == ".mp4":
        imported("an MP4 file", "av", "video")
    return target


def is_picture(path: files.PathLike) -> bool:
    """Return whether a path names a single picture rather than an animation."""
    return Path(path).suffix.lower() == ".png"


def check_picture(path: files.PathLike) -> Path:
    """Return the path of a picture after checking it; raises as `save_picture` does."""
    return check_file(path, "one picture", ".png")


def check_file(path: files.PathLike, holds: str, *endings: str) -> Path:
    """Return a path after checking its extension and that it is writable; AntsError if not."""
    target = files.check_writable_file(path)
    if target.suffix.lower() not in endings:
        raise AntsError(
            f"{str(path)!r} cannot hold {holds}; choose a file name that ends in "
            f"{' or '.join(endings)}."
        )
    return target


@checked_arguments
def save_animation(
    path: files.PathLike,
    frames: Iterable[np.ndarray],
    fps: Fps = 8.0,
    *,
    pause: Annotated[float, Setting(least=0, most=60)] = 0.0,
) -> None:
    """Write an animation; checks and raises as `check_animation` does.

    Args:
        path: The file, see `check_animation`. An existing file is replaced.
        frames: One or more frames, uint8 (height, width, 3), all of the same size.
        fps: Frames per second.
        pause: Seconds, at most 60, for which the last frame is shown before the animation repeats.
    """
    target = check_animation(path, fps)
    expect("frames", frames, Iterable)
    checked = _checked(frames, round(pause * fps) - 1)
    content, first = io.BytesIO(), next(checked)
    _ENCODERS[target.suffix.lower()](content, first, chain([first], checked), fps)
    write(target, content.getvalue())


def save_picture(path: files.PathLike, frame: np.ndarray) -> None:
    """Write a picture, uint8 (height, width, 3), as PNG.

    Raises:
        AntsError: The file does not end in .png, or is not writable.
    """
    save_animation(check_picture(path), [frame])


def write(target: Path, content: bytes) -> None:
    """Write a file, and create its folder if it is missing."""
    files.check_writable_folder(target.parent)
    files.write_atomically(target, lambda file: file.write(content))


def _checked(frames: Iterable[np.ndarray], more: int = 0) -> Iterator[np.ndarray]:
    """Yield the frames after checking their shapes, and the last one `more` times again."""
    frame = shape = None
    for number, frame in enumerate(frames):
        expect("a frame", frame, np.ndarray)
        shape = shape or frame.shape
        if frame.dtype != np.uint8 or shape[2:] != (3,) or 0 in shape or frame.shape != shape:
            raise AntsError(
                f"frame {number} is {frame.dtype} {frame.shape}; all frames must be uint8 (height, "
                "width, 3) of one size."
            )
        yield frame
    if frame is None:
        raise AntsError("frames is empty; give at least one frame.")
    for _ in range(more):
        yield frame


def png(frame: np.ndarray, optimize: bool = False) -> bytes:
    """Return a picture, uint8 (height, width, 3), as the bytes of a PNG file."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(frame).save(buffer, "PNG", optimize=optimize)
    return buffer.getvalue()


def _gif(file: BinaryIO, first: np.ndarray, frames: Iterable[np.ndarray], fps: float) -> None:
    """Write a GIF that repeats forever; Pillow merges equal frames and stores only changes."""
    images = _with_palette(frames, _palette(first), fps)
    changes = {"optimize": True, "transparency": _UNCHANGED, "disposal": 1}
    next(images).save(file, "GIF", save_all=True, append_images=images, loop=0, **changes)


def _with_palette(frames: Iterable[np.ndarray], palette: np.ndarray, fps: float) -> Iterator[Image]:
    """Yield frames in the nearest colours of a palette, each with its duration."""
    from PIL import Image

    nearest = np.full(1 << 24, -1, np.int16)  # the index of each colour in the palette, once known
    before, told, still = np.zeros(0), 0, 0  # milliseconds so far, and of the present picture
    for number, frame in enumerate(frames, start=1):
        words = frame.astype(np.int32) @ (1 << 16, 1 << 8, 1)
        new = np.unique(words[nearest[words] < 0])
        for some in np.array_split(new, 1 + len(new) // 4096):
            away = colours.channels(some)[:, None].astype(np.int32) - palette
            nearest[some] = (away**2).sum(axis=2).argmin(axis=1)
        indices = nearest[words].astype(np.uint8)
        # GIF durations are in hundredths of a second. Rounding the end time keeps their sum exact.
        until = 10 * round(100 * number / fps)
        still = until - told + (still if np.array_equal(indices, before) else 0)
        image = Image.fromarray(indices)
        image.putpalette(palette.tobytes().ljust(3 * 256, b"\0"))
        image.info["duration"] = until - told if still <= _LONGEST else 0
        yield image
        before, told = indices, until


def _palette(first: np.ndarray) -> np.ndarray:
    """Return a palette for all frames, uint8 (n, 3): the colours of scenes and the first frame."""
    from PIL import Image

    kept = colours.channels(_KEPT)
    # Colours packed into integers sort several times faster than rows.
    sample = colours.channels(np.unique(first.astype(np.int32) @ (1 << 16, 1 << 8, 1)))
    free = Image.fromarray(sample[None]).quantize(_UNCHANGED - len(kept)).getpalette()
    return np.concatenate([kept, np.array(free, dtype=np.uint8).reshape(-1, 3)])[:_UNCHANGED]


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


def _png(file: BinaryIO, first: np.ndarray, frames: Iterable[np.ndarray], fps: float) -> None:
    """Write the last frame."""
    *_, last = frames
    file.write(png(last, optimize=True))


# Functions that write frames into a file, by its ending.
_ENCODERS = {".png": _png, ".gif": _gif, ".mp4": _mp4}
