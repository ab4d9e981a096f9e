"""How the work of independent runs is cut into kernel launches.

A launch cannot be interrupted, so that Ctrl-C, progress and checkpoints wait for its end: even if
every episode uses all of its steps, a launch should take about a second. Within that bound few
large launches are best, since threads wait for the last run of each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

_SECONDS = 1.0
_STEP_NS = 25  # of Q-learning in one thread, on a slow core
_WORKSPACE_BYTES = 256 * 2**20
_MOST_NUMBERS = 2**30  # of one array in a launch, which kernels index by 32 bits


@dataclass(frozen=True)
class Launch:
    """Runs `first` to `first + count` do the episodes `begin` to `end`."""

    first: int
    count: int
    begin: int
    end: int


@dataclass(frozen=True)
class LaunchPlan:
    """How many runs, and how many episodes of each, go into one launch."""

    runs: int
    episodes: int

    def launches(self, n_runs: int, n_episodes: int) -> Iterator[Launch]:
        """All launches, the episodes of a run in order."""
        for first in range(0, n_runs, self.runs):
            count = min(self.runs, n_runs - first)
            for begin in range(0, n_episodes, self.episodes):
                yield Launch(first, count, begin, min(begin + self.episodes, n_episodes))


def plan_launches(
    workers: int, episodes: int, max_steps: int, cost: float, cells: int, widest: int
) -> LaunchPlan:
    """Choose the size of a launch.

    Args:
        workers: Runs that progress at the same time (CPU threads).
        episodes: Episodes of each run.
        max_steps: Most steps of an episode.
        cost: What a step takes, 1 for one of Q-learning.
        cells: i32 cells that each run of a launch needs for its world.
        widest: The most numbers that a run has in one array.
    """
    steps_each = _SECONDS * 1e9 / (_STEP_NS * cost)
    rounds = int(steps_each // (episodes * max_steps))
    numbers = max(widest, episodes)
    most_runs = max(1, min(_WORKSPACE_BYTES // (4 * cells), _MOST_NUMBERS // numbers))
    if rounds >= 1:
        return LaunchPlan(min(workers * rounds, most_runs), episodes)
    return LaunchPlan(min(workers, most_runs), max(1, int(steps_each // max_steps)))
