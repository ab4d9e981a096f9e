"""The kinds of food, and loads: the settings, what cells and ants have of them, and rewards.

Food grows back in phases of the engine, `engines/colony/life.py`, which know the kind of each food
source. Without kinds in the task, there is one, with the rewards of the task.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from taichi_ants.errors import count
from taichi_ants.features.feature import ANT, CELL, Array, Feature, State, Task
from taichi_ants.features.life import Ticks
from taichi_ants.grid.constants import MAX_FOOD_KINDS, MOST_REWARD
from taichi_ants.kernel_functions import ti
from taichi_ants.settings import Setting, Settings

if TYPE_CHECKING:
    import numpy as np

NEST_AND_KIND = "nest and kind"  # an entry for each nest and kind of food
Reward = Annotated[int, Setting(least=-MOST_REWARD, most=MOST_REWARD)]


@dataclass(frozen=True)
class Food(Settings, path="task.foods.NAME"):
    """A kind of food, for colonies only.

    A cell with food has a number of loads, of which an ant takes one. The cell is food until its
    last load is taken; `regrowth` ticks later, it has all its loads again.

    >>> Task(foods={"seeds": {"deliver": 5, "loads": 3}}).foods["seeds"].loads
    3
    """

    sentences: ClassVar[dict[str, str]] = {
        "": "A cell has {loads} loads; the rewards are {pick_up} for picking up and {deliver} for "
        "giving.",
        "regrowth": "An empty cell has all its loads again after {regrowth} ticks.",
    }

    most_entries = MAX_FOOD_KINDS

    pick_up: Annotated[Reward, Setting("reward for picking up this food")] = 3
    deliver: Annotated[Reward, Setting("reward for giving this food to the queen")] = 10
    loads: Annotated[int, Setting("loads in a cell", least=1, most=1_000_000)] = 1
    regrowth: Annotated[Ticks, Setting("time until an empty cell is full again", least=0)] = None


_PICK_UP, _DELIVER, _LOADS, _REGROWTH = range(len(fields(Food)))  # rows of `food_numbers`
_PICKED_UP, _DELIVERED = 4, 5  # events


def _faults(task: Task) -> Iterator[str]:
    if task.foods and task.life.regrowth is not None:
        yield (
            f"`task.life.regrowth` is {task.life.regrowth}; with `task.foods`, set the regrowth of "
            "each kind instead."
        )
    if task.life.pile_move_interval and HELD.is_used(task):
        yield (
            f"`task.life.pile_move_interval` is {task.life.pile_move_interval}; only food of one "
            "kind with one load in a cell can wander, so leave it out."
        )


def _refusals(task: Task, worlds: Any, sharing: str) -> Iterator[str]:
    for world in worlds:
        if world.n_food_kinds > (n := max(1, len(task.foods))):
            yield (
                f"the world has {count(world.n_food_kinds, 'kind')} of food, but the task {n}; "
                "add the others to `task.foods`."
            )


def _numbers(task: Task) -> np.ndarray:
    """Return the settings of the kinds of food, int32 (settings, kinds); None is -1."""
    import numpy as np

    rewards = task.rewards
    kinds = [*task.foods.values()] or [Food(rewards.pick_up, rewards.deliver)]
    numbers = [[-1 if number is None else number for number in astuple(kind)] for kind in kinds]
    return np.array(numbers, np.int32).T.copy()


def _counts(state: State) -> dict[str, np.ndarray]:
    """Return the deliveries by nest and kind of food, (W, nests, kinds)."""
    by_nest_and_kind, shape = state.deliveries, (len(state.seeds), state.n_nests, -1)
    if state._model.counts_by_nest_and_kind:
        by_nest_and_kind = state.arrays["deliveries_by_nest_and_kind"]
    return {"deliveries_by_nest_and_kind": by_nest_and_kind.astype("i4").reshape(shape)}


def _shown(state: State, w: int, slots: np.ndarray, is_food: np.ndarray) -> dict[str, Any]:
    """Return the kinds of food that ants carry, -1 without food, and those of cells."""
    import numpy as np

    return {
        "ant_foods": np.where(state.carrying[w, slots], state.kinds[w, slots], np.int32(-1)),
        "food_kinds": np.where(is_food, state.food_kinds[w], 0).astype(np.uint8),
    }


FOODS = Feature(
    Food,
    uses=lambda task: True,
    spaces={NEST_AND_KIND: lambda state: state.n_nests * state._model.n_kinds},
    arrays=(Array("deliveries_by_nest_and_kind", NEST_AND_KIND, "i4"),),
    faults=_faults,
    refusals=_refusals,
    constants=lambda state: {"food_numbers": _numbers(state.task)},
    counts=_counts,
    shown=_shown,
)


# What the ants get for food, and when it grows back.


def _paid(state: State, rewards: np.ndarray) -> np.ndarray:
    """Return the rewards of ants, those for food by its kind."""
    import numpy as np

    for event, row in ((_PICKED_UP, _PICK_UP), (_DELIVERED, _DELIVER)):
        by_kind = _numbers(state.task)[row, state.kinds]
        rewards = np.where(state.events == event, by_kind, rewards)
    return rewards


PAID = Feature(Food, uses=lambda task: bool(task.foods), paid=_paid)


@PAID.at("pays")
def pay(a, event, reward):
    if (event == _PICKED_UP) | (event == _DELIVERED):
        kind = ti.cast(a.kind, ti.i32)
        reward = a.food_numbers[_PICK_UP, kind]
        if event == _DELIVERED:
            reward = a.food_numbers[_DELIVER, kind]
    return reward


@PAID.at("waits")
def wait(cell, kind, ticks):
    return cell.food_numbers[_REGROWTH, kind]


# Several kinds or loads: what cells hold, and the kind of the last food that an ant picked up.

HELD = Feature(
    Food,
    uses=lambda task: len(task.foods) > 1 or any(one.loads > 1 for one in task.foods.values()),
    arrays=(
        Array("kind", ANT, "i1", "kinds", "i4", doc="Kind of the food that the ant carries"),
        Array("kind_of", CELL, "u1", "food_kinds", always=True, doc="Kind of the food in the cell"),
        Array("loads", CELL, "i4", words="food", unit="loads", always=True),
    ),
    filled=lambda state, kinds: {"kind_of": kinds, "loads": _numbers(state.task)[_LOADS, kinds]},
)


@HELD.at("born")
def begin(a):
    """Forget the food of the ant that had the slot before."""
    a.kind = 0


@HELD.at("took")
def take(a, cell, left):
    """Take one of the loads, and note its kind."""
    left = cell.loads - 1
    cell.loads = left
    a.kind = ti.cast(cell.kind_of, ti.i8)
    return left


@HELD.at("dropped")
def drop(a, cell):
    cell.loads = 1
    cell.kind_of = ti.cast(a.kind, ti.u8)


@HELD.at("filled")
def fill(cell, kind, n):
    n = cell.food_numbers[_LOADS, kind]
    cell.loads = n
    cell.kind_of = ti.cast(kind, ti.u8)
    return n
