"""The actions of a tick: intents of the ants, conflicts over cells, and results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.features import hooks, inputs_of
from taichi_ants.reference.features.castes import lays
from taichi_ants.reference.geometry import Cell, neighbour
from taichi_ants.reference.observations import is_better, nestmate
from taichi_ants.reference.random_stream import hash_of, pick
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task import Traffic
from taichi_ants.task.constants import EMPTY, GIVE, PICK_UP, SEES_CUE, SEES_EMPTY, SEES_GOAL, Event

# The field of `Rewards` for each event.
PAID = {
    Event.ENTERED_EMPTY: "empty",
    Event.PUSHED: "empty",
    Event.ENTERED_CUE: "shaping",
    Event.PICKED_UP: "pick_up",
    Event.DELIVERED: "deliver",
    Event.BLOCKED: "failed",
    Event.FAILED: "failed",
}


@dataclass(frozen=True, slots=True)
class Intent:
    """An ant's action, 0 to 4, and its effect if the ant wins."""

    ant: Ant
    action: int
    heading: int = 0  # towards the target
    # The cell to enter, or whose food to take. None if the way is closed, no food is in view, or
    # the action is to give.
    target: Cell | None = None
    shows_cue: bool = False  # the target looks T or S or, with an ant on it, is better than its own
    gives: bool = False  # whether the ant delivers
    rests: bool = False  # the action is then GIVE, which has no effect

    @property
    def enters(self) -> bool:
        return self.action < PICK_UP and self.target is not None


def intend(world: WorldState, ant: Ant, action: int, traffic: Traffic) -> Intent:
    """Return the intent of an ant's action, from its `paper_state`.

    If a pick-up can choose between several food items, the ant draws from its random stream.
    """
    codes = (ant.paper_state >> 4 & 3, ant.paper_state >> 2 & 3, ant.paper_state & 3)
    if action == GIVE:
        return Intent(ant, action, gives=ant.carries and SEES_GOAL in codes)
    if action == PICK_UP:
        foods = [side for side in range(3) if codes[side] == SEES_GOAL]
        if ant.carries or not foods:
            return Intent(ant, action)
        side = foods[pick(ant.stream.draw()[0], len(foods))] if len(foods) > 1 else foods[0]
        heading = (ant.heading + side - 1) % N_HEADINGS
        return Intent(ant, action, heading, neighbour(ant.cell, heading))
    heading = (ant.heading + action - 1) % N_HEADINGS
    target = neighbour(ant.cell, heading)
    if traffic.shared and nestmate(world, ant, target):
        return Intent(ant, action, heading, target, shows_cue=is_better(world, ant, target))
    if codes[action] not in (SEES_EMPTY, SEES_CUE):
        return Intent(ant, action, heading)
    return Intent(ant, action, heading, target, shows_cue=codes[action] == SEES_CUE)


def winners(
    intents: Sequence[Intent], tick: int, index: Callable[[Cell], int], carriers_first: bool = False
) -> set[int]:
    """Return the slots of the ants that win the cell or food they want.

    If several ants want one cell, the ant wins whose own cell (its `index`) has the smallest hash
    with the tick; among equal hashes, the smaller heading towards the cell. So the numbers and
    order of ants do not matter, and no place always wins. With `carriers_first`, carriers win
    against foragers.
    """
    best: dict[Cell, tuple[bool, int, int, int]] = {}
    for intent in intents:
        if intent.target is None:
            continue
        ant = intent.ant
        last = carriers_first and not ant.carries
        key = (last, hash_of(index(ant.cell), tick), intent.heading, ant.slot)
        best[intent.target] = min(key, best.get(intent.target, key))
    return {slot for *_, slot in best.values()}


def resolve_moves(
    intents: Sequence[Intent], winning: set[int], traffic: Traffic
) -> tuple[dict[int, Cell], dict[int, Cell]]:
    """Return two dictionaries by slot: cells that ants enter, and cells onto which ants are pushed.

    `winning` are the slots that `winners` returns.
    """
    standing: dict[Cell | None, Intent] = {intent.ant.cell: intent for intent in intents}

    def moves(intent: Intent) -> bool:
        """Return whether an ant enters its target, which is empty or which another ant leaves."""
        mover = intent
        while mover.enters and mover.ant.slot in winning:
            ahead = standing.get(mover.target)
            if ahead is None:
                return True
            if not traffic.follow or ahead is intent:
                return False
            mover = ahead
        return False

    entered = {
        intent.ant.slot: intent.target for intent in intents if intent.target and moves(intent)
    }
    pushed: dict[int, Cell] = {}
    for intent in intents:
        ant = intent.ant
        claims = intent.enters and ant.slot in winning and ant.slot not in entered
        if not (traffic.swap and claims and ant.carries) or intent.target is None:
            continue
        other = standing[intent.target]
        picks_up = other.action == PICK_UP and other.target is not None
        if other.ant.carries or other.ant.slot in entered or picks_up:
            continue
        entered[ant.slot] = intent.target
        granted = traffic.reward_pushed and other.enters and other.target == ant.cell
        (entered if granted else pushed)[other.ant.slot] = ant.cell
    return entered, pushed


def carry_out(colony: Any, intents: Sequence[Intent], tick: int) -> None:
    """Let all ants act at once, and record in each its action, its event and its reward.

    All intents are from the start of the tick, so no ant's action changes that of another ant. At
    most one ant enters a given cell, at most one takes its food, and at most one deposits on it in
    a pheromone. Ants lay one pheromone after the other, the trail first.
    """
    world, task = colony.world, colony.task
    winning = winners(intents, tick, world.index, task.traffic.carriers_first)
    entered, pushed = resolve_moves(intents, winning, task.traffic)
    acted: list[tuple[Intent, Cell, bool]] = []
    for intent in intents:
        ant, slot = intent.ant, intent.ant.slot
        start, had_food = ant.cell, ant.carries
        ant.executed = -1 if intent.rests else intent.action
        if intent.action < PICK_UP:
            # Ants turn even if the way is blocked, so that they get out of dead ends.
            ant.heading = intent.heading
        if slot in pushed:
            ant.cell, event = pushed[slot], Event.PUSHED
        elif intent.action < PICK_UP and slot not in entered:
            event = Event.BLOCKED
        elif intent.action < PICK_UP:
            ant.cell = entered[slot]
            event = Event.ENTERED_CUE if intent.shows_cue else Event.ENTERED_EMPTY
        else:
            event = _handle(colony, intent, slot in winning)
        if intent.rests:
            ant.event, ant.reward = Event.NONE, 0
            continue
        paid = getattr(task.rewards, PAID[event])
        for pays in hooks(task, "pays"):
            paid = pays(colony, ant, event, paid)
        ant.event, ant.reward = event, paid
        acted.append((intent, start, had_food))
    for name, trail in world.pheromones.items():
        laid = task.fields[name].deposited_when if name in task.fields else "with_food"
        for intent, start, had_food in acted:
            ant = intent.ant
            of_features = inputs_of(world, ant, task)
            for cell in _marked(laid, intent, start, had_food) if lays(task, ant, name) else ():
                trail.deposit(cell, ant, tick, world.pheromones, of_features)
    for intent in intents:
        intent.ant.carried += 1
    world.ants = {intent.ant.cell: intent.ant for intent in intents}


def _marked(laid: str, intent: Intent, start: Cell, had_food: bool) -> list[Cell]:
    """Return the cells on which an ant deposits in a field, after its action.

    `start` and `had_food` are its cell and its load before the action.
    """
    ant = intent.ant
    if laid == "dead_end":
        return [start] if not had_food and ant.paper_state == 0b01_01_01 else []
    if laid == "failed_pick_up":
        fails = intent.action == PICK_UP and ant.event is Event.FAILED
        return [start] if fails and not had_food else []
    if laid != "always" and laid != ("with_food" if had_food else "without_food"):
        # A pick-up counts as an occasion with food, and a delivery as one without.
        changes = {"with_food": Event.PICKED_UP, "without_food": Event.DELIVERED}
        if ant.event is not changes.get(laid):
            return []
    if ant.event is Event.PICKED_UP and laid != "without_food":
        assert intent.target is not None
        return [intent.target, start]
    if ant.event is Event.DELIVERED and laid != "with_food":
        return [start]
    return [ant.cell] if ant.cell != start else []


def _handle(colony: Any, intent: Intent, wins: bool) -> Event:
    """Do a pick-up or a delivery if it is possible, and return the event."""
    ant = intent.ant
    if intent.gives:
        ant.carries, ant.carried = False, 0
        if colony.task.turns_at_queen:
            ant.heading = (ant.heading + 3) % N_HEADINGS
        return Event.DELIVERED
    if intent.action == PICK_UP and wins and intent.target is not None:
        left = 0
        for took in hooks(colony.task, "took"):
            left = took(colony, ant, intent.target, left)
        if left == 0:
            colony.world.ground[intent.target] = EMPTY
        ant.carries, ant.carried = True, 0
        ant.heading = (ant.heading + 3) % N_HEADINGS
        return Event.PICKED_UP
    return Event.FAILED
