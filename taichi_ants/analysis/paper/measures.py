"""What is computed from one run before any statistics: one number per configuration and seed.

"last 50" means all episodes where a run has fewer. What speaks of the first 50 or the second 50
episodes needs 100, so that early and late never share an episode.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

WINDOW = 50
LAST = slice(-WINDOW, None)
FIRST = slice(0, WINDOW)
SECOND = slice(WINDOW, 2 * WINDOW)
ALL = slice(None)


@dataclass(frozen=True, eq=False, kw_only=True)
class RunOutcomes:
    """What each episode of some runs gave.

    Attributes:
        returns: Sum of the rewards of each training episode, integer (rows, seeds, episodes).
        steps: Length of each training episode in steps, of the same shape.
        deliveries: Food given to the queen in each episode, of the same shape.
        greedy_returns, greedy_steps, greedy_deliveries: The same for the greedy rollouts after
            training, integer (rows, seeds, rollouts).
    """

    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
    greedy_returns: np.ndarray
    greedy_steps: np.ndarray
    greedy_deliveries: np.ndarray
    _measured: dict[str, np.ndarray] = field(init=False, repr=False, default_factory=dict)

    @property
    def episodes(self) -> int:
        """Training episodes of a run."""
        return self.returns.shape[2]

    def measure(self, name: str) -> np.ndarray:
        """A number of `MEASURES` for each run, float64 (rows, seeds); nan with too little data."""
        if name not in self._measured:
            measure, missing = MEASURES[name], np.full(self.returns.shape[:2], np.nan)
            enough = self.episodes >= measure.episodes
            self._measured[name] = measure.compute(self) if enough else missing
        return self._measured[name]


@dataclass(frozen=True)
class Measure:
    """A number of a run.

    Attributes:
        words: What it is, for readers.
        unit: Its unit.
        compute: RunOutcomes -> float64 (rows, seeds).
        episodes: The fewest training episodes that it needs.
    """

    words: str
    unit: str
    compute: Callable[[RunOutcomes], np.ndarray]
    episodes: int = 1

    @property
    def typical(self) -> bool:
        """Whether it has a typical run (an IQM); a share or a count has a mean only."""
        return self.unit in ("reward", "steps")


def _mean(name: str, episodes: slice = ALL) -> Callable[[RunOutcomes], np.ndarray]:
    return lambda runs: getattr(runs, name)[..., episodes].mean(axis=2, dtype=float)


def _fluctuation(name: str, episodes: slice = ALL) -> Callable[[RunOutcomes], np.ndarray]:
    """Root mean square change from one episode to the next, over the square root of two.

    Without a trend this is the standard deviation of independent episodes; unlike that one, it
    hardly feels the slow rise of a learning curve.
    """

    def compute(runs: RunOutcomes) -> np.ndarray:
        values = getattr(runs, name)[..., episodes]
        squares = np.empty(values.shape[:2])
        for row, of_row in enumerate(values):  # row by row, so that the differences stay small
            changes = np.diff(of_row.astype(float), axis=1)
            squares[row] = np.einsum("ij,ij->i", changes, changes) / changes.shape[1]
        return np.sqrt(squares / 2)

    return compute


def _shortest(runs: RunOutcomes) -> np.ndarray:
    return runs.steps.min(axis=2).astype(float)


def _repeats(runs: RunOutcomes) -> np.ndarray:
    returns, steps = runs.greedy_returns, runs.greedy_steps
    same = (returns == returns[..., :1]) & (steps == steps[..., :1])
    return same.all(axis=2).astype(float)


def _improved(runs: RunOutcomes) -> np.ndarray:
    return (runs.measure("return_last50") > runs.measure("return_first50")).astype(float)


_EARLY = 2 * WINDOW
_REWARD, _STEPS, _DELIVERIES, _SHARE = "reward", "steps", "deliveries per episode", "share of runs"
_CHANGES = "from episode to episode"

# fmt: off
MEASURES: dict[str, Measure] = {
    "return_last50": Measure(
        "mean return of the last 50 episodes", _REWARD, _mean("returns", LAST)),
    "return_first50": Measure(
        "mean return of the first 50 episodes", _REWARD, _mean("returns", FIRST), _EARLY),
    "steps_last50": Measure(
        "mean length of the last 50 episodes", _STEPS, _mean("steps", LAST)),
    "steps_first50": Measure(
        "mean length of the first 50 episodes", _STEPS, _mean("steps", FIRST), _EARLY),
    "steps_all": Measure("mean length of all episodes", _STEPS, _mean("steps")),
    "deliveries_last50": Measure(
        "mean deliveries of the last 50 episodes", _DELIVERIES, _mean("deliveries", LAST)),
    "deliveries_second50": Measure(
        "mean deliveries of episodes 51 to 100", _DELIVERIES, _mean("deliveries", SECOND), _EARLY),
    "return_fluctuation_first50": Measure(
        f"fluctuation of the return {_CHANGES} in the first 50 episodes",
        _REWARD, _fluctuation("returns", FIRST), _EARLY),
    "return_fluctuation_last50": Measure(
        f"fluctuation of the return {_CHANGES} in the last 50 episodes",
        _REWARD, _fluctuation("returns", LAST), 2),
    "return_fluctuation_all": Measure(
        f"fluctuation of the return {_CHANGES} over all episodes",
        _REWARD, _fluctuation("returns"), 2),
    "steps_fluctuation_all": Measure(
        f"fluctuation of the length {_CHANGES} over all episodes",
        _STEPS, _fluctuation("steps"), 2),
    "shortest_episode": Measure("length of the shortest training episode", _STEPS, _shortest),
    "improved": Measure(
        "whether the last 50 episodes return more than the first 50", _SHARE, _improved, _EARLY),
    "greedy_return": Measure(
        "mean return of the greedy rollouts", _REWARD, _mean("greedy_returns")),
    "greedy_steps": Measure(
        "mean length of the greedy rollouts", _STEPS, _mean("greedy_steps")),
    "greedy_deliveries": Measure(
        "mean deliveries of the greedy rollouts", _DELIVERIES, _mean("greedy_deliveries")),
    "greedy_repeats": Measure(
        "whether all greedy rollouts of a run are equal in return and length", _SHARE, _repeats),
}
# fmt: on
