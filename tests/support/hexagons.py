"""Steps between cells, for arrays of cells."""

from __future__ import annotations

import numpy as np

from taichi_ants.grid.constants import HEADING_STEPS
from taichi_ants.grid.hexgrid import normal_form


def neighbours(cells: object) -> np.ndarray:
    """The six neighbours (..., 6, 3) of cells (..., 3), in the order of the headings."""
    return normal_form(np.asarray(cells)[..., None, :] + np.array(HEADING_STEPS))


def distance(cells: object, others: object) -> np.ndarray:
    """The number of steps between cells (..., 3), obstacles ignored."""
    return normal_form(np.asarray(cells) - np.asarray(others)).max(axis=-1)
