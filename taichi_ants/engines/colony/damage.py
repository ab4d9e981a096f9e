"""Checks of a colony that was read from a file: kernels would write wherever its numbers point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import DELIVERED, EMPTY, FOOD, N_ACTIONS, N_STATES, OBSTACLE, QUEEN

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

_PAIRS = N_STATES * N_ACTIONS
_MANY = 2**31 - 1


def check_contents(colony: Colony) -> None:
    """Make sure that a colony, as it is between two ticks, can go on.

    Raises:
        ValueError: It cannot; the message says what is wrong.
    """
    _check_floats(colony)
    _check_ants(colony)
    _check_worlds(colony)
    _check_homes(colony)
    _check_models(colony)
    _check_sums(colony)
    if colony.episode >= 0:
        _check_ground(colony)
        _check_views(colony)


def _check_floats(colony: Colony) -> None:
    for name in ("q", "level", "rates"):
        _demand(bool(np.isfinite(colony.arrays[name]).all()), f"{name} holds no finite numbers")
    _demand(bool((colony.arrays["level"] >= 0).all()), "level is below 0")
    _demand(bool((colony.arrays["trail"] >= 0).all()), "trail is below 0")


def _check_ants(colony: Colony) -> None:
    from taichi_ants.engines.colony import arrays as names

    ants = colony.arrays["ants"]
    _check_range("the cell of an ant", ants[names.CELL], colony.layout.grid.size - 1)
    _check_range("the heading of an ant", ants[names.HEADING], N_HEADINGS - 1)
    _check_range("what an ant carries", ants[names.CARRIES], 1)
    _check_range("the life of an ant", ants[names.LIFE], names.LIVING)
    _check_range("the event of an ant", ants[names.EVENT], DELIVERED)
    _check_range("the age of an ant", ants[names.AGE], _MANY)
    _check_range("the number of an ant", ants[names.NUMBER], _MANY, least=-1)
    _check_range("the state of an ant", ants[names.STATE], N_STATES - 1)
    _check_range("the action of an ant", ants[names.ACTION], N_ACTIONS - 1, least=-1)
    _check_range("the model of an ant", ants[names.VISITED], _PAIRS)


def _check_worlds(colony: Colony) -> None:
    from taichi_ants.engines.colony import arrays as names

    worlds, slots = colony.arrays["worlds"], colony.population.slots
    living = (colony.arrays["ants"][names.LIFE] == names.LIVING).reshape(-1, slots)
    _check_range("whether a world goes on", worlds[names.RUNNING], 1)
    for row in (names.TOP, names.FIRST_VACANT):
        _check_range("a slot", worlds[row], slots)
    for row in (names.STORE, names.NEXT_NUMBER):
        _check_range("a count of a world", worlds[row], _MANY)
    _demand((worlds[names.LIVING_ANTS] == living.sum(axis=1)).all(), "the ants do not add up")
    number = np.arange(slots)
    beyond = living & (number >= worlds[names.TOP][:, None])
    skipped = ~living & (number < worlds[names.FIRST_VACANT][:, None])
    _demand(not (beyond | skipped).any(), "the slots of ants do not fit")
    if colony.episode >= 0:
        queens = colony.layout.queens
        _demand((worlds[names.QUEEN_CELL] == queens).all(), "a queen is elsewhere")


def _check_homes(colony: Colony) -> None:
    from taichi_ants.engines.colony import arrays as names

    arrays, most = colony.arrays, colony.layout.homes
    if not most:
        return
    homes, worlds = arrays["homes"], arrays["worlds"]
    _check_range("a count of places of food", worlds[names.HOMES], most)
    _check_range("a count of piles", worlds[names.PILES], most)
    _check_range("the start of a pile", arrays["piles"], most)
    _check_range("a place of food", homes[names.HOME_CELL], colony.layout.grid.size - 1)
    _check_range("when food was taken", homes[names.HOME_TAKEN], _MANY, least=-1)
    _check_range("a pile", homes[names.HOME_PILE], most)
    _check_range("an order of piles", homes[names.HOME_LISTED], most - 1)
    n_worlds = len(colony.seeds)
    _check_range("a home", arrays["home_of"], n_worlds * most - 1, least=-1)
    used = np.arange(most) < worlds[names.HOMES][:, None]
    cells = homes[names.HOME_CELL].reshape(n_worlds, most)[used]
    _demand(bool(colony.layout.grid.exists[cells].all()), "a place of food lies outside the world")
    outside = arrays["home_of"].reshape(n_worlds, -1)[:, ~colony.layout.grid.exists]
    _demand(bool((outside == -1).all()), "a home lies outside the world")


def _check_models(colony: Colony) -> None:
    """What learners that plan have seen; others have arrays of one number."""
    from taichi_ants.engines.colony import arrays as names

    entries, slots_of = colony.arrays["entries"], colony.arrays["slots_of"]
    _check_range("a pair of a model", slots_of, _PAIRS)
    _check_range("an entry of a model", entries, (1 << 21) - 1)
    _check_range("the event of an entry", entries >> 17 & 7, DELIVERED)
    _check_range("the action of an entry", entries & 7, N_ACTIONS - 1)
    _check_range("the size of a model", colony.arrays["worlds"][names.MODEL_SIZE], _PAIRS)
    if len(slots_of) > 1:
        own = colony.sharing == "own"
        known = colony.arrays["ants"][names.VISITED] if own else None
        sizes = known if own else colony.arrays["worlds"][names.MODEL_SIZE]
        found = np.count_nonzero(slots_of.reshape(-1, _PAIRS), axis=1)
        _demand((found == sizes).all(), "the pairs of a model do not add up")


def _check_sums(colony: Colony) -> None:
    """Between two ticks nothing waits to be learned."""
    from taichi_ants.engines.colony import arrays as names

    _demand(not colony.arrays["sums_of"][names.COUNT].any(), "updates are left over")
    touched = colony.arrays["touched"]
    listed = touched.reshape(-1, _PAIRS + 1)[:, 0] if len(touched) > 1 else touched
    _demand(not listed.any(), "updates are left over")


def _check_ground(colony: Colony) -> None:
    layout = colony.layout
    ground = colony.arrays["ground"].reshape(len(colony.seeds), -1)
    walls = layout.walls != 0
    _demand((ground[walls] == layout.ground[walls]).all(), "rocks are elsewhere")
    free = np.isin(ground[~walls], (EMPTY, OBSTACLE, FOOD, QUEEN)).all()
    _demand(bool(free), "ground holds what does not exist")


def _check_views(colony: Colony) -> None:
    """Ants stand on cells of their own, and see what is there: they will go by it."""
    from taichi_ants.engines.colony import arrays as names

    ants, size = colony.arrays["ants"], colony.layout.grid.size
    (columns,) = np.nonzero(ants[names.LIFE] == names.LIVING)
    world, ants = columns // colony.population.slots, ants[:, columns]
    ground, here = colony.arrays["ground"], world * size + ants[names.CELL]
    stands = (ground[here] == names.ANT_GROUND) & (colony.layout.walls.reshape(-1)[here] == 0)
    _demand(bool(stands.all()), "an ant is not where it stands")
    _demand(len(np.unique(here)) == len(here), "two ants are in one cell")
    state, carries = ants[names.STATE], ants[names.CARRIES]
    _demand((state >> 6 == carries).all(), "an ant sees what is not there")
    goal = np.where(carries == 1, QUEEN, FOOD)
    for turn, shift in ((-1, 4), (0, 2), (1, 0)):
        code = state >> shift & 3
        step = colony.layout.grid.offsets[(ants[names.HEADING] + turn) % N_HEADINGS]
        expected = np.where(code == 3, goal, EMPTY)
        wrong = (code != 1) & (ground[here + step] != expected)
        _demand(not wrong.any(), "an ant sees what is not there")


def _check_range(what: str, values: np.ndarray, most: int, least: int = 0) -> None:
    if values.size:
        low, high = int(values.min()), int(values.max())
        wrong = low if low < least else high
        _demand(least <= low and high <= most, f"{what} is {wrong}, beyond {least} to {most}")


def _demand(right: bool, reason: str) -> None:
    if not right:
        raise ValueError(reason)
