"""What the ants of a colony want to do in a tick, and what becomes of it."""

from __future__ import annotations

from dataclasses import dataclass

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.ant import Event
from taichi_ants.reference.colony_conflicts import Claim, winners
from taichi_ants.reference.colony_records import ColonyAnt
from taichi_ants.reference.colony_world import ColonyWorld
from taichi_ants.reference.geometry import Cell, neighbour
from taichi_ants.reference.random_stream import pick
from taichi_ants.task.constants import GIVE, PICK_UP, SEES_EMPTY, SEES_GOAL, SEES_LURE


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

    ant: ColonyAnt
    action: int
    heading: int = 0
    target: Cell | None = None
    lured: bool = False
    gives: bool = False


def intend(ant: ColonyAnt, action: int) -> Intent:
    """Return what the ant wants by an action, from what it sees.

    It draws from its stream where a pick-up has several foods to choose from.
    """
    codes = (ant.state >> 4 & 3, ant.state >> 2 & 3, ant.state & 3)
    if action == GIVE:
        return Intent(ant, action, gives=ant.carries and SEES_GOAL in codes)
    if action == PICK_UP:
        return _intend_pick_up(ant, codes)
    heading = (ant.heading + action - 1) % N_HEADINGS
    is_open = codes[action] in (SEES_EMPTY, SEES_LURE)
    target = neighbour(ant.cell, heading) if is_open else None
    return Intent(ant, action, heading, target, lured=codes[action] == SEES_LURE)


def _intend_pick_up(ant: ColonyAnt, codes: tuple[int, int, int]) -> Intent:
    foods = [side for side in range(3) if codes[side] == SEES_GOAL]
    if ant.carries or not foods:
        return Intent(ant, PICK_UP)
    chosen = foods[0]
    if len(foods) > 1:
        high, _ = ant.stream.draw()
        chosen = foods[pick(high, len(foods))]
    heading = (ant.heading + chosen - 1) % N_HEADINGS
    return Intent(ant, PICK_UP, heading, neighbour(ant.cell, heading))


def carry_out(
    world: ColonyWorld, intents: list[Intent], tick: int
) -> tuple[list[Event], list[Cell]]:
    """Resolve the conflicts, let all ants act at once, and lay their trails.

    Args:
        world: Changed: foods taken, ants moved, trails laid.
        intents: Of all living ants; the ants are changed: cell, heading, carries, action, reward.
        tick: Its number in the episode, from 0.

    Returns:
        What came of each intent, and the cells from which food was taken.
    """
    claims = [
        Claim(intent.ant.slot, intent.ant.cell, intent.heading, intent.target)
        for intent in intents
        if intent.target is not None
    ]
    winning = winners(claims, tick, world.index)
    # All wishes are from the start of the tick, so no ant's deed can change another's; and no cell
    # is entered, emptied or marked by two.
    events = [_commit(world, intent, intent.ant.slot in winning) for intent in intents]
    taken = []
    for intent, event in zip(intents, events, strict=True):
        if intent.target is None:
            continue
        if event is Event.PICKED_UP:
            world.trail.deposit(intent.target)
            world.trail.deposit(intent.ant.cell)
            taken.append(intent.target)
        elif event is Event.MOVED and intent.ant.carries:
            world.trail.deposit(intent.target)
    return events, taken


def _commit(world: ColonyWorld, intent: Intent, wins: bool) -> Event:
    ant = intent.ant
    ant.action = intent.action
    ant.reward = world.rewards.failed
    if intent.action == GIVE:
        if not intent.gives:
            return Event.FAILED
        ant.carries = False
        ant.reward = world.rewards.give
        return Event.DELIVERED
    if intent.action == PICK_UP:
        if not wins or intent.target is None:
            return Event.FAILED
        world.take_food(intent.target)
        ant.carries = True
        ant.heading = (ant.heading + 3) % N_HEADINGS
        ant.reward = world.rewards.pick_up
        return Event.PICKED_UP
    # The turn is made even if the way is blocked: so an ant gets out of a dead end.
    ant.heading = intent.heading
    if not wins or intent.target is None:
        return Event.BLOCKED
    world.occupied.remove(ant.cell)
    world.occupied.add(intent.target)
    ant.cell = intent.target
    ant.reward = world.rewards.lure if intent.lured else world.rewards.empty
    return Event.MOVED
