"""Who wins where several ants want one cell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from taichi_ants.reference.geometry import Cell
from taichi_ants.reference.random_stream import hash_of


class Claim(NamedTuple):
    """An ant's wish to enter a cell, or to take the food of it.

    Attributes:
        slot: Of the ant.
        origin: Where it stands.
        heading: From there to the cell, 0..5.
        target: The cell.
    """

    slot: int
    origin: Cell
    heading: int
    target: Cell


def winners(claims: Sequence[Claim], tick: int, index: Callable[[Cell], int]) -> set[int]:
    """Return the slots of the ants that get what they want.

    Of those that want one cell, it is the one whose own cell has the smallest hash with the tick;
    were two equal, the one with the smaller heading towards the cell. So neither numbers of ants
    nor their order matter, and no place in the world wins for ever.

    Args:
        claims: All wishes of a tick.
        tick: Its number in the episode, from 0.
        index: The number of a cell that is hashed.
    """
    best: dict[Cell, tuple[int, int, int]] = {}
    for claim in claims:
        key = (hash_of(index(claim.origin), tick), claim.heading, claim.slot)
        if claim.target not in best or key < best[claim.target]:
            best[claim.target] = key
    return {slot for _, _, slot in best.values()}
