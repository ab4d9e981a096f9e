"""Data sets: what ants did, step by step, as arrays that others learn from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_ants.checks import checked_seeds, checked_share
from taichi_ants.engines.records import Record
from taichi_ants.errors import AntsError, check_array, checked_whole, expect
from taichi_ants.files import PathLike, smallest
from taichi_ants.files.archives import Kind
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

    An *episode* is what one ant does from the step in which it appears to the one with which its
    data end: terminated by a delivery that is a terminal state, or truncated, by its death, by
    another delivery that ends its episode, or by the end of the recording. The *behaviour policy*
    is the one that chose the actions. The arrays (n,) are read-only.

    Attributes:
        world, task: The world that the ants started in, and the rules.
        seeds: One for each run.
        behaviour: What chose the actions: names and numbers, as JSON knows them.
        run: int32, the number of the seed, ascending.
        episode: int32, from 0, ascending: in a run, those that began first come first. The steps of
            an episode come in order.
        agent: int32, the number of the ant in its colony, 0 of an ant that is alone.
        step: int32, the tick of its world, from 0. A newborn's first is larger.
        state, action, reward, next_state: int32; actions are 0 to 4.
        terminated: bool, whether there is nothing to gain after this step.
        truncated: bool, whether the episode ends with this step all the same.
        behaviour_probability: float64, with which the behaviour policy took the action; nan if it
            is not known.

    Raises:
        AntsError: The arrays do not belong together.
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
        """Refuse arrays that kernels, which believe them, could not work on."""
        n = len(self.run) if isinstance(self.run, np.ndarray) and self.run.ndim == 1 else 0
        if not n:
            raise AntsError("a data set has no transitions; record at least one.")
        for name, dtype in COLUMNS.items():
            array = getattr(self, name)
            check_array(f"{name} of a data set", array, dtype, (n,))
            array = np.ascontiguousarray(array).view()
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        most = {"run": len(self.seeds), "action": N_ACTIONS}
        most |= dict.fromkeys(("state", "next_state"), self.task.n_states)
        for name, size in most.items():
            array = getattr(self, name)
            if array.min() < 0 or array.max() >= size:
                raise AntsError(
                    f"{name} of a data set runs from {array.min()} to {array.max()}; it must lie "
                    f"between 0 and {size - 1}."
                )
        chance = self.behaviour_probability
        if not ((np.isnan(chance)) | ((chance > 0) & (chance <= 1))).all():
            raise AntsError("behaviour_probability of a data set must be above 0 and at most 1.")
        self._check_episodes()

    def _check_episodes(self) -> None:
        """Episodes stand one after the other, each of one ant, and end where their flags say."""
        goes_on = ~(self.terminated | self.truncated)
        names = ("run", "episode", "agent", "step")
        run, episode, agent, step = (np.diff(getattr(self, name)) for name in names)
        chained = (step == 1) & (agent == 0) & (run == 0)
        chained &= self.next_state[:-1] == self.state[1:]
        ordered = self.episode[0] == 0 and (episode == ~goes_on[:-1]).all()
        ordered = ordered and (run >= 0).all() and not goes_on[-1]
        if not ordered or not chained[goes_on[:-1]].all():
            raise AntsError(
                "the episodes of a data set do not stand one after the other, each from its first "
                "step to the one that is terminated or truncated; sort the rows."
            )

    def __len__(self) -> int:
        return len(self.run)

    @property
    def begins(self) -> np.ndarray:
        """Where each episode begins, and behind them where the last one ends: int64 (e + 1,)."""
        return np.concatenate([[0], np.flatnonzero(self.terminated | self.truncated) + 1])

    def returns(self, discount: float = 1.0) -> np.ndarray:
        """The discounted return of each episode from its first step, float64 (e,)."""
        discount = checked_share("discount", discount)
        ages = np.arange(len(self)) - self.begins[self.episode]
        return np.bincount(self.episode, weights=discount**ages * self.reward)

    def first(self, transitions: int | None = None, episodes: int | None = None) -> Dataset:
        """The first rows, or episodes, of each run; a last episode that is cut is truncated."""
        keep = np.ones(len(self), bool)
        # Where the run of each row begins.
        where = np.searchsorted(self.run, np.arange(len(self.seeds)))[self.run]
        if transitions is not None:
            keep &= np.arange(len(self)) - where < checked_whole("transitions", transitions)
        if episodes is not None:
            keep &= self.episode - self.episode[where] < checked_whole("episodes", episodes)
        return self._take(keep)

    def of_run(self, run: int) -> Dataset:
        """The data of one seed alone, which keeps its number; AntsError if there are none."""
        checked_whole("run", run, 0, len(self.seeds) - 1)
        return self._take(self.run == run)

    def _take(self, keep: np.ndarray) -> Dataset:
        """Some rows, of each episode the first ones or none; episodes are numbered anew."""
        columns = {name: getattr(self, name)[keep] for name in COLUMNS}
        if keep.any():
            last = np.append(np.diff(columns["episode"]) != 0, True)
            columns["episode"] = np.cumsum(last, dtype=np.int32) - last.astype(np.int32)
            columns["truncated"] = last & ~columns["terminated"]
        return replace(self, **columns)

    def save(self, path: PathLike) -> None:
        """Write a .npz file; raises as `archives.write` does."""
        arrays = {name: getattr(self, name) for name in COLUMNS}
        arrays = {n: smallest(a) if a.dtype.kind == "i" else a for n, a in arrays.items()}
        _KIND.write(path, self.facts(), arrays)

    @classmethod
    def load(cls, path: PathLike) -> Dataset:
        """Read a data set that `save` wrote; AntsError if it cannot be used."""
        with _KIND.reading(path) as (arrays, facts):
            rows: dict[str, Any] = {n: arrays[n].astype(kind) for n, kind in COLUMNS.items()}
            return cls(**cls.described(facts), **rows)

    def facts(self) -> dict[str, Any]:
        """Return all except the transitions, for files; `described` reads it."""
        facts = {"world": self.world.as_dict(), "task": self.task.as_dict()}
        return {**facts, "seeds": self.seeds, "behaviour": dict(self.behaviour)}

    @staticmethod
    def described(facts: Mapping[str, Any]) -> dict[str, Any]:
        """Return the fields of a data set that are in such facts."""
        expect("behaviour", facts["behaviour"], dict)
        return {
            "world": World.from_dict(facts["world"]),
            "task": Task.from_dict(facts["task"]),
            "seeds": checked_seeds(facts["seeds"]),
            "behaviour": facts["behaviour"],
        }
