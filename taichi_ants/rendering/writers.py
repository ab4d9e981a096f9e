"""Files of pictures: they appear when they are whole, or not at all.

A GIF or MP4 is made in memory and written at the end. A GIF holds all frames until then, as indices
of one palette; an MP4 does not, so it is the kind for very long animations.
"""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Iterable, Iterator
from itertools import chain
from numbers import Real
from pathlib import Path
from types import ModuleType

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, expect, shown
from taichi_ants.rendering import colours

DEFAULT_FPS = 8.0
PAUSE = 1.5  # seconds, for which episodes are shown as they ended

# The colours of scenes, which all palettes hold.
_KEPT = (
    *(colours.PAGE, colours.CELL_EMPTY, colours.CELL_OBSTACLE, colours.CELL_FOOD),
    *(colours.CELL_QUEEN, colours.FLOOR_FOOD, colours.FLOOR_QUEEN, colours.ANT),
    *(colours.INK, colours.FAINT_INK, colours.RULE, colours.CHOSEN, colours.CELL_NEARER),
    *colours.TRAIL_RAMP[::6].tolist(),
)


def check_animation(path: files.PathLike, fps: float = DEFAULT_FPS) -> Path:
    """Make sure, before the work begins, that an animation can be written.

    Args:
        path: The file, .gif or .mp4; without an ending a folder for numbered PNG pictures.
        fps: Frames per second, 0.1 to 50.

    Raises:
        AntsError: The ending or the speed is not allowed, PyAV is missing for an .mp4, the folder
            holds something, or the place cannot be written to.
    """
    target = writable(path)
    if target.suffix.lower() not in (".gif", ".mp4", ""):
        raise AntsError(
            f"{str(path)!r} ends in {target.suffix!r}; an animation ends in .gif, .mp4, or in "
            "nothing for a folder of PNG pictures."
        )
    if isinstance(fps, bool) or not isinstance(fps, Real) or not 0.1 <= fps <= 50:
        # Viewers slow a GIF down that is faster.
        raise AntsError(f"fps is {shown(fps)}; it must be a number from 0.1 to 50.")
    if target.suffix.lower() == ".mp4":
        _import_av()
    if not target.suffix and target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise AntsError(
            f"{str(path)!r} exists already and is no empty folder; name a new folder, or a file "
            "that ends in .gif or .mp4."
        )
    return target


def is_picture(path: files.PathLike) -> bool:
    """Whether a path is one of a single picture, not of an animation."""
    return Path(path).suffix.lower() == ".png"


def check_picture(path: files.PathLike) -> Path:
    """Make sure that a picture can be written; raises as `save_picture` does."""
    target = writable(path)
    if not is_picture(target):
        raise AntsError(f"{str(path)!r} is to hold one picture; give it a name that ends in .png.")
    return target


def save_animation(
    path: files.PathLike,
    frames: Iterable[np.ndarray],
    fps: float = DEFAULT_FPS,
    *,
    pause: float = 0.0,
) -> None:
    """Write frames as they come; raises as `check_animation` does, which it calls first.

    Args:
        path: The file or folder, see `check_animation`. A file that exists is replaced.
        frames: At least one, uint8 (height, width, 3), all of one size.
        fps: Frames per second.
        pause: Seconds for which the last one is shown, so that it can be looked at before all
            begins anew.
    """
    target = check_animation(path, fps)
    checked = _checked(frames, round(pause * fps) - 1)
    if target.suffix:
        encoded = _mp4 if target.suffix.lower() == ".mp4" else _gif
        write(target, encoded(checked, fps))
    else:
        _write_folder(target, checked)


def save_picture(path: files.PathLike, frame: np.ndarray) -> None:
    """Write a picture, uint8 (height, width, 3), as PNG.

    Raises:
        AntsError: The file does not end in .png, or cannot be written.
    """
    target = check_picture(path)
    _check_frame(frame)
    write(target, _png(frame, optimize=True))


def writable(path: files.PathLike) -> Path:
    """The path, if files can be written to the folder that holds it, or is to hold it."""
    expect("path", path, str, os.PathLike)
    target = Path(path)
    files.check_writable_folder(_existing_folder(target))
    return target


def _existing_folder(target: Path) -> Path:
    return next(folder for folder in target.absolute().parents if folder.exists())


def write(target: Path, content: bytes) -> None:
    """Write a file into a folder that is made if it is missing."""
    files.check_writable_folder(target.parent)
    files.write_bytes(target, content)


def _write_folder(folder: Path, frames: Iterable[np.ndarray]) -> None:
    """Write numbered pictures to a folder that appears when all of them exist."""
    with tempfile.TemporaryDirectory(prefix=".", dir=_existing_folder(folder)) as place:
        whole = Path(place, "frames")
        whole.mkdir()
        for number, frame in enumerate(frames):
            (whole / f"frame_{number:06d}.png").write_bytes(_png(frame))
        folder.parent.mkdir(parents=True, exist_ok=True)
        if folder.exists():
            folder.rmdir()  # it was empty
        os.replace(whole, folder)


def _checked(frames: Iterable[np.ndarray], more: int) -> Iterator[np.ndarray]:
    """The frames, if they fit together, the last one so many times more."""
    expect("frames", frames, Iterable)
    shape = None
    for frame in frames:
        _check_frame(frame)
        shape = shape or frame.shape
        if frame.shape != shape:
            raise AntsError(
                f"a frame is {frame.shape}, the first one {shape}; all must be of one size."
            )
        yield frame
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


def _png(frame: np.ndarray, optimize: bool = False) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(frame).save(buffer, "PNG", optimize=optimize)
    return buffer.getvalue()


def _gif(frames: Iterable[np.ndarray], fps: float) -> bytes:
    """A GIF that repeats for ever; Pillow joins frames that are alike, and stores what changes."""
    from PIL import Image

    waiting = iter(frames)
    first = next(waiting)
    palette = Image.new("P", (1, 1))
    palette.putpalette(_palette(first).tobytes())

    def pictures() -> Iterator[Image.Image]:
        shown = 0
        for number, frame in enumerate(chain([first], waiting), start=1):
            picture = Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
            # A GIF counts hundredths of a second; rounded so that their sum is right.
            until = 10 * round(100 * number / fps)
            picture.info["duration"], shown = until - shown, until
            yield picture

    drawn, buffer = pictures(), io.BytesIO()
    options = {"save_all": True, "append_images": drawn, "loop": 0, "optimize": True}
    next(drawn).save(buffer, "GIF", **options)
    return buffer.getvalue()


def _palette(first: np.ndarray) -> np.ndarray:
    """Colours for all frames, uint8 (n, 3): those of scenes, and what else represents the first."""
    from PIL import Image

    kept = colours.channels(np.array(_KEPT))
    # As one number each, colours are sorted several times faster than as rows.
    sample = colours.channels(np.unique(first.astype(np.int32) @ (1 << 16, 1 << 8, 1)))
    free = Image.fromarray(sample[None]).quantize(200).getpalette()
    others = np.array(free, dtype=np.uint8).reshape(-1, 3)
    # Pillow looks colours up by their upper bits, so one close by would take a kept one's place.
    away = np.abs(others[:, None].astype(int) - kept).sum(axis=2).min(axis=1)
    return np.concatenate([kept, others[away > 20]])


def _mp4(frames: Iterable[np.ndarray], fps: float) -> bytes:
    """An MP4 (H.264); of an odd width or height it leaves out the last column or row."""
    av = _import_av()
    from fractions import Fraction

    waiting = iter(frames)
    first = next(waiting)
    height, width = first.shape[0] // 2 * 2, first.shape[1] // 2 * 2
    buffer = io.BytesIO()
    with av.open(buffer, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1000))
        stream.width, stream.height = width, height
        stream.pix_fmt = "yuv420p"
        stream.options = {
            **{"crf": "17", "preset": "superfast", "tune": "animation"},
            "x264-params": "colorprim=bt709:transfer=bt709:colormatrix=bt709",
        }
        for frame in chain([first], waiting):
            picture = np.ascontiguousarray(frame[:height, :width])
            video = av.VideoFrame.from_ndarray(picture, format="rgb24")
            # Players take pictures of this kind for BT.709, PyAV's default is BT.601.
            video = video.reformat(format="yuv420p", dst_colorspace="ITU709")
            container.mux(stream.encode(video))
        container.mux(stream.encode())
    return buffer.getvalue()


def _import_av() -> ModuleType:
    try:
        import av
    except ImportError as error:
        raise AntsError(
            f"MP4 needs PyAV, which cannot be imported ({error}); install it with "
            "pip install -e '.[video]' in the project's folder, or choose .gif."
        ) from error
    return av
