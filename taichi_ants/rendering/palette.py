"""Pictures in 256 colours, for GIF."""

from __future__ import annotations

import numpy as np

from taichi_ants.rendering import colours

TRANSPARENT = 255  # the index that is no colour
_N_COLOURS = 255
_BITS = 5  # of each channel that a colour is looked up by
_KEPT = (
    *(colours.PAGE, colours.CELL_EMPTY, colours.CELL_OBSTACLE, colours.CELL_FOOD),
    *(colours.CELL_QUEEN, colours.FLOOR_FOOD, colours.FLOOR_QUEEN, colours.ANT),
    *(colours.INK, colours.FAINT_INK, colours.RULE, colours.CHOSEN),
)
_RAMP_STEP = 6


class Palette:
    """255 colours, chosen once for all frames of an animation.

    They hold the colours of scenes exactly, a good part of the trail's ramp, and the mixtures along
    edges. What else is in the first frame is taken into account.

    Attributes:
        table: uint8 (256, 3), red, green and blue; the last entry is not used.

    Args:
        first_frame: uint8 (height, width, 3).
    """

    def __init__(self, first_frame: np.ndarray) -> None:
        kept = np.concatenate([_KEPT, colours.TRAIL_RAMP[::_RAMP_STEP]]).astype(np.uint32)
        kept = colours.channels(kept)
        others = _median_cut(_sample(first_frame), _N_COLOURS - len(kept))
        self.table = np.zeros((256, 3), dtype=np.uint8)
        self.table[: len(kept)] = kept
        self.table[len(kept) : len(kept) + len(others)] = others
        used = self.table[: len(kept) + len(others)]
        self._lookup = _nearest(used)
        # Colours that are kept are met exactly, whatever else lies near them.
        self._lookup[_bins(kept[::-1])] = np.arange(len(kept))[::-1]

    def indices(self, frame: np.ndarray) -> np.ndarray:
        """uint8 (...), the palette's indices for a picture uint8 (..., 3)."""
        return self._lookup[_bins(frame)]


def _bins(rgb: np.ndarray) -> np.ndarray:
    """Where colours uint8 (..., 3) stand in the lookup, int32 (...)."""
    drop = 8 - _BITS
    bins = (rgb[..., 0] >> drop).astype(np.int32)
    for channel in (1, 2):
        bins <<= _BITS
        bins |= rgb[..., channel] >> drop
    return bins


def _nearest(table: np.ndarray) -> np.ndarray:
    """uint8 (2**15,): of each bin, the colour of the table (n, 3) nearest to its middle."""
    side = (np.arange(1 << _BITS) * (1 << 8 - _BITS) + (1 << 7 - _BITS)).astype(np.float32)
    middles = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    entries = table.astype(np.float32)
    squares = (entries**2).sum(axis=1)
    # |m - e|^2 without |m|^2, which is the same for all entries.
    return np.argmin(squares - 2.0 * middles @ entries.T, axis=1).astype(np.uint8)


def _sample(frame: np.ndarray) -> np.ndarray:
    """Colours (n, 3) that the animation will show: the frame's, and mixtures of scene colours."""
    on_cells = colours.channels(np.array([colours.PAGE, colours.ANT, colours.INK]))
    cells = colours.channels(np.concatenate([_KEPT, colours.TRAIL_RAMP[::16]]).astype(np.uint32))
    shares = np.array([0.25, 0.5, 0.75])[:, None, None, None]
    mixed = shares * cells[:, None] + (1 - shares) * on_cells[None, :]
    return np.concatenate(
        [np.unique(frame.reshape(-1, 3)[::7], axis=0), mixed.reshape(-1, 3).astype(np.uint8)]
    )


def _median_cut(sample: np.ndarray, n: int) -> np.ndarray:
    """At most n colours (.., 3) that represent a sample of colours."""
    from PIL import Image

    image = Image.fromarray(np.ascontiguousarray(sample[None]))
    cut = image.quantize(n, method=Image.Quantize.MEDIANCUT)
    return np.array(cut.getpalette(), dtype=np.uint8).reshape(-1, 3)[:n]
