"""Measures of one run before any statistics: one number per configuration and seed.

If a run has fewer than 50 episodes, "last 50" means all of them. Measures of the first or second 50
episodes need 100 episodes, so that early and late measures never share an episode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

WINDOW = 50
# Quantities of an episode: array in the outcome of a `RunPoint`, name for readers, unit.
_GIVEN = {
    "return": ("returns", "return", "reward"),
    "steps": ("steps", "length", "steps"),
    "deliveries": ("deliveries", "deliveries", "deliveries per episode"),
}
# Windows of episodes: slice, name for readers, number of episodes that a run needs.
_WINDOWS = {
    "first50": (slice(0, WINDOW), "the first 50 episodes", 2 * WINDOW),
    "second50": (slice(WINDOW, 2 * WINDOW), "episodes 51 to 100", 2 * WINDOW),
    "last50": (slice(-WINDOW, None), "the last 50 episodes", 1),
    "all": (slice(None), "all episodes", 1),
}
_SHARE = "share of runs"

# The outcome of a `RunPoint`: integer arrays (..., episodes) or (..., rollouts) by name.
Outcome = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Measure:
    """A measure of a single run, such as the mean return of its last 50 episodes."""

    words: str
    unit: str
    compute: Callable[[Outcome], np.ndarray]  # float64 (...)
    episodes: int = 1  # the fewest episodes of training that it needs

    @property
    def uses_iqm(self) -> bool:
        """Whether it has an IQM; shares and counts have only a mean."""
        return self.unit in ("reward", "steps")


def measures_of_runs(outcome: Outcome, names: Iterable[str] | None = None) -> dict[str, np.ndarray]:
    """Return measures of runs by name, float64 (points, seeds), from arrays (points, seeds, ...).

    If the runs have fewer episodes than a measure needs, it is nan. `names=None` means all.
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
    """Return the root mean square change between successive episodes, divided by sqrt(2).

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
        words = f"mean {words} of the greedy rollouts"
        yield f"greedy_{name}", Measure(words, unit, greedy, episodes=0)
    words = "length of the shortest training episode"
    yield (
        "shortest_episode",
        Measure(words, "steps", lambda runs: runs["steps"].min(axis=-1).astype(float)),
    )
    words = "whether the last 50 episodes return more than the first 50"
    yield "improved", Measure(words, _SHARE, _improved, 2 * WINDOW)
    words = "whether all greedy rollouts of a run are equal in return and length"
    yield "greedy_repeats", Measure(words, _SHARE, _repeats, episodes=0)


MEASURES: dict[str, Measure] = dict(_measures())
