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
    text = text if room is None else shortened(text, size, room)
    start = {"left": 0.0, "middle": 0.5, "right": 1.0}[align] * width(text, size)
    mask, right_of, below = _mask(text, size)
    left, top = round(x - start) + right_of, round(baseline) + below
    mask = mask[max(0, -top) :, max(0, -left) :]
    part = frame[max(0, top) :, max(0, left) :][: len(mask), : mask.shape[1]]
    mask = mask[: len(part), : part.shape[1]]
    # As Pillow rounds, in 16 bits.
    mixed = part * (255 - mask) + channels(colour) * mask + 128
    part[:] = ((mixed >> 8) + mixed) >> 8


@lru_cache(maxsize=1024)
def _mask(text: str, size: int) -> tuple[np.ndarray, int, int]:
    """Return the opacity of a text's pixels, 0 to 255, uint16 (height, width, 1).

    The integers are the position of its corner, relative to the start of the baseline.
    """
    from PIL import Image, ImageDraw

    image = Image.new("L", (round(width(text, size)) + 2 * size, 3 * size))
    ImageDraw.Draw(image).text((size, 2 * size), _plain(text), 255, _font(size), anchor="ls")
    left, top, right, bottom = image.getbbox() or (0, 0, 0, 0)
    mask = np.asarray(image, np.uint16)[top:bottom, left:right, None]
    return mask, left - size, top - 2 * size


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
