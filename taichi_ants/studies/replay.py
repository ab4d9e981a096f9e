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
from taichi_ants.studies.points import ColonyPoint, key_of
from taichi_ants.studies.store import Arrays, Store
from taichi_ants.studies.study import Q_VALUES, Study, outcome_of
from taichi_ants.viewer import Recorder, Recording, record_trace, save_page


def play(folder: Path, number: int, threads: int | None) -> None:
    """Compute row `number`, from 1, of a table of runs again, and write a page that plays it.

    Raises:
        AntsError: The folder has no such row, or the new numbers differ from those in the store.
    """
    with opened(folder) as planned:
        study, title = planned.study, f"Row {number} of {folder.name}"
        order = getattr(planned.plan, "order", range(len(study.points)))  # of points in the table
        checked_whole("row", number, 1, len(order) * len(study.seeds))
        row, s = divmod(number - 1, len(study.seeds))
        where = {"threads": threads, "arch": planned.facts["arch"]}
        recording, values = replay(study, Store(folder), order[row], s, title, **where)
    path = folder / f"row-{number}.html"
    save_page(path, recording)
    print(f"seed {study.seeds[s]}")
    for name, array in values.items():
        if array[0, 0].ndim == 0:
            print(f"{name} {array[0, 0]:g}")
    print(f"The new numbers are those of the row. Open {path} to see its first episode.")


def replay(
    study: Study, store: Store, p: int, s: int, title: str = "", **where: Any
) -> tuple[Recording, Arrays]:
    """Compute a run of a store again, and return a recording of the first episode of evaluation.

    Args:
        study, store: The study, and the store with the run.
        p, s: The indices of the point and the seed.
        title: The title of the page.
        where: The arguments `threads` and `arch` of `train`.

    Returns:
        The recording, and what the store has of the run, which is equal.

    Raises:
        AntsError: The store lacks the run, or the new numbers differ from those in the store.
    """
    point, seed = study.points[p], study.seeds[s]
    try:
        kept = store.read([study.keys[p]], [seed], study.arrays)
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
            f"{count(len(differ), 'array')} of this run, such as {differ[0]}, differ from those in "
            "the store; use the version that computed it."
        )
    if not isinstance(point, ColonyPoint):
        table = point.policy.q_values if point.policy else again[Q_VALUES][0, 0]
        trace = rollout(point.world, table, seed, 0, point.max_steps, point.task)
        return record_trace(trace, title), kept
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
    return Recording(recorder.header(), frames), kept
