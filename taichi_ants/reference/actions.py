"""What the ants want to do in a tick, who wins where they want one cell, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.ants import Ant, Event
from taichi_ants.reference.geometry import Cell, neighbour
from taichi_ants.reference.random_stream import RandomStream, hash_of, pick
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task.constants import (
    EMPTY,
    GIVE,
    N_ACTIONS,
    PICK_UP,
    SEES_EMPTY,
    SEES_GOAL,
    SEES_LURE,
)

if TYPE_CHECKING:
    from taichi_ants.task import Rewards


def choose_action(values: Sequence[np.float32], epsilon: float, stream: RandomStream) -> int:
    """With probability epsilon any action, else one with the largest of these 5 values.

    It makes one draw: the high word decides whether to explore, the low word which action it is.
    """
    high, low = stream.draw()
    if high < int(epsilon * 4294967296.0):
        return pick(low, N_ACTIONS)
    best_value = max(values)
    best = [action for action in range(N_ACTIONS) if values[action] == best_value]
    return best[pick(low, len(best))]


@dataclass(frozen=True, slots=True)
class Intent:
    """What an ant is about to do.

    Attributes:
        ant: As it is at the start of the tick.
        action: 0..4.
        heading: Of a move or a pick-up: towards its cell.
        target: The cell that it wants to enter or whose food it wants to take. None where there is
            nothing to want: the way is blocked, no food is in view, or the action is to give.
        lured: Whether the cell looks T or S.
        gives: Whether it can give.
    """

    ant: Ant
    action: int
    heading: int = 0
    target: Cell | None = None
    lured: bool = False
    gives: bool = False


def intend(ant: Ant, action: int) -> Intent:
    """What the ant wants by an action, from its percept.

    It draws from its stream where a pick-up has several foods to choose from.
    """
    codes = (ant.percept >> 4 & 3, ant.percept >> 2 & 3, ant.percept & 3)
    if action == GIVE:
        return Intent(ant, action, gives=ant.carries and SEES_GOAL in codes)
    if action == PICK_UP:
        foods = [side for side in range(3) if codes[side] == SEES_GOAL]
        if ant.carries or not foods:
            return Intent(ant, action)
        side = foods[0]
        if len(foods) > 1:
            high, _ = ant.stream.draw()
            side = foods[pick(high, len(foods))]
        heading = (ant.heading + side - 1) % N_HEADINGS
        return Intent(ant, action, heading, neighbour(ant.cell, heading))
    heading = (ant.heading + action - 1) % N_HEADINGS
    is_open = codes[action] in (SEES_EMPTY, SEES_LURE)
    target = neighbour(ant.cell, heading) if is_open else None
    return Intent(ant, action, heading, target, lured=codes[action] == SEES_LURE)


def winners(intents: Sequence[Intent], tick: int, index: Callable[[Cell], int]) -> set[int]:
    """The slots of the ants that get the cell, or the food, that they want.

    Of those that want one cell, it is the one whose own cell has the smallest hash with the tick;
    were two equal, the one with the smaller heading towards the cell. So neither numbers of ants
    nor their order matter, and no place in the world wins for ever.

    Args:
        intents: All wishes of a tick.
        tick: Its number in the episode, from 0.
        index: The number of a cell that is hashed.
    """
    best: dict[Cell, tuple[int, int, int]] = {}
    for intent in intents:
        if intent.target is None:
            continue
        key = (hash_of(index(intent.ant.cell), tick), intent.heading, intent.ant.slot)
        best[intent.target] = min(key, best.get(intent.target, key))
    return {slot for _, _, slot in best.values()}


def carry_out(world: WorldState, intent: Intent, wins: bool, rewards: Rewards) -> Event:
    """Let one ant act, and lay its trail: change it and the world.

    All wishes are from the start of the tick, so no ant's deed can change another's; and no cell is
    entered, emptied or marked by two.
    """
    ant, target = intent.ant, intent.target
    ant.action, ant.reward = intent.action, rewards.failed
    if intent.action == GIVE:
        if not intent.gives:
            return Event.FAILED
        ant.carries = False
        ant.reward = rewards.give
        return Event.DELIVERED
    if intent.action == PICK_UP:
        if not wins or target is None:
            return Event.FAILED
        world.ground[target] = EMPTY
        world.trail.deposit(target)
        world.trail.deposit(ant.cell)
        ant.carries = True
        ant.heading = (ant.heading + 3) % N_HEADINGS
        ant.reward = rewards.pick_up
        return Event.PICKED_UP
    # The turn is made even if the way is blocked: so an ant gets out of a dead end.
    ant.heading = intent.heading
    if not wins or target is None:
        return Event.BLOCKED
    world.occupied.remove(ant.cell)
    world.occupied.add(target)
    ant.cell = target
    if ant.carries:
        world.trail.deposit(target)
    ant.reward = rewards.lure if intent.lured else rewards.empty
    return Event.MOVED
