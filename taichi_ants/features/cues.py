"""Cues of ants with food that are not pheromones, such as the compass.

Such a cue says which cells around an ant are better than its own. An ant with food sees an empty
cell as S if it is better; observations, rewards and rules ask the same of cells with ants. Kernels,
tasks, recordings, pages, pictures and descriptions of models walk over `CUES`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from taichi_ants.kernel_functions import Function, KernelFunction

World = Any  # of `taichi_ants.worlds`, which imports the features


class Cue(NamedTuple):
    """A cue that is not a pheromone.

    Attributes:
        words: What a better cell is, in legends and in descriptions of models.
        better: A function of an ant that returns an integer with bit h for each heading, 1 if the
            neighbour there is better than the ant's own cell.
        arrays: Functions by the names of the arrays that `better` reads at the ant's cell: of a
            world and a nest, they return uint8 (grid.size,).
        sees_loads: Whether `better` reads from `ground` which ants have food.
    """

    words: str
    better: KernelFunction
    arrays: Mapping[str, Callable[[World, int], Any]]
    sees_loads: bool


CUES: dict[str, Cue] = {}  # by the name in tasks


def cue(
    words: str, sees_loads: bool = False, **arrays: Callable[[World, int], Any]
) -> Callable[[Function], KernelFunction]:
    """Register a function as the `better` of a cue by its name, as a decorator."""

    def register(body: Function) -> KernelFunction:
        CUES[body.__name__] = Cue(words, KernelFunction(body), arrays, sees_loads)
        return CUES[body.__name__].better

    return register


@cue("nearer to the queen", closer=lambda world, nest: world.closer(nest))
def compass(a):
    """Return the headings that lead nearer to the queen of the ant; rocks do not count."""
    return a.closer


COMPASS = "compass"


def arrays_of(senses: Iterable[str]) -> dict[str, Callable[[World, int], Any]]:
    """Return the arrays of some cues by name; a colony always has those of the compass."""
    known = [CUES[name].arrays for name in (COMPASS, *senses)]
    return {name: make for some in known for name, make in some.items()}
