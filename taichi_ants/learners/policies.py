"""Policies: tables of action values, two that need no learning, and their files.

A policy is a float32 array (n_states, 5), the value of each action in each state of an observation.
An ant takes a best action, ties at random with equal probability.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from taichi_ants.errors import AntsError, check_one_of, expect, shown
from taichi_ants.files import PathLike, to_json
from taichi_ants.files.archives import Kind
from taichi_ants.task import Task, observations
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, N_ACTIONS, PICK_UP, RIGHT
from taichi_ants.task.states import TASK_NAMES

ActionValues = npt.NDArray[np.float32]
_KIND = Kind("policy", 2, "save_policy", most=1 << 26, foreign=True)


class Policy(NamedTuple):
    """The contents of a policy file.

    Action values, float32 (n_states, 5), whose rows are the states of the registered observation of
    that name; and what made the policy.
    """

    q_values: ActionValues
    observation: str
    metadata: dict[str, Any]

    @property
    def task(self) -> Task:
        """The rules in its metadata, or the paper's; AntsError if they are not allowed."""
        try:
            task = Task.from_dict(self.metadata.get("task", {}))
        except AntsError as error:
            raise AntsError(
                f"the task in the policy's metadata cannot be used: {error} If another version "
                "wrote the file, train the policy again."
            ) from error
        return replace(task, observation=self.observation)

    def actions(self, states: npt.ArrayLike, rng: np.random.Generator) -> npt.NDArray[np.int64]:
        """A best action in each state, ties by `rng`, for the environments of this package:

        observations, infos = envs.reset(seed=0) envs.step(policy.actions(infos["state"], rng))

        States are integers of any shape, also a single one; AntsError if there is no such state.
        """
        expect("rng", rng, np.random.Generator)
        states = np.asarray(states)
        if states.dtype.kind not in "iu" or ((states < 0) | (states >= len(self.q_values))).any():
            raise AntsError(
                f"states is {shown(states)}; they must be integers from 0 to "
                f"{len(self.q_values) - 1}."
            )
        values = self.q_values[states]
        best = values == values.max(axis=-1, keepdims=True)
        return np.where(best, rng.random(values.shape), -1.0).argmax(axis=-1)


def random_policy(observation: str = "paper") -> ActionValues:
    """The policy that takes each of the five actions with equal probability, in every state."""
    return np.zeros((observations.get(observation).n_states, N_ACTIONS), np.float32)


def action_probabilities(q_values: np.ndarray, epsilon: float = 0.0) -> np.ndarray:
    """Probabilities of epsilon-greedy actions, float64 (..., 5), to the bit as in kernels."""
    explores = np.floor(epsilon * 2.0**32) / 2.0**32
    best = q_values >= q_values.max(axis=-1, keepdims=True)
    return explores / N_ACTIONS + best * ((1.0 - explores) / best.sum(axis=-1, keepdims=True))


# The rule of the trail follower: what it looks for among the cells ahead, in order of priority, and
# its action where it sees that. The letters are those of the names of states.
#   take      pick up food, or give it to the queen
#   ahead     move forward, if it is the cell straight ahead that shows one of the letters
#   straight  move onto such a cell; forward if it is one of them, else any
#   open      the same, but forward only if all three cells show them
#   any       move onto any such cell
#   stay      stay, with the same heading: the action is one that fails without a turn
# In a dead end it turns left, which opens a way out after two turns.
Rule = tuple[tuple[str, str], ...]
_WITHOUT_FOOD: Rule = (("F", "take"), ("P", "stay"), ("T", "straight"), ("E", "open"))
_WITHOUT_FOOD_IN_QUEUES: Rule = (
    *(("F", "take"), ("P", "ahead"), ("T", "straight"), ("p", "stay")),
    *(("P", "straight"), ("E", "open")),
)
_WITH_FOOD: Rule = (("Q", "take"), ("SP", "straight"), ("p", "stay"), ("EA", "any"))
# The rule without food and that with food, by the observation.
RULES: Mapping[str, tuple[Rule, Rule]] = {
    "paper": (_WITHOUT_FOOD, (("Q", "take"), ("S", "any"), ("E", "any"))),
    "ants": (_WITHOUT_FOOD, _WITH_FOOD),
    "queues": (_WITHOUT_FOOD_IN_QUEUES, _WITH_FOOD),
}
FOLLOWED = tuple(RULES)


def trail_follower(observation: str = "paper") -> ActionValues:
    """Return a hand-written policy, a table of the `RULES`, float32 (n_states, 5).

    Without food, an ant picks up the food that it sees, follows a trail, and otherwise walks
    straight over open ground and turns at random beside anything that blocks it. With food, it
    gives it to the queen, moves nearer to her, pushes ants without food out of the way, and
    otherwise walks at random until a nearer cell comes into view. An ant without food that sees an
    ant with food on a stronger trail (P) waits to be pushed along that trail. In queues, it does so
    only by moving against that ant, and it waits behind an ant that is further up the trail (p).
    Only the observations in `FOLLOWED` have rules.
    """
    check_one_of("observation", observation, FOLLOWED)
    name_of, q_values = observations.get(observation).name_of, random_policy(observation)
    for row, values in enumerate(q_values):
        load, *view = name_of(row).split()
        carries = load == TASK_NAMES[1]
        values[_choices(RULES[observation][carries], carries, view)] = 1.0
    return q_values


def _choices(rule: Rule, carries: bool, view: Sequence[str]) -> list[int]:
    """The actions among which a rule chooses, by the letters seen left, forward and right."""
    takes, fails = (GIVE, PICK_UP) if carries else (PICK_UP, GIVE)
    for letters, action in rule:
        cells = [move for move in (LEFT, FORWARD, RIGHT) if view[move] in letters]
        ahead = [move for move in cells if move == FORWARD]
        if cells and action == "take":
            return [takes]
        if cells and action == "stay":
            return [fails]
        if action == "ahead":
            cells = ahead
        # Beside what blocks, straight on would lead along a wall round the world forever.
        elif action == "straight" or (action == "open" and len(cells) == len(view)):
            cells = ahead or cells
        if cells:
            return cells
    return [LEFT]


def save_policy(
    path: PathLike, q_values: npt.ArrayLike, metadata: Mapping[str, Any], observation: str = "paper"
) -> None:
    """Write a policy file: an .npz with the action values, their observation and what made them.

    Args:
        path: The file; the whole name, no ending is added.
        q_values: Action values of shape (n_states, 5), finite as float32.
        metadata: What made the policy (configuration, seed, world ...), as JSON can hold it.
        observation: Name of the registered observation whose states index the rows.
    """
    table = _checked(q_values, observation)
    if not isinstance(metadata, Mapping):
        raise AntsError(f"metadata is {shown(metadata)}; it must be a mapping of names to values.")
    try:
        to_json(metadata)
    except (TypeError, ValueError, RecursionError) as error:
        reason = str(error) or type(error).__name__
        raise AntsError(
            f"metadata is {shown(metadata)}, which JSON cannot hold ({reason}); use numbers, text, "
            "lists and mappings."
        ) from error
    _KIND.write(path, {"observation": observation, "metadata": metadata}, {"q_values": table})


def load_policy(path: PathLike) -> Policy:
    """Read a policy file that `save_policy` wrote; AntsError if it cannot be used."""
    with _KIND.reading(path) as (arrays, facts):
        observation, metadata = facts["observation"], facts["metadata"]
        expect("metadata", metadata, dict)
        table = _checked(arrays["q_values"], observation)
        return Policy(table, observation, metadata)


def _checked(q_values: npt.ArrayLike, observation: str) -> ActionValues:
    """The action values of one policy."""
    table = checked_values(q_values, Task(observations.get(observation).name))
    if table.ndim != 2:
        raise AntsError(f"q_values has shape {table.shape}; it must be {table.shape[-2:]}.")
    return table


def checked_values(q_values: Any, task: Task) -> np.ndarray:
    """Action values as float32 (..., n_states, 5); AntsError unless they are finite numbers."""
    shape = (task.n_states, N_ACTIONS)
    try:
        values = np.asarray(q_values)
    except ValueError:  # rows of different lengths
        values = np.empty(0, object)
    if values.dtype.kind not in "fiu":
        raise AntsError(f"q_values is {shown(q_values)}; it must be an array of real numbers.")
    if values.shape[-2:] != shape or values.size == 0:
        raise AntsError(
            f"q_values has shape {values.shape}; for the observation {task.observation!r} it must "
            f"end in {shape}."
        )
    return finite("q_values is", values)


def finite(what: str, values: np.ndarray) -> np.ndarray:
    """Action values (..., 5) as float32; AntsError, which starts with `what`, unless finite."""
    with np.errstate(over="ignore"):  # a float64 that float32 cannot hold becomes infinite
        tables = values.astype(np.float32, copy=False)
    if not np.isfinite(tables).all():
        *_, state, action = where = np.argwhere(~np.isfinite(tables))[0]
        raise AntsError(
            f"{what} {tables[tuple(where)]} for state {state} and action {action}; numbers must be "
            "finite, so give an action that shall never be taken a low one."
        )
    return tables
