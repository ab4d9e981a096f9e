"""The colours of the pictures, as 0xRRGGBB, and the shapes of marks.

The colours are chosen so that people with any of the common colour deficiencies can tell them
apart, on a light page, in print and on a projector.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

PAGE = 0xFFFFFF  # also what lies outside the world, and the lines between cells
CELL_EMPTY = 0xE9ECEF
CELL_OBSTACLE = 0x464B52
CELL_FOOD = 0xD55E00
CELL_QUEEN = 0xA312DC
CELL_NEARER = 0xDCE3F2  # to the queen; on the policy sheet only
# Under the drawings of food and queen, where cells are large enough for them.
FLOOR_FOOD = 0xFBE6D4
FLOOR_QUEEN = 0xF0DDFA
ANT = 0x14171C
INK = 0x1F2429  # text
FAINT_INK = 0x6B737C
RULE = 0xC9CED4  # bars of actions
CHOSEN = 0x0072B2  # the bar of the chosen action, arrows of moves

# Evenly darker from a pale green, close to the grey of an empty cell, to a deep blue: the stronger
# a trail, the more it stands out, for everybody. On a darker one no ant would stand out.
_TRAIL_SAMPLES = "b6e0c8 99d1bb 7ac2b1 58b3aa 2ea4a4 11919e 007f96 006c8d 005983"


def channels(colours: int | np.ndarray) -> np.ndarray:
    """Red, green and blue, uint8 (..., 3), of colours 0xRRGGBB (...)."""
    words = np.asarray(colours, dtype=np.uint32)[..., None]
    return (words >> np.array([16, 8, 0], dtype=np.uint32)).astype(np.uint8)


_samples = channels(np.array([int(word, 16) for word in _TRAIL_SAMPLES.split()]))
_places = np.linspace(0, len(_samples) - 1, 256)
_red, _green, _blue = (np.interp(_places, range(len(_samples)), one) for one in _samples.T)
# uint32 (256,): the trail from just above 0 to the strongest that is shown.
TRAIL_RAMP = np.rint([_red, _green, _blue]).astype(np.uint32).T @ np.array(
    [1 << 16, 1 << 8, 1], np.uint32
)
TRAIL_RAMP.setflags(write=False)


class Mark(IntEnum):
    """The shapes, whose outlines are in `raster_kernels`."""

    HEXAGON = 0
    OUTLINE = 1  # of a hexagon
    FOOD = 2
    QUEEN = 3
    ARROW = 4
    DOT = 5
    DART = 6
    DART_WITH_FOOD = 7
    ANT = 8
    ANT_WITH_FOOD = 9
