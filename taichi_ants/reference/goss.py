"""The published model of the double bridge, one colony, as it is told.

Goss, Aron, Deneubourg and Pasteels, Naturwissenschaften 76 (1989).
"""

from __future__ import annotations

from taichi_ants.grid.constants import STREAM_BRIDGE
from taichi_ants.reference.random_stream import RandomStream, stream_state

NEST, FOOD = 0, 1


def bridge_choices(
    short: int,
    long: int,
    seed: int,
    colony: int,
    ants: int,
    k: float = 20.0,
    n: int = 2,
    opens: int = 0,
) -> list[bool]:
    """Return for each ant if it takes the short branch; ants choose in turn at nest and food.

    Args:
        short: Steps to cross the short branch.
        long: Steps to cross the long one.
        seed: The seed.
        colony: The number of the colony.
        ants: How many choose, an even number.
        k: Marks that every branch seems to have more.
        n: The exponent.
        opens: Number of ants that choose while only the long branch exists.
    """
    stream = RandomStream(stream_state(seed, STREAM_BRIDGE, colony))
    marks = {(end, takes_short): 0 for end in (NEST, FOOD) for takes_short in (True, False)}
    arrivals: dict[int, list[tuple[int, bool]]] = {}  # by step: where, and by which branch
    taken: list[bool] = []
    for step in range(ants // 2):
        for arrived in arrivals.pop(step, []):
            marks[arrived] += 1
        words = stream.draw()
        for end, other in ((NEST, FOOD), (FOOD, NEST)):
            attraction = dict.fromkeys((True, False), 1.0)
            for branch in attraction:
                for _ in range(n):
                    attraction[branch] *= k + marks[end, branch]
            takes_short = words[end] / 2**32 * sum(attraction.values()) < attraction[True]
            if len(taken) < opens:
                takes_short = False
            marks[end, takes_short] += 1
            arrivals.setdefault(step + (short if takes_short else long), []).append(
                (other, takes_short)
            )
            taken.append(takes_short)
    return taken
