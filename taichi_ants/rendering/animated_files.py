"""Animations as GIF, WebP and MP4, written frame by frame, so that memory does not grow.

GIF and WebP hold of each frame the rectangle that has changed. Pillow encodes it; the files around
the rectangles are put together here, since Pillow itself keeps all frames until the end.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator
from itertools import chain
from types import ModuleType
from typing import BinaryIO

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.rendering.palette import TRANSPARENT, Palette

Box = tuple[int, int, int, int]  # left, top, right, bottom


def write_gif(file: BinaryIO, frames: Iterable[np.ndarray], fps: float) -> None:
    """Write frames, uint8 (height, width, 3), as a GIF that repeats for ever."""
    from PIL import Image
    from PIL.GifImagePlugin import getdata

    first, frames = _peeked(frames)
    palette = Palette(first)
    height, width = first.shape[:2]
    file.write(b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0))
    file.write(palette.table.tobytes())
    file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")
    planes = map(palette.indices, frames)
    for plane, box, previous, duration in _changes(planes, 100 / fps, align=1):
        left, top, right, bottom = box
        part = plane[top:bottom, left:right]
        if previous is not None:
            same = part == previous[top:bottom, left:right]
            part = np.where(same, np.uint8(TRANSPARENT), part)
        image = Image.fromarray(np.ascontiguousarray(part))
        # In milliseconds; the picture lies over those before it, which stay (disposal).
        look = {"duration": 10 * min(duration, 0xFFFF), "transparency": TRANSPARENT, "disposal": 1}
        file.write(b"".join(getdata(image, (left, top), interlace=0, **look)))
    file.write(b"\x3b")


def write_webp(file: BinaryIO, frames: Iterable[np.ndarray], fps: float) -> None:
    """Write frames, uint8 (height, width, 3), as a lossless WebP that repeats for ever."""
    first, frames = _peeked(frames)
    height, width = first.shape[:2]
    file.write(b"RIFF\0\0\0\0WEBP")
    canvas = _three_bytes(width - 1) + _three_bytes(height - 1)
    file.write(_chunk(b"VP8X", bytes([0x02, 0, 0, 0]) + canvas))
    file.write(_chunk(b"ANIM", b"\xff\xff\xff\xff\0\0"))
    for frame, box, previous, duration in _changes(frames, 1000 / fps, align=2):
        left, top, right, bottom = box
        part = frame[top:bottom, left:right]
        if previous is not None:
            # What has not changed is transparent, which costs next to nothing.
            part = _only_changes(previous[top:bottom, left:right], part)
        header = b"".join(
            _three_bytes(value)
            for value in (left // 2, top // 2, right - left - 1, bottom - top - 1, duration)
        )
        blends = b"\0"  # with what lies under it, which stays
        file.write(_chunk(b"ANMF", header + blends + _vp8(part)))
    size = file.tell() - 8
    file.seek(4)
    file.write(struct.pack("<I", size))
    file.seek(0, io.SEEK_END)


def _only_changes(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """A picture with alpha, uint8 (height, width, 4), all 0 where nothing has changed."""
    opaque = (before != after).any(axis=2)
    return np.dstack([after, np.full_like(opaque, 255, np.uint8)]) * opaque[..., None]


def _vp8(part: np.ndarray) -> bytes:
    """The chunk with the image data of a WebP, by Pillow."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(part)).save(buffer, "WEBP", lossless=True, method=1)
    data = buffer.getvalue()
    if data[12:16] != b"VP8L":
        raise RuntimeError("Pillow wrote a WebP of an unknown form")
    return data[12:]


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def _three_bytes(value: int) -> bytes:
    return struct.pack("<I", value)[:3]


def write_mp4(file: BinaryIO, frames: Iterable[np.ndarray], fps: float) -> None:
    """Write frames, uint8 (height, width, 3), as MP4 (H.264), an odd width or height made even."""
    noting = _FailureNote(file)
    try:
        _encode_mp4(noting, frames, fps)
    except Exception as error:
        # PyAV hides what the file has raised behind errors of its own.
        if noting.failure is None or noting.failure is error:
            raise
        raise noting.failure from error


class _FailureNote:
    """A file to write to that keeps what was raised first."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.failure: BaseException | None = None
        self.seek, self.tell = file.seek, file.tell

    def write(self, part: bytes) -> int:
        try:
            return self._file.write(part)
        except BaseException as error:
            self.failure = self.failure or error
            raise


def _encode_mp4(file: _FailureNote, frames: Iterable[np.ndarray], fps: float) -> None:
    av = import_av()
    from fractions import Fraction

    first, frames = _peeked(frames)
    height, width = first.shape[:2]
    padding = ((0, height % 2), (0, width % 2), (0, 0))
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1000))
        stream.width, stream.height = width + width % 2, height + height % 2
        stream.pix_fmt = "yuv420p"
        colours = "colorprim=bt709:transfer=bt709:colormatrix=bt709"
        stream.options = {"crf": "17", "preset": "superfast", "tune": "animation"}
        stream.options["x264-params"] = colours
        for frame in frames:
            picture = np.pad(frame, padding, mode="edge") if height % 2 or width % 2 else frame
            video = av.VideoFrame.from_ndarray(picture, format="rgb24")
            # Players take pictures of this kind for BT.709, PyAV's default is BT.601.
            video = video.reformat(format="yuv420p", dst_colorspace="ITU709")
            container.mux(stream.encode(video))
        container.mux(stream.encode())


def import_av() -> ModuleType:
    """PyAV, which is needed for MP4 only.

    Raises:
        AntsError: It is missing or cannot be loaded.
    """
    try:
        import av
    except ImportError as error:
        raise AntsError(
            f"MP4 needs PyAV, which cannot be imported ({error}); install it with "
            "pip install -e '.[video]' in the project's folder, or choose .gif or .webp."
        ) from error
    return av


def _peeked(frames: Iterable[np.ndarray]) -> tuple[np.ndarray, Iterator[np.ndarray]]:
    """The first frame, and all of them."""
    waiting = iter(frames)
    first = next(waiting)
    return first, chain([first], waiting)


def _changes(
    pictures: Iterable[np.ndarray], ticks_each: float, align: int
) -> Iterator[tuple[np.ndarray, Box, np.ndarray | None, int]]:
    """Pictures that differ from the ones before them, and for how long they are shown.

    Args:
        pictures: Arrays of one shape (height, width, ...).
        ticks_each: How long each is shown, in the file's unit of time.
        align: The boxes' left and top are multiples of this.

    Yields:
        A picture, the box outside of which it equals the one before, that one (None for the
        first), and its duration in whole ticks. Durations are rounded so that their sum is right.
    """
    waiting = iter(pictures)
    previous, current = None, next(waiting)
    box, shown, number = _whole_box(current), 0, 1
    for picture in waiting:
        changed = _changed_box(current, picture, align)
        if changed is not None:
            ticks = round(number * ticks_each)
            yield current, box, previous, ticks - shown
            previous, current, box, shown = current, picture, changed, ticks
        number += 1
    yield current, box, previous, round(number * ticks_each) - shown


def _whole_box(picture: np.ndarray) -> Box:
    return 0, 0, picture.shape[1], picture.shape[0]


def _changed_box(before: np.ndarray, after: np.ndarray, align: int) -> Box | None:
    """The smallest box around all that differs; None where nothing does."""
    height, width = after.shape[:2]
    differs = before.reshape(height, -1) != after.reshape(height, -1)
    rows = np.flatnonzero(differs.any(axis=1))
    if not len(rows):
        return None
    changed = differs[rows[0] : rows[-1] + 1].any(axis=0)
    columns = np.flatnonzero(changed.reshape(width, -1).any(axis=1))
    left, top = int(columns[0]), int(rows[0])
    left, top = left - left % align, top - top % align
    return left, top, int(columns[-1]) + 1, int(rows[-1]) + 1
