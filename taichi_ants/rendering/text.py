"""Text in pictures, in Pillow's default font."""

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
    """Write a line of text into a frame, clipped at the edges of the frame.

    Args:
        frame: uint8 (height, width, 3).
        text: The text. Accents and letters outside ASCII are removed.
        x, align: The x coordinate of the "left" edge, the "middle" or the "right" edge of the text.
        baseline: The y coordinate of the baseline.
        size: The font size in pixels. Below 9, text is unreadable and nothing is drawn.
        room: The largest width in pixels; longer text is shortened. None means no limit.
    """
    if size < SMALLEST:
        return
    from PIL import Image, ImageDraw

    text = text if room is None else shortened(text, size, room)
    start = {"left": 0.0, "middle": 0.5, "right": 1.0}[align] * width(text, size)
    x, y, n = round(x - start), round(baseline), round(width(text, size))
    top, left = max(0, y - 2 * size), max(0, x - size)
    part = frame[top : y + size, left : x + n + size]  # a copy of the whole frame would be slow
    image, ink = Image.fromarray(part), tuple(channels(colour).tolist())
    ImageDraw.Draw(image).text((x - left, y - top), _plain(text), ink, _font(size), anchor="ls")
    part[:] = image


def write_on(
    frame: np.ndarray, letter: str, centre: tuple[float, float], hexagon: float, floor: int
) -> None:
    """Write a letter on a cell, dark or light in contrast to the cell's colour `floor`."""
    x, y = centre
    size = round(0.85 * hexagon)
    red, green, blue = channels(floor).tolist()
    ink = PAGE if 0.30 * red + 0.59 * green + 0.11 * blue < 128 else INK
    write(frame, letter, x, y + 0.36 * size, size, ink, align="middle")


@lru_cache(maxsize=4096)
def width(text: str, size: int) -> float:
    """Return the width of a line of text in pixels."""
    return _font(size).getlength(_plain(text))


def shortened(text: str, size: int, room: float) -> str:
    """Return the text, cut and with three dots at the end if it is wider than `room` pixels."""
    kept = text[: 4 * max(1, round(room))]  # more letters than can fit
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
