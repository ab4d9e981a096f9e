"""The replay of a run of a study, as a page that plays it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.colony.timetable import Timetable
from taichi_ants.engines.runs.training import rollout
from taichi_ants.errors import AntsError, checked_whole, count
from taichi_ants.studies.command import opened
from taichi_ants.studies.points import Point, RunPoint, key_of
from taichi_ants.studies.store import Arrays, Store
from taichi_ants.studies.study import Q_VALUES, outcome_of
from taichi_ants.viewer import Recorder, Recording, record_trace, save_page


def play(folder: Path, number: int, threads: int | None) -> None:
    """Compute row `number`, from 1, of a table of runs again, and write a page that plays it.

    Raises an AntsError if the folder has no such row, or the new numbers differ from those in the
    store.
    """
    with opened(folder) as planned:
        study, store = planned.study, Store(folder)
        order = getattr(planned.plan, "order", range(len(study.points)))  # of points in the table
        checked_whole("row", number, 1, len(order) * len(study.seeds))
        row, s = divmod(number - 1, len(study.seeds))
        point, seed = study.points[order[row]], study.seeds[s]
        where: dict[str, Any] = {"threads": threads, "arch": planned.asked["arch"]}
        try:
            kept = store.read([study.keys[order[row]]], [seed], study.arrays)
        except KeyError:
            raise AntsError("this run is missing; finish the study first.") from None
        learned = None
        if point.after is not None:
            after = store.read([key_of(point.after, *study.salt)], [seed], (Q_VALUES,))
            learned = after[Q_VALUES][0]
        learns = point.episodes and getattr(point, "sharing", "shared") == "shared"
        every = [*dict.fromkeys((*study.arrays, *[Q_VALUES] * bool(learns)))]
        again = outcome_of([point], [seed], learned, study.measure, every, where, None)
        differ = [
            name
            for name, array in kept.items()
            if not np.array_equal(array, again[name], equal_nan=array.dtype.kind == "f")
        ]
        if differ:
            raise AntsError(
                f"{count(len(differ), 'array')} of this run, such as {differ[0]}, differ from "
                "those in the store; use the version that computed it."
            )
        recording = _recorded(point, seed, again, learned, f"Row {number} of {folder.name}", where)
    path = folder / f"row-{number}.html"
    save_page(path, recording)
    print(f"seed {seed}")
    for name, array in kept.items():
        if array[0, 0].ndim == 0:
            print(f"{name} {array[0, 0]:g}")
    print(f"The new numbers are those of the row. Open {path} to see its first episode.")


def _recorded(
    point: Point, seed: int, again: Arrays, learned: Any, title: str, where: dict[str, Any]
) -> Recording:
    """Return a recording of the first episode of the evaluation of a run with these arrays."""
    if isinstance(point, RunPoint):
        table = point.policy.q_values if point.policy else again[Q_VALUES][0, 0]
        trace = rollout(point.world, table, seed, 0, point.max_steps, point.task)
        return record_trace(trace, title)
    tables = again.get(Q_VALUES, [None])[0]
    if tables is None:
        tables = point.tables([seed], learned, lambda share: None, where)
    colony = point.colony(point.worlds([seed]), [seed], tables, False, **where)
    colony.begin_episode(point.ticks)
    recorder = Recorder(colony, title)
    frames = [recorder.snapshot()]

    def stepped(colony: Colony, n: int) -> Iterator[None]:
        for _ in range(n):
            frames.append(recorder.tick())
            yield

    timetable = Timetable(colony, point.events(learns=False), point.ticks)
    with timetable:
        for _ in timetable.pieces(stepped, point.ticks):
            pass
    return Recording(recorder.header(), frames)
