"""How the work of independent runs is cut into kernel launches.

A launch cannot be interrupted, so that Ctrl-C, progress and checkpoints wait for its end: even if
every episode uses all of its steps, a launch should take about a second. Within that bound few
large launches are best, since threads wait for the last run of each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

_SECONDS = 1.0
_STEP_NS = 25  # of one thread, on a slow core
_PLANNING_STEP_NS = 6
_WORKSPACE_BYTES = 256 * 2**20
# Kernels index the Q-tables (1024 numbers a run) and the episodes of a launch by 32 bits.
_MOST_RUNS = 2**20
_MOST_EPISODES = 2**30


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
    workers: int, episodes: int, max_steps: int, planning_steps: int, cells: int
) -> LaunchPlan:
    """Choose the size of a launch.

    Args:
        workers: Runs that progress at the same time (CPU threads).
        episodes: Episodes of each run.
        max_steps: Most steps of an episode.
        planning_steps: Model updates after each step.
        cells: i32 cells that each run of a launch needs for its world.
    """
    steps_each = _SECONDS * 1e9 / (_STEP_NS + _PLANNING_STEP_NS * planning_steps)
    rounds = int(steps_each // (episodes * max_steps))
    most_runs = max(1, min(_WORKSPACE_BYTES // (4 * cells), _MOST_RUNS, _MOST_EPISODES // episodes))
    if rounds >= 1:
        return LaunchPlan(min(workers * rounds, most_runs), episodes)
    return LaunchPlan(min(workers, most_runs), max(1, int(steps_each // max_steps)))
