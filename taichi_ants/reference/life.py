"""How ants come and go."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.geometry import Cell, neighbour
from taichi_ants.reference.random_stream import RandomStream, pick
from taichi_ants.reference.records import Ant
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task.constants import EMPTY, FOOD


class Queen:
    """The queen, who turns each food that she is given into an ant.

    Attributes:
        stream: Her random stream, which runs on through all episodes; food that wanders draws from
            it as well.
        store: Foods that wait to become ants.
    """

    def __init__(self, stream: RandomStream) -> None:
        self.stream = stream
        self.store = 0

    def places(self, world: WorldState) -> Iterator[tuple[Cell, int]]:
        """Yield cell and heading of one ant after the other, while food and place last.

        The heading leads away from the queen. Whoever asks for the next ant has put the last one
        into the world.

        Args:
            world: Where free neighbours of the queen are looked for.
        """
        while self.store > 0:
            headings = [
                heading
                for heading in range(N_HEADINGS)
                if world.content(neighbour(world.queen, heading)) == EMPTY
            ]
            if not headings:
                return
            high, _ = self.stream.draw()
            heading = headings[pick(high, len(headings))]
            self.store -= 1
            yield neighbour(world.queen, heading), heading


def grow_old(world: WorldState, ants: Sequence[Ant], lifespan: int) -> list[Ant]:
    """Let ants grow older by a tick, and those of age die.

    A dying ant leaves its cell, and on it the food that it carries; the ant itself is left as it
    is, since it observes and learns once more.

    Returns:
        The ants that die.
    """
    for ant in ants:
        ant.age += 1
    dying = [ant for ant in ants if ant.age >= lifespan]
    for ant in dying:
        del world.ants[ant.cell]
        if ant.carries:
            world.ground[ant.cell] = FOOD
    return dying
