"""One episode of one ant: the order of a tick, without choices and without learning."""

from __future__ import annotations

from typing import TYPE_CHECKING

from taichi_ants.reference.ant import Ant, Event, act, observe
from taichi_ants.reference.geometry import Cell
from taichi_ants.reference.random_stream import RandomStream
from taichi_ants.reference.records import Step
from taichi_ants.reference.world_state import WorldState

if TYPE_CHECKING:
    from taichi_ants.task.rewards import Rewards
    from taichi_ants.worlds.world import World


class Episode:
    """An ant alone in a world, from the world's start to the delivery or the step limit.

    Attributes:
        state: What the ant sees now, the index of a state.
        over: Whether the episode has ended; the ant then takes no further step.
    """

    def __init__(
        self,
        world: World,
        begin: tuple[Cell, int],
        stream: RandomStream,
        evaporation: bool,
        rewards: Rewards,
        max_steps: int,
        number: int = 0,
    ) -> None:
        """Set up the start.

        Args:
            world: As every episode starts.
            begin: Cell and heading of the ant.
            stream: Where a pick-up draws from.
            evaporation: Whether every trail falls by 1 per tick.
            rewards: What each event pays.
            max_steps: The step limit, at least 1.
            number: Of the episode in its run.
        """
        self._ant = Ant(*begin)
        self._world = WorldState(world, evaporation, rewards)
        self._stream = stream
        self._max_steps = max_steps
        self._number = number
        self.state = observe(self._world, self._ant)
        self.over = False

    def step(self, action: int) -> Step:
        """Let the ant act, and one tick pass."""
        ant, world = self._ant, self._world
        cell, heading, state, clock = ant.cell, ant.heading, self.state, world.clock
        reward, event = act(world, ant, state, action, self._stream)
        world.tick()
        self.state = observe(world, ant)
        delivered = event is Event.DELIVERED
        truncated = not delivered and world.clock >= self._max_steps
        self.over = delivered or truncated
        return Step(
            episode=self._number,
            step=clock,
            cell=cell,
            heading=heading,
            state=state,
            action=action,
            reward=reward,
            event=event,
            next_cell=ant.cell,
            next_heading=ant.heading,
            next_state=self.state,
            delivered=delivered,
            truncated=truncated,
        )
