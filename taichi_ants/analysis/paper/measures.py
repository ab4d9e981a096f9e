"""What is computed from one run before any statistics: one number per configuration and seed.

"last 50" means all episodes where a run has fewer. What speaks of the first 50 or the second 50
episodes needs 100, so that early and late never share an episode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from taichi_ants.files.rows import Rows

WINDOW = 50
# What an episode gives: its array in `RunOutcomes`, words, unit.
_GIVEN = {
    "return": ("returns", "return", "reward"),
    "steps": ("steps", "length", "steps"),
    "deliveries": ("deliveries", "deliveries", "deliveries per episode"),
}
# Episodes, their words, and how many a run needs.
_WINDOWS = {
    "first50": (slice(0, WINDOW), "the first 50 episodes", 2 * WINDOW),
    "second50": (slice(WINDOW, 2 * WINDOW), "episodes 51 to 100", 2 * WINDOW),
    "last50": (slice(-WINDOW, None), "the last 50 episodes", 1),
    "all": (slice(None), "all episodes", 1),
}


@dataclass(frozen=True, eq=False, kw_only=True)
class RunOutcomes:
    """What each episode of some runs gave: arrays, or `Rows` where they may not fit into memory.

    Attributes:
        returns: Sum of the rewards of each training episode, integer (rows, seeds, episodes).
        steps: Length of each training episode in steps, of the same shape.
        deliveries: Food given to the queen in each episode, of the same shape.
        greedy_returns, greedy_steps, greedy_deliveries: The same for the greedy rollouts after
            training, integer (rows, seeds, rollouts).
    """

    returns: np.ndarray | Rows
    steps: np.ndarray | Rows
    deliveries: np.ndarray | Rows
    greedy_returns: np.ndarray | Rows
    greedy_steps: np.ndarray | Rows
    greedy_deliveries: np.ndarray | Rows
    _measured: dict[str, np.ndarray] = field(init=False, repr=False, default_factory=dict)

    @property
    def episodes(self) -> int:
        """Training episodes of a run."""
        return self.returns.shape[2]

    def measure(self, name: str) -> np.ndarray:
        """A number of `MEASURES` for each run, float64 (rows, seeds); nan with too little data."""
        if name not in self._measured:
            measure, values = MEASURES[name], np.full(self.returns.shape[:2], np.nan)
            if self.episodes >= measure.episodes:
                for row in range(len(values)):  # so that only one is in memory
                    values[row] = measure.compute(self, row)
            self._measured[name] = values
        return self._measured[name]


Compute = Callable[[RunOutcomes, int], np.ndarray]


@dataclass(frozen=True)
class Measure:
    """A number of a run.

    Attributes:
        words: What it is, for readers.
        unit: Its unit.
        compute: RunOutcomes, row -> float64 (seeds,).
        episodes: The fewest training episodes that it needs.
    """

    words: str
    unit: str
    compute: Compute
    episodes: int = 1

    @property
    def typical(self) -> bool:
        """Whether it has a typical run (an IQM); a share or a count has a mean only."""
        return self.unit in ("reward", "steps")


def _mean(name: str, episodes: slice = slice(None)) -> Compute:
    return lambda runs, row: getattr(runs, name)[row][:, episodes].mean(axis=1, dtype=float)


def _fluctuation(name: str, episodes: slice) -> Compute:
    """Root mean square change from one episode to the next, over the square root of two.

    Without a trend this is the standard deviation of independent episodes; unlike that one, it
    hardly feels the slow rise of a learning curve.
    """

    def compute(runs: RunOutcomes, row: int) -> np.ndarray:
        changes = np.diff(getattr(runs, name)[row][:, episodes].astype(float), axis=1)
        return np.sqrt(np.einsum("ij,ij->i", changes, changes) / changes.shape[1] / 2)

    return compute


def _shortest(runs: RunOutcomes, row: int) -> np.ndarray:
    return runs.steps[row].min(axis=1).astype(float)


def _repeats(runs: RunOutcomes, row: int) -> np.ndarray:
    returns, steps = runs.greedy_returns[row], runs.greedy_steps[row]
    same = (returns == returns[:, :1]) & (steps == steps[:, :1])
    return same.all(axis=1).astype(float)


def _improved(runs: RunOutcomes, row: int) -> np.ndarray:
    late, early = runs.measure("return_last50"), runs.measure("return_first50")
    return (late[row] > early[row]).astype(float)


def _measures() -> Iterator[tuple[str, Measure]]:
    for name, (array, words, unit) in _GIVEN.items():
        for window, (episodes, when, least) in _WINDOWS.items():
            mean = Measure(f"mean {words} of {when}", unit, _mean(array, episodes), least)
            yield f"{name}_{window}", mean
            changes = f"fluctuation of the {words} from episode to episode in {when}"
            compute = _fluctuation(array, episodes)
            yield f"{name}_fluctuation_{window}", Measure(changes, unit, compute, max(2, least))
        greedy = f"mean {words} of the greedy rollouts"
        yield f"greedy_{name}", Measure(greedy, unit, _mean(f"greedy_{array}"))


_SHARE = "share of runs"
MEASURES: dict[str, Measure] = {
    **dict(_measures()),
    "shortest_episode": Measure("length of the shortest training episode", "steps", _shortest),
    "improved": Measure(
        "whether the last 50 episodes return more than the first 50", _SHARE, _improved, 2 * WINDOW
    ),
    "greedy_repeats": Measure(
        "whether all greedy rollouts of a run are equal in return and length", _SHARE, _repeats
    ),
}
