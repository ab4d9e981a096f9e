"""Policies: tables of action values and their files; two policies that need no learning.

A policy is a float32 array (n_states, 5), the value of each action in each state of an observation.
An ant takes an action with the largest value; ties are broken at random with equal probability.
"""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from taichi_ants.errors import AntsError, as_array, check_one_of, expect, refuse, shown
from taichi_ants.files import PathLike
from taichi_ants.files.archives import Kind
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Choice, Task, observations
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, N_ACTIONS, PICK_UP, RIGHT
from taichi_ants.task.states import TASK_NAMES

__all__ = [
    "Policy", "action_probabilities", "frozen_policy", "load_policy", "random_policy",
    "save_policy", "trail_follower",
]  # fmt: skip
ActionValues = npt.NDArray[np.float32]
_KIND = Kind("policy", 2, "save_policy", most=1 << 26)


class Policy(NamedTuple):
    """The contents of a policy file: action values, float32 (n_states, 5), and their origin.

    `observation` is the name of the registered observation whose states index the rows; `metadata`
    has the origin of the policy (configuration, seed, world ...).
    """

    q_values: ActionValues
    observation: str
    metadata: dict[str, Any]

    @property
    def task(self) -> Task:
        """The rules in the metadata, by default the paper's; AntsError if they are not allowed."""
        task = Task.from_dict(self.metadata.get("task", {}))
        return replace(task, observation=self.observation)


def random_policy(observation: str = "paper") -> ActionValues:
    """Return the policy for an observation that takes all five actions with equal probability.

    >>> random_policy().shape
    (128, 5)
    """
    return np.zeros((observations.get(observation).n_states, N_ACTIONS), np.float32)


def action_probabilities(
    q_values: np.ndarray, epsilon: float = 0.0, choice: Choice | None = None
) -> np.ndarray:
    """Return the probabilities of actions, float64 (..., 5), in states with given action values.

    Args:
        q_values: float (..., 5), action values.
        epsilon: The exploration rate, 0 to 1.
        choice: The rule of choice; None for epsilon-greedy ants.

    Epsilon-greedy probabilities are exactly as in kernels. Probabilities of the rule "softmax" can
    differ from those in kernels by rounding.

    >>> action_probabilities(np.array([0, 1, 1, 0, 0]), epsilon=0.5).tolist()
    [0.1, 0.35, 0.35, 0.1, 0.1]
    """
    q_values = np.asarray(q_values)
    explores = np.floor(epsilon * 2.0**32) / 2.0**32
    if choice is not None and (weights := choice.weights(q_values)) is not None:
        shares = weights / weights.sum(axis=-1, keepdims=True)
        return explores / N_ACTIONS + (1.0 - explores) * shares
    best = q_values >= q_values.max(axis=-1, keepdims=True)
    return explores / N_ACTIONS + best * ((1.0 - explores) / best.sum(axis=-1, keepdims=True))


# The rules of the trail follower: pairs of letters and an action, in order of priority. A pair
# applies if one of the three cells ahead shows one of its letters, those of the names of states.
#   take      pick up food, or give it to the queen
#   ahead     move forward if the cell forward shows one of the letters, else try the next pair
#   straight  move forward if the cell forward shows one, else onto any cell that does
#   open      move forward if all three cells show one, else onto any cell that does
#   any       move onto any cell that shows one
#   stay      stay with the same heading, by an action that fails without a turn
# In a dead end the ant turns left; after two turns it sees the way out.
Rule = tuple[tuple[str, str], ...]
_WITHOUT_FOOD: Rule = (("F", "take"), ("P", "stay"), ("T", "straight"), ("E", "open"))
_WITHOUT_FOOD_IN_QUEUES: Rule = (
    *(("F", "take"), ("P", "ahead"), ("T", "straight"), ("p", "stay")),
    *(("P", "straight"), ("E", "open")),
)
_WITH_FOOD: Rule = (("Q", "take"), ("SP", "straight"), ("p", "stay"), ("EA", "any"))
# By observation, the rule without food and the rule with food.
RULES: Mapping[str, tuple[Rule, Rule]] = {
    "paper": (_WITHOUT_FOOD, (("Q", "take"), ("S", "any"), ("E", "any"))),
    "ants": (_WITHOUT_FOOD, _WITH_FOOD),
    "queues": (_WITHOUT_FOOD_IN_QUEUES, _WITH_FOOD),
}
FOLLOWED = tuple(RULES)


def trail_follower(observation: str = "paper") -> ActionValues:
    """Return a hand-written policy, a table of the `RULES`, float32 (n_states, 5).

    Without food, an ant picks up food in view, follows a trail, and otherwise walks straight over
    open ground and turns at random next to obstacles. With food, it delivers to the queen, moves
    nearer to her, pushes ants without food out of the way, and otherwise walks at random until it
    sees a nearer cell. An ant without food that sees an ant with food on a stronger trail (P) waits
    until that ant pushes it along the trail. With the observation `queues`, it moves against that
    ant instead of waiting, and waits behind an ant that is further up the trail (p). Only the
    observations in `FOLLOWED` have rules.

    >>> trail_follower("ants").shape
    (432, 5)
    """
    check_one_of("observation", observation, FOLLOWED)
    name_of, q_values = observations.get(observation).name_of, random_policy(observation)
    for row, values in enumerate(q_values):
        load, *view = name_of(row).split()
        carries = load == TASK_NAMES[1]
        values[_choices(RULES[observation][carries], carries, view)] = 1.0
    return q_values


# Policies that need no learning, by name: functions of the name of an observation.
NAMED = {"trail_follower": trail_follower, "random": random_policy}


def _choices(rule: Rule, carries: bool, view: Sequence[str]) -> list[int]:
    """Return the actions that a rule allows, by the letters seen left, forward and right."""
    takes, fails = (GIVE, PICK_UP) if carries else (PICK_UP, GIVE)
    for letters, action in rule:
        cells = [move for move in (LEFT, FORWARD, RIGHT) if view[move] in letters]
        ahead = [move for move in cells if move == FORWARD]
        if cells and action in ("take", "stay"):
            return [takes if action == "take" else fails]
        if action == "ahead":
            cells = ahead
        # Next to an obstacle, walking straight would follow a wall around the world forever.
        elif action == "straight" or (action == "open" and len(cells) == len(view)):
            cells = ahead or cells
        if cells:
            return cells
    return [LEFT]


def frozen_policy(
    name_or_path: PathLike, observation: str = "paper", name: str = "policy"
) -> ActionValues:
    """Return a policy without learning by its name, or the policy in a file (.npz).

    Args:
        name_or_path: "trail_follower", "random", or the path of a file.
        observation: The name of the observation of the ants that follow it.
        name: The name of the argument in messages.

    Raises:
        AntsError: There is no such policy for this observation, or the file cannot be used.

    >>> (frozen_policy("trail_follower", "ants") == trail_follower("ants")).all().item()
    True
    """
    expect(name, name_or_path, str, os.PathLike)
    name_or_path = os.fspath(name_or_path)
    if name_or_path in NAMED:
        return NAMED[name_or_path](observation)
    if not name_or_path.endswith(".npz"):
        allowed = f"one of {', '.join(NAMED)}, or the path of a policy file (.npz)"
        refuse(name, name_or_path, allowed)
    policy = load_policy(name_or_path)
    if policy.observation != observation:
        raise AntsError(
            f"{name} is {shown(name_or_path)}, which is for the observation "
            f"{policy.observation!r}, but task.observation is {observation!r}; set the observation "
            "of the policy."
        )
    return policy.q_values


def save_policy(
    path: PathLike, q_values: npt.ArrayLike, metadata: Mapping[str, Any], observation: str = "paper"
) -> None:
    """Write a policy file: an .npz with the action values, their observation and their origin.

    Args:
        path: The file; no suffix is added.
        q_values: Action values of shape (n_states, 5), finite as float32.
        metadata: Origin of the policy (configuration, seed, world ...), in types of JSON.
        observation: Name of the registered observation whose states index the rows.

    >>> import pathlib, tempfile
    >>> path = pathlib.Path(tempfile.mkdtemp(), "policy.npz")
    >>> save_policy(path, result.q_values[0, 0], {"learner": "sarsa"})
    """
    table = checked_table(q_values, Task(observations.get(observation).name))
    expect("metadata", metadata, Mapping)
    _KIND.write(path, {"observation": observation, "metadata": metadata}, {"q_values": table})


def load_policy(path: PathLike) -> Policy:
    """Return the policy in a file that `save_policy` wrote; AntsError if it cannot be used.

    >>> import pathlib, tempfile
    >>> path = pathlib.Path(tempfile.mkdtemp(), "policy.npz")
    >>> save_policy(path, result.q_values[0, 0], {"seed": 0})
    >>> load_policy(path).observation
    'paper'
    """
    with _KIND.reading(path) as (arrays, facts):
        observation, metadata = facts["observation"], facts["metadata"]
        expect("metadata", metadata, dict)
        table = checked_table(arrays["q_values"], Task(observations.get(observation).name))
        return Policy(table, observation, metadata)


def checked_values(q_values: Any, task: Task) -> np.ndarray:
    """Return action values as float32 (..., n_states, 5); AntsError unless they are finite.

    Also accepts an object with `q_values`: a `TrainingResult`, a `Policy` or a `Colony`.
    """
    shape = (task.n_states, N_ACTIONS)
    values = as_array("q_values", getattr(q_values, "q_values", q_values), "fiu")
    if values.shape[-2:] != shape or values.size == 0:
        raise AntsError(
            f"q_values has shape {values.shape}; for the observation {task.observation!r} it must "
            f"end in {shape}."
        )
    return finite("q_values is", values)


def checked_table(q_values: Any, task: Task) -> np.ndarray:
    """Return the one table of `q_values`, float32 (n_states, 5); AntsError if it has several."""
    tables = checked_values(q_values, task)
    if (n := math.prod(tables.shape[:-2])) > 1:
        whose = "its " if hasattr(q_values, "q_values") else ""
        places = ", ".join("0" * (tables.ndim - 2))
        raise AntsError(
            f"q_values has shape {tables.shape}, which is {n} tables; give one of them, for "
            f"example {whose}q_values[{places}]."
        )
    return tables.reshape(tables.shape[-2:])


def check_finite(
    tables: np.ndarray, configs: Sequence[TrainingConfig], seeds: Sequence[int]
) -> None:
    """Raise AntsError if learnt tables (configurations * seeds, ...) are not finite."""
    with np.errstate(all="ignore"):
        if np.isfinite(tables.sum()):  # a copy of a colony's tables could take much memory
            return
    finite = np.isfinite(tables).reshape(len(configs), len(seeds), -1).all(axis=-1)
    for c, s in np.argwhere(~finite)[:1]:
        raise AntsError(
            f"learner {configs[c].learner!r} computed action values that are not finite, with "
            f"{configs[c]} and seed {seeds[s]}; try your own learner with "
            "`taichi-ants check FILE`, or use smaller rewards and action values."
        )


def finite(what: str, values: np.ndarray) -> np.ndarray:
    """Return action values (..., 5) as float32; AntsError that starts with `what` unless finite."""
    with np.errstate(over="ignore"):  # a float64 that float32 cannot hold becomes infinite
        tables = values.astype(np.float32, copy=False)
    if not np.isfinite(tables).all():
        *_, state, action = where = np.argwhere(~np.isfinite(tables))[0]
        raise AntsError(
            f"{what} {tables[tuple(where)]} for state {state} and action {action}; it must be "
            "finite, so use a low number instead of -inf."
        )
    return tables
