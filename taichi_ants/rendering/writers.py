"""Writers of pictures and animations; files appear only once they are complete."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, expect
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
        path: A .gif file, or a .png file for the last frame.
        fps: Frames per second, 0.1 to 50.

    Raises:
        AntsError: An argument is not allowed, or the path is not writable.
    """
    return check_file(path, "an animation", ".png", ".gif")


def is_picture(path: files.PathLike) -> bool:
    """Return whether a path names a single picture rather than an animation."""
    return Path(path).suffix.lower() == ".png"


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

    >>> pictures = rendering.frames(rendering.colony_snapshots(colony, ticks=2), size=(320, 240))
    >>> rendering.save_animation("ants.gif", pictures, fps=10)
    """
    target = check_animation(path, fps)
    expect("frames", frames, Iterable)
    checked = _checked(frames, round(pause * fps) - 1)
    if is_picture(target):
        *_, last = checked
        files.write_bytes(target, png(last, optimize=True))
    else:
        # The GIF repeats forever; Pillow merges equal frames and stores only changes.
        buffer, images = io.BytesIO(), _with_palette(checked, fps)
        changes = {"optimize": True, "transparency": _UNCHANGED, "disposal": 1}
        next(images).save(buffer, "GIF", save_all=True, append_images=images, loop=0, **changes)
        files.write_bytes(target, buffer.getvalue())


def save_picture(path: files.PathLike, frame: np.ndarray) -> None:
    """Write a picture to a PNG file; a `frame` is uint8 (height, width, 3).

    Raises AntsError if the file does not end in .png, or is not writable.

    >>> rendering.save_picture("world.png", rendering.picture(worlds.paper(), size=(320, 240)))
    """
    save_animation(check_file(path, "one picture", ".png"), [frame])


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


def _with_palette(frames: Iterable[np.ndarray], fps: float) -> Iterator[Image]:
    """Yield frames in the nearest colours of a palette, with their durations.

    The palette has the colours of scenes and of the first frame.
    """
    from PIL import Image

    nearest = np.full(1 << 24, -1, np.int16)  # the index of each colour in the palette, once known
    before = indices = palette = np.zeros(0, np.uint8)
    told, still = 0, 0  # milliseconds so far, and of the present picture
    for number, frame in enumerate(frames, start=1):
        if number == 1:
            kept, sample = map(colours.channels, (_KEPT, np.unique(colours.packed(frame))))
            free = Image.fromarray(sample[None]).quantize(_UNCHANGED - len(kept)).getpalette()
            more = np.array(free, dtype=np.uint8).reshape(-1, 3)
            palette, before = np.concatenate([kept, more])[:_UNCHANGED], ~frame
            indices = np.zeros(frame.shape[:2], np.uint8)
        # Most pixels stay, so only rows that change are converted.
        rows = np.flatnonzero((frame != before).any(axis=(1, 2)))
        words, shown = colours.packed(frame[rows]), indices.copy()
        new = np.unique(words[nearest[words] < 0])
        for some in np.array_split(new, 1 + len(new) // 4096):
            away = colours.channels(some)[:, None].astype(np.int32) - palette
            nearest[some] = (away**2).sum(axis=2).argmin(axis=1)
        shown[rows] = nearest[words]
        # GIF durations are in hundredths of a second. Rounding the end time keeps their sum exact.
        until = 10 * round(100 * number / fps)
        same = number > 1 and np.array_equal(shown, indices)
        still = until - told + (still if same else 0)
        image = Image.fromarray(shown)
        image.putpalette(palette.tobytes().ljust(3 * 256, b"\0"))
        image.info["duration"] = until - told if still <= _LONGEST else 0
        yield image
        before, indices, told = frame.copy(), shown, until
