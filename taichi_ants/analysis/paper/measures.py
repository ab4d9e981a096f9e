"""Measures of one run before any statistics: one number per configuration and seed.

"last 50" means all episodes where a run has fewer. What speaks of the first 50 or the second 50
episodes needs 100, so that early and late never share an episode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

WINDOW = 50
# Quantities of an episode: the array of `RunPoint`'s outcome, words, unit.
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
_SHARE = "share of runs"

# Arrays of a `RunPoint`'s outcome, integer (..., episodes) or (..., rollouts).
Outcome = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Measure:
    """A number of a run."""

    words: str
    unit: str
    compute: Callable[[Outcome], np.ndarray]  # float64 (...)
    episodes: int = 1  # of training, at least

    @property
    def uses_iqm(self) -> bool:
        """Whether it has an IQM; a share or a count has a mean only."""
        return self.unit in ("reward", "steps")


def measures_of_runs(outcome: Outcome, names: Iterable[str] | None = None) -> dict[str, np.ndarray]:
    """Return measures of runs by name, float64 (points, seeds), from arrays (points, seeds, ...).

    They are nan where the runs have fewer episodes than a measure needs. None: all of them.
    """
    *shape, episodes = outcome["returns"].shape
    return {
        name: MEASURES[name].compute(outcome)
        if episodes >= MEASURES[name].episodes
        else np.full(shape, np.nan)
        for name in names or MEASURES
    }


def _mean(name: str, episodes: slice, runs: Outcome) -> np.ndarray:
    return runs[name][..., episodes].mean(axis=-1, dtype=float)


def _fluctuation(name: str, episodes: slice, runs: Outcome) -> np.ndarray:
    """Root mean square change from one episode to the next, over the square root of two.

    For independent episodes this is their standard deviation; a slow trend hardly changes it.
    """
    changes = np.diff(runs[name][..., episodes].astype(float))
    return np.sqrt(np.einsum("...i,...i", changes, changes) / changes.shape[-1] / 2)


def _repeats(runs: Outcome) -> np.ndarray:
    arrays = runs["greedy_returns"], runs["greedy_steps"]
    same = [(array == array[..., :1]).all(axis=-1) for array in arrays]
    return np.logical_and(*same).astype(float)


def _improved(runs: Outcome) -> np.ndarray:
    late, early = (MEASURES[f"return_{when}50"].compute(runs) for when in ("last", "first"))
    return (late > early).astype(float)


def _measures() -> Iterator[tuple[str, Measure]]:
    for name, (array, words, unit) in _GIVEN.items():
        for window, (episodes, when, least) in _WINDOWS.items():
            mean = partial(_mean, array, episodes)
            yield f"{name}_{window}", Measure(f"mean {words} of {when}", unit, mean, least)
            changes = f"fluctuation of the {words} from episode to episode in {when}"
            compute = partial(_fluctuation, array, episodes)
            yield f"{name}_fluctuation_{window}", Measure(changes, unit, compute, max(2, least))
        greedy = partial(_mean, f"greedy_{array}", slice(None))
        yield f"greedy_{name}", Measure(f"mean {words} of the greedy rollouts", unit, greedy)
    words = "length of the shortest training episode"
    yield (
        "shortest_episode",
        Measure(words, "steps", lambda runs: runs["steps"].min(axis=-1).astype(float)),
    )
    words = "whether the last 50 episodes return more than the first 50"
    yield "improved", Measure(words, _SHARE, _improved, 2 * WINDOW)
    words = "whether all greedy rollouts of a run are equal in return and length"
    yield "greedy_repeats", Measure(words, _SHARE, _repeats)


MEASURES: dict[str, Measure] = dict(_measures())
