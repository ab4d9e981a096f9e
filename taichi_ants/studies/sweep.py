"""Sweeps: the points of a sweep file over seeds, their measures, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.analysis import sensitivity, sweeps
from taichi_ants.analysis.findings import Contrast, above, judge
from taichi_ants.analysis.statistics import known_means
from taichi_ants.errors import AntsError, shown
from taichi_ants.files import tables as tables_of
from taichi_ants.measures import Run, finished
from taichi_ants.measures.measure import RUN
from taichi_ants.measures.series import stops
from taichi_ants.settings import declared, flat
from taichi_ants.studies.design import Axis, Design, varying
from taichi_ants.studies.folder import Results
from taichi_ants.studies.points import SERIES
from taichi_ants.studies.store import Arrays, parts_of
from taichi_ants.studies.study import Study
from taichi_ants.studies.sweep_file import Base, Settings, as_list, check_training

_SHOWN_POINTS = 10  # of a design, in the report
_WORDS = {"supported": "more", "contradicted": "less", "equivalent": "equal"}


@dataclass(frozen=True)
class Sweep:
    """A sweep, read from a file.

    Attributes:
        base: The part of the file without [vary] tables; figures show its first measure.
        study: The points over the seeds, each point once.
        order: The index in the study of the point of each row of `settings`; points can repeat.
        settings: The settings that vary, by row.
        grids: For each [vary] table, its rows, and the values or ranges of its settings.
        against: The setting and its value with which all others are compared.
    """

    base: Base
    study: Study
    order: list[int]
    settings: list[Settings]
    grids: Sequence[tuple[slice, Mapping[str, Axis]]]
    design: Design
    against: tuple[str, Any] | None

    def facts(self) -> dict[str, Any]:
        """Return what determines the results besides the settings of the points."""
        own = {k: v for k, v in self.base.reading.items() if k == "measure_every"}
        own |= {"measures": self.base.measures, "against": self.against}
        return {**own, **vars(self.design), "vary": self.settings}

    def findings(self, values: np.ndarray) -> dict[int, dict[str, Any]]:
        """Return by row the finding on its difference from the row with the value `against`.

        `values` is the first measure, float64 (rows, seeds). All intervals of a [vary] table hold
        at the same time.
        """
        if self.against is None:
            return {}
        (name, value), findings = self.against, {}
        for grid, _ in self.grids:
            rows, of_grid = self.settings[grid], values[grid]
            pairs = {
                n: rows.index({**row, name: value})
                for n, row in enumerate(rows)
                if row.get(name) != value and {**row, name: value} in rows
            }
            differences = [of_grid[n] - of_grid[other] for n, other in pairs.items()]
            judged = judge([Contrast("", each, above(self.design.margin)) for each in differences])
            for n, difference, contrast in zip(pairs, differences, judged, strict=True):
                word = _WORDS.get(contrast.verdict.value, "undecided")
                low, high = contrast.low, contrast.high
                numbers = {"difference": contrast.effect, "low": low, "high": high}
                if np.isnan(values).any():
                    numbers["left_out"] = int(np.isnan(difference).sum())
                findings[grid.start + n] = {**rows[n], "finding": word, **numbers}
        return findings


def plan(options: Mapping[str, Any]) -> Sweep:
    """Return the sweep of the option `file`; AntsError, which names the file, if it is wrong."""
    path = Path(options["file"])
    text = files.read_text(path)
    try:
        file = files.tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise AntsError(f"{str(path)!r} is not valid TOML: {error}; correct it.") from error
    try:
        return sweep_of(file)
    except AntsError as error:
        raise AntsError(f"in {str(path)!r}, {error}") from error


def sweep_of(file: Settings) -> Sweep:
    """Return the sweep of the contents of a file; AntsError if a setting is not allowed."""
    base = Base.of(file)
    drawn = Design(**{key.name: file[key.name] for key in declared(Design) if key.name in file})
    rows, grids = list[Settings](), []
    for table in as_list(file.get("vary", [])):
        axes = base.axes(table)
        part = drawn.rows(axes)
        grids.append((slice(len(rows), len(rows) + len(part)), axes))
        rows += part
    if not grids:
        raise AntsError("[vary] is missing; add it with lists of values of the settings that vary.")
    if drawn.sensitivity and len(grids) > 1:
        raise AntsError(f"sensitivity is for one [vary] table, but there are {len(grids)}.")
    built = dict[str, Any]()
    points = tuple(base.point(row, built) for row in rows)
    for of_table, names in [(slice(None), base.fixed), *grids]:
        check_training(names, points[of_table])
    against: Any = flat(file["against"]) if isinstance(file.get("against"), dict) else {}
    (against,) = against.items() if len(against) == 1 else [None]
    of_grid = drawn.design == "grid" and any(against in row.items() for row in rows)
    if ("against" in file or "margin" in file) and not of_grid:
        said = "{} = {}".format(*against) if against else shown(file.get("against"))
        raise AntsError(
            f"against is {said}; with a grid, it must be one setting of [vary] with one of the "
            "values there, which margin requires."
        )
    arrays = base.measures
    if "measure_every" in base.reading:
        arrays += tuple(f"{SERIES}{name}" for name in base.reading["measures"])
    study = Study(points, base.seeds, arrays, partial(measured, base.kind, base.measures))
    place = {point: n for n, point in enumerate(study.points)}
    order = [place[point] for point in points]
    return Sweep(base, study, order, rows, grids, drawn, against)


def measured(
    kind: str, wanted: Sequence[str], points: Sequence[Any], seeds: Sequence[int], outcome: Arrays
) -> Arrays:
    """Return the measures of a block, float64 (points, seeds)."""
    if kind == "runs":
        return finished.values_of(Run.of_lone_ant(outcome), wanted)
    (point,) = points
    arrays = {key: array[0] for key, array in outcome.items()}
    run, columns = Run.of_colony(arrays, point.ants, point.ticks), Arrays()
    for measure in (finished.of_runs(kind, name) for name in wanted):
        if measure.of == RUN:
            columns[measure.name] = measure.computed(run)
            continue
        for key in parts_of(f"{SERIES}{measure.name}", arrays):
            # The mean over rollouts with a value at their last ticks, float64 (seeds,).
            columns[key.removeprefix(SERIES)] = known_means(arrays[key][..., -1])
    return {name: array[None] for name, array in columns.items()}


def tables(sweep: Sweep, results: Results) -> str:
    """Return the report, after writing all tables and figures of the runs that are there.

    The value of a registered measure is its mean over rollouts, at the last tick of each.
    """
    present = results.present[sweep.order]
    some, folder = np.flatnonzero(present.any(axis=1)), results.folder
    if not len(some):
        raise AntsError("no runs are finished; wait for the first ones.")
    settings, present = [sweep.settings[n] for n in some], present[some]
    arrays = results.read(results.study.keys, arrays=sweep.base.measures)
    values = {name: array[np.array(sweep.order)[some]] for name, array in arrays.items()}
    p, s = np.nonzero(present)
    runs = {name: column[p] for name, column in tables_of.table_of(settings).items()}
    runs["seed"] = tables_of.column(sweep.study.seeds)[s]
    runs |= {name: array[p, s].astype(float) for name, array in values.items()}
    tables_of.write(folder / "runs.csv", runs, results.parquet)
    gaps = [name for name, array in values.items() if np.isnan(array).any()]
    with_iqm = [name for name in values if finished.of_runs(sweep.base.kind, name).uses_iqm]
    centres = sweeps.centres_of(values, with_iqm)
    rows = [
        {**row, "seeds": int(seeds), **sweeps.centre_columns(centre, gaps)}
        for row, seeds, centre in zip(settings, present.sum(axis=1), centres, strict=True)
    ]
    tables_of.write(folder / "summary.csv", tables_of.table_of(rows), results.parquet)
    if "measure_every" in sweep.base.reading:
        tables_of.write(folder / "series.csv", _series(sweep, results), results.parquet)
    if results.part:
        return sweeps.report(settings, values)

    first = next(iter(values))
    findings, order, title = sweep.findings(values[first]), list(range(len(settings))), ""
    if sweep.against:
        more = ["finding", "difference", "low", "high", *["left_out"] * (first in gaps)]
        columns = [*sweeps.columns_of(sweep.settings), *more]
        files.write_csv(folder / "findings.csv", findings.values(), columns)
    if sweep.design.design != "grid":  # nan comes last
        order = np.argsort(-known_means(values[first]), kind="stable")[:_SHOWN_POINTS].tolist()
        title = f"The {len(order)} of {len(settings)} points with the highest {first}:\n\n"
    highest = {name: array[order] for name, array in values.items()}
    notes = [findings.get(n, {}).get("finding", "") for n in order]
    report = sweeps.report([settings[n] for n in order], highest, sweep.against, notes)
    report = f"{title}{report}"
    if sweep.design.sensitivity:
        ((_, axes),), seeds = sweep.grids, len(sweep.study.seeds)
        names = varying(axes)
        indices = [row for name in values for row in sensitivity.indices(name, names, values[name])]
        report = f"{report}\n{sensitivity.report(indices, seeds)}"
        files.write_csv(folder / "sensitivity.csv", indices, sensitivity.COLUMNS)
    if results.figures:
        _draw(sweep, first, values[first], folder / "figures")
    return report


def _series(sweep: Sweep, results: Results) -> tables_of.Table:
    """Return the series of the registered measures, a row for each value."""
    parts, seeds = list[tables_of.Table](), tables_of.column(sweep.study.seeds)
    settings = tables_of.table_of(sweep.settings)
    for n, p in enumerate(sweep.order):
        point: Any = sweep.study.points[p]
        names, present = [f"{SERIES}{name}" for name in point.measures], results.present[p]
        arrays = results.read([results.study.keys[p]], arrays=names) if present.any() else {}
        ticks = np.array(list(stops(point.ticks, point.measure_every)))
        for name, array in arrays.items():
            values = array[0, present]
            s, episode, row = (index.ravel() for index in np.indices(values.shape))
            columns = {k: np.repeat(column[[n]], len(s)) for k, column in settings.items()}
            columns |= {"seed": seeds[present][s], "episode": episode, "tick": ticks[row]}
            columns["measure"] = np.full(len(s), name.removeprefix(SERIES), object)
            parts.append({**columns, "value": values.ravel()})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _draw(sweep: Sweep, measure: str, values: np.ndarray, folder: Path) -> None:
    """Draw a measure, float64 (rows, seeds), in a figure for each [vary] table."""
    label = finished.of_runs(sweep.base.kind, measure).label
    for number, (grid, axes) in enumerate(sweep.grids, start=1):
        path = folder / f"{measure}{f'-{number}' * (len(sweep.grids) > 1)}.png"
        if sweep.design.design == "grid":
            sweeps.draw(path, sweep.settings[grid], values[grid], label)
        else:
            names = varying(axes)
            sweeps.draw_design(path, sweep.settings[grid], names, values[grid], label)
