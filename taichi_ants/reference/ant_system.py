"""Ant colony optimisation, one colony, as its rules read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from taichi_ants.grid.constants import N_HEADINGS, STREAM_TOUR
from taichi_ants.reference.geometry import Cell, existing_cells, listed_cells, neighbour
from taichi_ants.reference.random_stream import RandomStream, stream_state

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World

Arc = tuple[Cell, int]  # a cell and the heading of the step from it
P_BEST = 0.05


def tours(
    world: World,
    max_min: bool,
    seed: int,
    colony: int,
    iterations: int,
    ants: int,
    evaporation: float,
    alpha: int = 1,
    max_steps: int = 100_000,
) -> list[list[list[Arc]]]:
    """The tours of all ants in each iteration; empty for an ant that gave up."""
    foods = set(listed_cells(world.foods))
    cells = set(existing_cells(world.ranges)) - set(listed_cells(world.obstacles))
    arcs = [(c, h) for c in cells for h in range(N_HEADINGS) if neighbour(c, h) in cells]
    tau = dict.fromkeys(arcs, 1.0)
    numbers = [colony * 2**32 + ant for ant in range(ants)]
    streams = [RandomStream(stream_state(seed, STREAM_TOUR, number)) for number in numbers]
    ways = max(2.0, len(arcs) / len(cells) - 1)
    best = 0
    done = []
    for _ in range(iterations):
        found = [_tour(world.queen, foods, tau, alpha, max_steps, one) for one in streams]
        done.append(found)
        arrived = [tour for tour in found if tour]
        if not arrived and not best:
            continue
        shortest = min(arrived, key=len, default=[])
        is_first = not best
        best = min(length for length in (best, len(shortest)) if length)
        highest = 1 / (evaporation * best)
        right = P_BEST ** (1 / best)
        lowest = min(highest * (1 - right) / ((ways - 1) * right), highest)
        if is_first:
            tau = dict.fromkeys(arcs, highest if max_min else ants / best)
        for arc in arcs:
            tau[arc] *= 1 - evaporation
        for tour in ([shortest] if shortest else []) if max_min else arrived:
            for arc in tour:
                tau[arc] += 1 / len(tour)
        if max_min:
            tau = {arc: min(max(level, lowest), highest) for arc, level in tau.items()}
    return done


def _tour(
    queen: Cell,
    foods: set[Cell],
    tau: dict[Arc, float],
    alpha: int,
    max_steps: int,
    stream: RandomStream,
) -> list[Arc]:
    """A walk to food without its loops; empty if it takes too long."""
    cell, back = queen, -1
    tour: list[Arc] = []
    for _ in range(max_steps):
        open_headings = [h for h in range(N_HEADINGS) if (cell, h) in tau]
        onward = [h for h in open_headings if h != back]
        weights = []
        for heading in onward:
            weight = 1.0
            for _ in range(alpha):
                weight *= tau[cell, heading]
            weights.append(weight)
        if sum(weights) == 0:
            onward = onward or open_headings
            weights = [1.0] * len(onward)
        left = stream.draw()[0] / 2**32 * sum(weights)
        options = [(h, weight) for h, weight in zip(onward, weights, strict=True) if weight > 0]
        for heading, weight in options:
            chosen = heading
            left -= weight
            if left < 0:
                break
        tour.append((cell, chosen))
        cell, back = neighbour(cell, chosen), (chosen + 3) % N_HEADINGS
        been = [k for k, (earlier, _) in enumerate(tour) if earlier == cell]
        if been:
            tour = tour[: been[0]]
        if cell in foods:
            return tour
    return []
