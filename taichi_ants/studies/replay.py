"""The replay of a run of a study, as a page that plays it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.colony.timetable import Timetable
from taichi_ants.engines.runs.training import rollout
from taichi_ants.errors import AntsError, checked_whole, count
from taichi_ants.studies.points import ColonyPoint, key_of
from taichi_ants.studies.store import Arrays, Store
from taichi_ants.studies.study import Q_VALUES, Study, outcome_of
from taichi_ants.viewer import Recorder, Recording, record_trace


def run_of(study: Study, rows: list[int], number: int) -> tuple[int, int]:
    """Return the indices of the point and the seed in row `number`, from 1, of a table of runs.

    `rows` are the indices of points in the order of the table, each with a row for each seed.
    """
    runs = len(rows) * len(study.seeds)
    row, seed = divmod(checked_whole("row", number, 1, runs) - 1, len(study.seeds))
    return rows[row], seed


def replay(
    study: Study, store: Store, place: int, s: int, title: str = "", **where: Any
) -> tuple[Recording, Arrays]:
    """Compute a run of a store again, and return a recording of the first episode of evaluation.

    Args:
        study, store: The study, and the store with the run.
        place, s: The indices of the point and the seed.
        title: The title of the page.
        where: The arguments `threads` and `arch` of `train`.

    Returns:
        The recording, and what the store has of the run, which is equal.

    Raises:
        AntsError: The store lacks the run, or the new numbers differ from those in the store.
    """
    point, seed = study.points[place], study.seeds[s]
    try:
        kept = store.read([study.keys[place]], [seed], study.arrays)
    except KeyError:
        raise AntsError("this run is missing; finish the study first.") from None
    learned = None
    if point.after is not None:
        after = store.read([key_of(point.after, *study.salt)], [seed], (Q_VALUES,))
        learned = after[Q_VALUES][0]
    every = dict.fromkeys((*study.arrays, Q_VALUES))
    found = outcome_of([point], [seed], learned, study.measure, [*every], where, None)
    differ = [
        name
        for name, array in kept.items()
        if not np.array_equal(array, found[name], equal_nan=array.dtype.kind == "f")
    ]
    if differ:
        raise AntsError(
            f"{count(len(differ), 'array')} of this run, such as {differ[0]}, differ from those in "
            "the store; use the version that computed it."
        )
    if not isinstance(point, ColonyPoint):
        table = point.policy.q_values if point.policy else found[Q_VALUES][0, 0]
        trace = rollout(point.world, table, seed, 0, point.max_steps, point.task)
        return record_trace(trace, title), kept
    if Q_VALUES in found:
        tables = found[Q_VALUES][0]
    else:
        tables = point.tables([seed], learned, lambda share: None, where)
    colony = point.colony(point.worlds([seed]), [seed], tables, False, **where)
    return _record(colony, point, title), kept


def _record(colony: Colony, point: ColonyPoint, title: str) -> Recording:
    """Return a recording of the first episode of an evaluation, with its events."""
    colony.begin_episode(point.ticks)
    recorder = Recorder(colony, 0, title)
    timetable = Timetable(colony, point.events(learns=False), point.ticks)
    frames = [recorder.snapshot()]
    with timetable:
        for _ in timetable.pieces(_Frames(recorder, frames), point.ticks):  # type: ignore[arg-type]
            pass
    return Recording(recorder.header(), frames)


@dataclass
class _Frames:
    """A stepper that records a frame of each tick."""

    recorder: Recorder
    frames: list[bytes]

    def pieces(self, colony: Colony, n: int) -> Iterator[None]:
        for _ in range(n):
            self.frames.append(self.recorder.tick())
            yield
