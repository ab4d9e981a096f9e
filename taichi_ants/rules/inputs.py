"""The inputs that rules can read: their meaning, their number of entries, and drawn values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from taichi_ants.features import INPUTS
from taichi_ants.features.feature import Input
from taichi_ants.features.rule import RuleKind
from taichi_ants.grid.constants import MOST_REWARD

if TYPE_CHECKING:
    import numpy as np

AHEAD = 3  # entries of an input with a value for each cell ahead: left, forward, right
LEVELS, LEVEL = "levels_", "level_"  # the beginnings of inputs that read a field
MOST_LEVEL = 1_000_000_000


_CUE = "the ant's cue: the pheromone that an ant with its load follows"
_TICK = Input("number of the tick in the episode, from 0")
_OF_ANTS = {  # of all kinds of rules that ants follow
    "trait": Input("number of the ant from 0 to less than 1, which never changes"),
    **{name: read for name, (read, _) in INPUTS.items()},  # of features
    "tick": _TICK,
}
_OF_ACTIONS = {  # of rules that are called after an action
    "carries": Input("1 if the ant has food after its action, else 0"),
    "event": Input("result of the ant's action, see `taichi_ants.task.constants.Event`"),
    "paper_state": Input("the paper's state of the ant before its action, 0 to 127"),
    **_OF_ANTS,
}
KINDS: dict[str, RuleKind] = {
    "choice": RuleKind(
        "an action: 0 left, 1 forward, 2 right, 3 pick up, 4 deliver",
        *(0, 4, True),
        {
            "values": Input("action values of the ant's state; the ants then need a table", 5),
            "codes": Input("codes seen: 0 E, 1 O, 2 T or S, 3 F or Q; see the glossary", AHEAD),
            "levels": Input(f"levels of {_CUE}; 0 on obstacles, food and misread cells", AHEAD),
            "nearer": Input("1 if the cell is better by a cue such as the compass, else 0", AHEAD),
            "is_open": Input("1 if the ant can try to enter the cell, else 0", AHEAD),
            "level": Input("level of the ant's cue on its own cell"),
            "carries": Input("1 with food, else 0"),
            "paper_state": Input("the paper's state, 0 to 127"),
            "epsilon": Input("exploration rate"),
            "random": Input("random number from 0 to less than 1"),
            "random_2": Input("another random number from 0 to less than 1"),
            **_OF_ANTS,
        },
        of_fields=(LEVELS, LEVEL),
    ),
    "deposit": RuleKind(
        "the new level of the cell; the level itself for no deposit",
        *(0, MOST_LEVEL, False),
        {
            "level": Input("level of the cell before the deposit"),
            "carried": Input("ticks since the ant's load changed"),
            **_OF_ACTIONS,
        },
        of_fields=(LEVEL,),
    ),
    "evaporation": RuleKind(
        "the level of a cell after the tick, before diffusion",
        *(0, MOST_LEVEL, False),
        {"level": Input("level of the cell before evaporation"), "tick": _TICK},
    ),
    "reward": RuleKind(
        "the reward of the ant's action",
        *(-MOST_REWARD, MOST_REWARD, True),
        {
            "reward": Input("reward by `task.rewards` and `task.foods`"),
            "next_paper_state": Input("the paper's state after the tick, 0 to 127"),
            "levels": Input(f"levels of {_CUE}, after the tick; 0 on obstacles and food", AHEAD),
            "level": Input("level of the ant's cue on its own cell, after the tick"),
            **_OF_ACTIONS,
        },
        of_fields=(LEVELS, LEVEL),
    ),
}


def input_of(kind: str, name: str) -> Input | None:
    """Return an input of a kind of rules by its name; None if there is none."""
    if name in KINDS[kind].inputs:
        return KINDS[kind].inputs[name]
    for start in KINDS[kind].of_fields:
        if name.startswith(start) and name != start:
            return Input(f"level of {name.removeprefix(start)}", AHEAD if start == LEVELS else 0)
    return None


def field_of(name: str) -> str:
    """Return the name of the field that an input of any kind reads, or an empty string."""
    known = any(name in kind.inputs for kind in KINDS.values())
    for start in (LEVELS, LEVEL):
        if name.startswith(start) and not known:
            return name.removeprefix(start)
    return ""


class Vector(tuple):
    """A vector of numbers whose indices are whole numbers that are not negative, as in kernels."""

    def __getitem__(self, k: Any) -> Any:
        if k != int(k) or not 0 <= k < len(self):
            raise IndexError(f"there is no entry {k}")
        return super().__getitem__(int(k))


def values_shown(values: Mapping[str, Any]) -> str:
    """Return the values of the arguments of a rule for a message."""
    return ", ".join(f"{name}={value}" for name, value in values.items())


def drawn(rng: np.random.Generator, name: str, length: int = 0) -> Any:
    """Return a value that an input of this name can have: a float, or a Vector of floats."""
    import numpy as np

    if length:
        return Vector(drawn(rng, name) for _ in range(length))
    if name in _MOST:
        return float(rng.integers(_MOST[name] + 1))
    if name in ("random", "random_2", "epsilon", "trait"):
        return float(rng.integers(2**32)) / 2**32
    if name in ("tick", "carried"):
        return float(int(10 ** rng.uniform(0, 7)) - 1)
    if name == "reward":
        return float(rng.integers(-MOST_REWARD, MOST_REWARD + 1))
    if name == "values":
        return float(np.float32((0.0, 1.0, rng.normal(scale=30))[rng.integers(3)]))
    # Usual levels are often drawn, and the largest ones sometimes.
    level = (0.0, 250.0, 10 ** rng.uniform(0, 9 if rng.random() < 0.25 else 6))[rng.integers(3)]
    return float(np.float32(level) if rng.random() < 0.5 else int(level))


_MOST = {
    **{"codes": 3, "nearer": 1, "is_open": 1, "carries": 1, "event": 7},
    **{"paper_state": 127, "next_paper_state": 127},
}
