"""Text in pictures, with the font that comes with Pillow."""

from __future__ import annotations

import unicodedata
from bisect import bisect_right
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.rendering.colours import INK, PAGE, channels

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont, ImageFont

SMALLEST = 9  # pixels; smaller text cannot be read


def write(
    frame: np.ndarray,
    text: str,
    x: float,
    baseline: float,
    size: int,
    colour: int = INK,
    align: str = "left",
    room: float | None = None,
) -> None:
    """Write a line of text into a frame; what lies beyond its edges is cut off.

    Args:
        frame: uint8 (height, width, 3).
        text: The text; the font has little but ASCII, so accents and other letters are left out.
        x, align: Pixels to the "left" edge, the "middle" or the "right" edge of the text.
        baseline: Where its letters stand, in pixels from the top.
        size: Of the font, in pixels; what is smaller than 9 cannot be read and is left out.
        room: Pixels for the text, which is shortened; None is without bounds.
    """
    if size < SMALLEST:
        return
    text = text if room is None else shortened(text, size, room)
    moved = {"left": 0.0, "middle": 0.5, "right": 1.0}[align] * width(text, size)
    mask, dx, dy = _mask(text, size)
    left, top = round(x - moved) + dx, round(baseline) + dy
    y0, x0 = max(0, -top), max(0, -left)
    y1 = min(mask.shape[0], frame.shape[0] - top)
    x1 = min(mask.shape[1], frame.shape[1] - left)
    if y0 < y1 and x0 < x1:
        share = mask[y0:y1, x0:x1]
        part = frame[top + y0 : top + y1, left + x0 : left + x1]
        ink = channels(colour).astype(np.float32)
        part[:] = part + share * (ink - part) + np.float32(0.5)


def write_on(
    frame: np.ndarray, letter: str, centre: tuple[float, float], hexagon: float, floor: int
) -> None:
    """Write a letter on a cell of the colour `floor`, dark or light as can be read."""
    x, y = centre
    size = round(0.85 * hexagon)
    red, green, blue = channels(floor).tolist()
    ink = PAGE if 0.30 * red + 0.59 * green + 0.11 * blue < 128 else INK
    write(frame, letter, x, y + 0.36 * size, size, ink, align="middle")


@lru_cache(maxsize=4096)
def width(text: str, size: int) -> float:
    """Pixels from the start of a line of text to its end."""
    return _font(size).getlength(_plain(text))


def shortened(text: str, size: int, room: float) -> str:
    """The text, or as much of its beginning as fits into `room` pixels, with three dots."""
    kept = text[: 4 * max(1, round(room))]  # more letters than there is room for
    if kept == text and width(text, size) <= room:
        return text
    n = bisect_right(range(len(kept) + 1), room, key=lambda n: width(kept[:n] + "...", size)) - 1
    return kept[:n] + "..." if n > 0 else ""


def _plain(text: str) -> str:
    return unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()


@lru_cache(maxsize=64)
def _font(size: int) -> FreeTypeFont | ImageFont:
    from PIL.ImageFont import load_default

    return load_default(size)


@lru_cache(maxsize=4096)
def _mask(text: str, size: int) -> tuple[np.ndarray, int, int]:
    """Coverage 0 to 1, float32 (height, width, 1), and where its corner lies from the start."""
    from PIL import Image, ImageDraw

    text = _plain(text)
    left, top, right, bottom = _font(size).getbbox(text, anchor="ls")
    x, y = int(left) - 1, int(top) - 1
    image = Image.new("L", (int(right) - x + 2, int(bottom) - y + 2))
    ImageDraw.Draw(image).text((-x, -y), text, fill=255, font=_font(size), anchor="ls")
    return np.asarray(image, dtype=np.float32)[:, :, None] / np.float32(255), x, y
