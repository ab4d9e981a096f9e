"""Data sets: recorded transitions of ants as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_ants.arguments import checked_seeds, checked_share
from taichi_ants.errors import AntsError, as_array, checked_whole, expect
from taichi_ants.files import PathLike, small
from taichi_ants.files.archives import Kind
from taichi_ants.records import Record
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.worlds.world import World

_KIND = Kind("data set", 3, "Dataset.save")


# The arrays and their types, in order.
COLUMNS: dict[str, np.dtype] = {
    **dict.fromkeys(("run", "episode", "agent", "step", "state"), np.dtype(np.int32)),
    **dict.fromkeys(("action", "reward", "next_state"), np.dtype(np.int32)),
    **dict.fromkeys(("terminated", "truncated"), np.dtype(np.bool_)),
    "behaviour_probability": np.dtype(np.float64),
}


@dataclass(frozen=True, eq=False, repr=False)
class Dataset(Record):
    """Transitions, one row each; see `record` and `record_colony`.

    An *episode* consists of consecutive steps of one ant. A delivery that is a terminal state
    terminates it; death, any other delivery that ends it, or the end of the recording truncates it.
    The *behaviour policy* is the policy that chose the actions. The arrays (n,) are read-only.

    Attributes:
        world: The world at the start.
        task: The rules.
        seeds: One seed per run.
        behaviour: Facts about the behaviour policy, JSON-compatible.
        run: int32, the number of the seed, ascending.
        episode: int32, from 0, ascending; the episodes of a run are in the order in which they
            began, and their steps are in order.
        agent: int32, the number of the ant in its colony; 0 for a lone ant.
        step: int32, the tick in the world's episode, from 0; ants that are born start later.
        state, next_state: int32, the state index before and after the step.
        action: int32, 0 to 4.
        reward: int32.
        terminated: bool, whether the episode ends here in a terminal state.
        truncated: bool, whether the episode ends here without a terminal state.
        behaviour_probability: float64, the probability with which the behaviour policy took the
            action; nan if unknown.

    Raises:
        AntsError: The arrays are inconsistent.

    >>> data = record(worlds.paper(), episodes=3, seeds=[0, 1])
    >>> data.run.max().item(), len(data.reward) == len(data.action)
    (1, True)
    """

    world: World
    task: Task
    seeds: tuple[int, ...]
    behaviour: Mapping[str, Any]
    run: np.ndarray
    episode: np.ndarray
    agent: np.ndarray
    step: np.ndarray
    state: np.ndarray
    action: np.ndarray
    reward: np.ndarray
    next_state: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    behaviour_probability: np.ndarray

    def __post_init__(self) -> None:
        """Check the arrays, because kernels do not."""
        n = len(self.run) if isinstance(self.run, np.ndarray) and self.run.ndim == 1 else 0
        if not n:
            raise AntsError("the data set has no transitions; it must have at least one.")
        for name, dtype in COLUMNS.items():
            array = as_array(f"{name} of a data set", getattr(self, name), dtype, (n,))
            array = np.ascontiguousarray(array).view()
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        most = {"run": len(self.seeds), "action": N_ACTIONS}
        most |= dict.fromkeys(("state", "next_state"), self.task.n_states)
        for name, size in most.items():
            as_array(f"{name} of a data set", getattr(self, name), "iu", None, 0, size - 1)
        # Episodes follow each other, belong to one ant each, and end at their flags.
        goes_on = ~(self.terminated | self.truncated)
        names = ("run", "episode", "agent", "step")
        run, episode, agent, step = (np.diff(getattr(self, name)) for name in names)
        chained = (step == 1) & (agent == 0) & (run == 0)
        chained &= self.next_state[:-1] == self.state[1:]
        ordered = self.episode[0] == 0 and (episode == ~goes_on[:-1]).all()
        ordered = ordered and (run >= 0).all() and not goes_on[-1]
        if not ordered or not chained[goes_on[:-1]].all():
            raise AntsError(
                "the rows of a data set are not in order; sort them so that episodes follow each "
                "other, each from its first step to the terminated or truncated one."
            )

    def __len__(self) -> int:
        return len(self.run)

    @property
    def begins(self) -> np.ndarray:
        """The first row of each of the e episodes, then the number of rows, int64 (e + 1,)."""
        return np.concatenate([[0], np.flatnonzero(self.terminated | self.truncated) + 1])

    def returns(self, discount: float = 1.0) -> np.ndarray:
        """Return the discounted return of each episode from its first step, float64 (e,).

        >>> data.returns(discount=0.9).shape == (len(data.begins) - 1,)
        True
        """
        discount = checked_share("discount", discount)
        steps = np.arange(len(self)) - self.begins[self.episode]
        return np.bincount(self.episode, weights=discount**steps * self.reward)

    def first(self, transitions: int) -> Dataset:
        """Return the first transitions of each run; a cut episode is truncated.

        >>> len(data.first(100).reward)
        100
        """
        # The first row of each row's run.
        first = np.searchsorted(self.run, np.arange(len(self.seeds)))[self.run]
        return self._take(np.arange(len(self)) - first < checked_whole("transitions", transitions))

    def of_run(self, run: int) -> Dataset:
        """Return the data of one run by its number, which it keeps; AntsError if there are none.

        >>> data.of_run(0).seeds
        (0,)
        """
        checked_whole("run", run, 0, len(self.seeds) - 1)
        return self._take(self.run == run)

    def _take(self, keep: np.ndarray) -> Dataset:
        """Return the rows `keep`, which cut episodes only at their end; renumber episodes."""
        columns = {name: getattr(self, name)[keep] for name in COLUMNS}
        if keep.any():
            last = np.append(np.diff(columns["episode"]) != 0, True)
            columns["episode"] = np.cumsum(last, dtype=np.int32) - last.astype(np.int32)
            columns["truncated"] = last & ~columns["terminated"]
        return replace(self, **columns)

    def save(self, path: PathLike) -> None:
        """Write a .npz file; raises as `archives.write` does."""
        arrays = {name: getattr(self, name) for name in COLUMNS}
        arrays = {n: small(a) if a.dtype.kind == "i" else a for n, a in arrays.items()}
        _KIND.write(path, self.facts(), arrays)

    @classmethod
    def load(cls, path: PathLike) -> Dataset:
        """Return a data set that `save` wrote; raise AntsError if the file is not valid.

        >>> data.save("data.npz")
        >>> np.array_equal(Dataset.load("data.npz").reward, data.reward)
        True
        """
        with _KIND.reading(path) as (arrays, facts):
            rows: dict[str, Any] = {n: arrays[n].astype(kind) for n, kind in COLUMNS.items()}
            return cls(**cls.described(facts), **rows)

    def facts(self) -> dict[str, Any]:
        """Return everything except the transitions, for files; `described` reads it."""
        facts = {"world": self.world.as_dict(), "task": self.task.as_dict()}
        return {**facts, "seeds": self.seeds, "behaviour": dict(self.behaviour)}

    @staticmethod
    def described(facts: Mapping[str, Any]) -> dict[str, Any]:
        """Return the fields of a data set that `facts` holds."""
        expect("behaviour", facts["behaviour"], dict)
        return {
            "world": World.from_dict(facts["world"]),
            "task": Task.from_dict(facts["task"]),
            "seeds": checked_seeds(facts["seeds"]),
            "behaviour": facts["behaviour"],
        }
