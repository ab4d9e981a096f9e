"""Colours of the pictures, as 0xRRGGBB, and shapes of marks.

People with any of the common colour deficiencies can distinguish the colours, on a light page, in
print and on a projector.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

PAGE = 0xFFFFFF  # also the area outside the world, and the lines between cells; channels are equal
CELL_EMPTY = 0xEAEEF4
CELL_OBSTACLE = 0x464B52
CELL_FOOD = 0xD55E00
CELL_QUEEN = 0xA312DC
CELL_NEARER = 0xDCE3F2  # a cell nearer to the queen; on the policy sheet only
# Backgrounds of the drawings of food and queen, in cells that are large enough for drawings.
FLOOR_FOOD = 0xFBE6D4
FLOOR_QUEEN = 0xF0DDFA
ANT = 0x14171C
FOOD_DOT = 0x9A3F00  # an ant with food that is a dot, for which the colour of food is too light
INK = 0x1F2429  # text
FAINT_INK = 0x6B737C
RULE = 0xC9CED4  # bars of actions
CHOSEN = 0x0072B2  # the bar of the chosen action, arrows of moves

# From a pale green, close to the grey of an empty cell, to a deep blue, in even steps of lightness:
# stronger trails are more visible, also to the colour-blind. Ants would not show on darker colours.
_TRAIL_SAMPLES = "b6e0c8 99d1bb 7ac2b1 58b3aa 2ea4a4 11919e 007f96 006c8d 005983"


def channels(colours: int | np.ndarray) -> np.ndarray:
    """Return red, green and blue, uint8 (..., 3), of colours 0xRRGGBB (...)."""
    words = np.asarray(colours, dtype=np.uint32)[..., None]
    return (words >> np.array([16, 8, 0], dtype=np.uint32)).astype(np.uint8)


def packed(rgb: np.ndarray) -> np.ndarray:
    """Return colours 0xRRGGBB, uint32 (...), of whole red, green and blue (..., 3)."""
    red, green, blue = (rgb[..., channel].astype(np.uint32) for channel in range(3))
    return red << 16 | green << 8 | blue


_samples = channels(np.array([int(word, 16) for word in _TRAIL_SAMPLES.split()])).T
_places = np.linspace(0, _samples.shape[1] - 1, 256)
_ramp = [np.interp(_places, range(len(channel)), channel) for channel in _samples]
# uint32 (256,): colours of trails from just above level 0 to `strongest`.
TRAIL_RAMP = packed(np.rint(np.stack(_ramp, axis=-1)))
TRAIL_RAMP.setflags(write=False)

# The darkest colours of further fields, which repeat.
_FIELDS = (0xD57AF3, 0xCAA228, 0x9564D3, 0xA6582A)
N_FIELDS = len(_FIELDS)


def field_ramp(number: int) -> np.ndarray:
    """Return the colours of further field `number`, from 0, from weak to strong, uint32 (256,)."""
    ends = channels(np.array([CELL_EMPTY, _FIELDS[number % N_FIELDS]])).astype(float)
    parts = np.linspace(0.31, 1.0, 256)[:, None]
    return packed(np.rint(ends[0] * (1 - parts) + ends[1] * parts))


# The colours of nests, for the queen and her ants, and of kinds of food, by number.
_NESTS = (0x83000F, 0x76583D, 0x610854, 0x0625AA, 0x808002, 0x63686D)
_FOODS = (0x810508, 0x6B904C, 0xEBC01C, 0x5D4135, 0x3E5C83, 0x181100, 0xDD9297)
QUEENS, ANTS = (np.array([first, *_NESTS], np.uint32) for first in (CELL_QUEEN, ANT))
FOODS = np.array([CELL_FOOD, *_FOODS], np.uint32)
# Their light backgrounds.
QUEEN_FLOORS, FOOD_FLOORS = (
    np.append(first, packed(np.rint(0.85 * channels(PAGE) + 0.15 * channels(several[1:]))))
    for first, several in ((np.uint32(FLOOR_QUEEN), QUEENS), (np.uint32(FLOOR_FOOD), FOODS))
)


class Mark(IntEnum):
    """The shapes of marks; `raster_kernels` defines their outlines."""

    HEXAGON = 0
    OUTLINE = 1  # the border of a hexagon
    FOOD = 2
    QUEEN = 3
    ARROW = 4
    DOT = 5
    DART = 6
    DART_WITH_FOOD = 7
    ANT = 8
    ANT_WITH_FOOD = 9
