"""A sweep over any settings of the world, the task, the learner or the colony, from a TOML file.

FILE names fixed settings, those that vary with their values, seeds, and what to measure. Every
combination is done with every seed; tables and a figure go to a folder. See docs/sweeps.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.studies.command_line import (
    AGAIN,
    Parser,
    add_common,
    add_results,
    load_plugin,
    progress_bar,
    run_command,
)

if TYPE_CHECKING:
    import numpy as np

    from taichi_ants.studies.runner import Outcome
    from taichi_ants.studies.sweep_file import Sweep

FIGURES, RUNS, SUMMARY, FINDINGS = "figures", "runs.csv", "summary.csv", "findings.csv"
_WORDS = {"supported": "more", "contradicted": "less", "equivalent": "equal"}


def parse_arguments(
    arguments: list[str] | None = None, file: Path | None = None, about: str | None = None
) -> argparse.Namespace:
    """Return the settings of the command line; a script `about` one sweep gives its file."""
    parser = Parser(about or __doc__)
    if file is None:
        parser.add_argument("file", type=Path, metavar="FILE", help="what to do (.toml)")
    parser.set_defaults(**({"file": file} if file else {}))
    add_common(parser)
    name = f"sweep-{file.stem}" if file else "sweep-NAME, by the name of FILE"
    add_results(parser, name, quick=False)
    settings = parser.parse_args(arguments)
    settings.out = settings.out or Path("results", f"sweep-{settings.file.stem}")
    return settings


def sweep(settings: argparse.Namespace) -> None:
    """Do the sweep, or show the finished one."""
    from taichi_ants.studies.result_folder import work_or_show
    from taichi_ants.studies.sweep_file import read_sweep

    load_plugin(settings.plugin)
    asked = read_sweep(settings.file, {kind: measures(kind) for kind in ("runs", "colony")})
    facts = {
        **asked.study.settings(),
        "measures": asked.measures,
        "vary": asked.settings,
        "against": asked.against,
        "margin": asked.margin,
    }
    work_or_show(settings, facts, partial(do_sweep, settings, asked))


def do_sweep(settings: argparse.Namespace, asked: Sweep, blocks: Path, ready: Path) -> None:
    """Do what is not done yet, and write all results."""
    from taichi_ants import files
    from taichi_ants.analysis import sweeps
    from taichi_ants.files.results import REPORT

    values = measured(asked, blocks, settings.threads, settings.arch)
    of_seeds = sweeps.seed_rows(asked.settings, asked.study.seeds, values)
    files.write_csv(ready / RUNS, of_seeds, [*sweeps.columns_of(asked.settings), "seed", *values])
    with_iqm = [name for name in values if measures(asked.kind)[name].uses_iqm]
    rows = sweeps.summary_rows(asked.settings, values, with_iqm)
    files.write_csv(ready / SUMMARY, rows, sweeps.columns_of(rows))
    found = findings(asked, values[asked.measures[0]])
    if asked.against:
        columns = [*sweeps.columns_of(asked.settings), "finding", "difference", "low", "high"]
        files.write_csv(ready / FINDINGS, found.values(), columns)
    notes = [found.get(p, {}).get("finding", "") for p in range(len(asked.settings))]
    files.write_text(ready / REPORT, sweeps.report(asked.settings, values, asked.against, notes))
    if not settings.no_figures:
        draw_figures(asked, values[asked.measures[0]], ready / FIGURES)


def findings(asked: Sweep, values: np.ndarray) -> dict[int, dict[str, Any]]:
    """Return by point how it differs from the one that is the same except for `against`.

    Intervals of the first measure, float64 (points, seeds), hold at once within a [vary].
    """
    from taichi_ants.analysis.findings import Contrast, above, judge

    if asked.against is None:
        return {}
    (name, value), found = asked.against, {}
    for some in asked.grids:
        rows, own = asked.settings[some], values[some]
        others = [{**row, name: value} for row in rows]
        pairs = [(p, rows.index(other)) for p, other in enumerate(others) if other in rows]
        pairs = [(p, other) for p, other in pairs if p != other]
        contrasts = [Contrast("", own[p] - own[other], above(asked.margin)) for p, other in pairs]
        for (p, _), one in zip(pairs, judge(contrasts), strict=True):
            said = _WORDS.get(one.verdict.value, "undecided")
            numbers = {"difference": one.effect, "low": one.low, "high": one.high}
            found[some.start + p] = {**rows[p], "finding": said, **numbers}
    return found


def draw_figures(asked: Sweep, values: np.ndarray, folder: Path) -> None:
    """Draw the first measure, float64 (points, seeds), a figure for each [vary]."""
    from taichi_ants import files
    from taichi_ants.analysis import sweeps

    name = asked.measures[0]
    files.check_writable_folder(folder)
    words = measures(asked.kind)[name].words
    label = f"{words[0].upper()}{words[1:]}"
    for number, some in enumerate(asked.grids, start=1):
        path = folder / (f"{name}.png" if len(asked.grids) == 1 else f"{name}-{number}.png")
        sweeps.draw(path, asked.settings[some], values[some], words, label)


def measures(kind: str) -> dict[str, Any]:
    """What can be measured, by name."""
    from taichi_ants.analysis.colony.study import MEASURES as OF_COLONIES
    from taichi_ants.analysis.paper.measures import MEASURES as OF_RUNS
    from taichi_ants.analysis.paper.measures import WINDOW

    if kind == "colony":
        usual = {"episodes": 0, "uses_iqm": False}
        return {n: argparse.Namespace(words=words, **usual) for n, words in OF_COLONIES.items()}
    # Where the comparison takes all episodes if there are fewer than the last 50, a sweep takes 50.
    least = {name: WINDOW if name.endswith("_last50") else 1 for name in OF_RUNS}
    return {n: replace(one, episodes=max(one.episodes, least[n])) for n, one in OF_RUNS.items()}


def measured(
    asked: Sweep, blocks: Path, threads: int | None, arch: str | None
) -> dict[str, np.ndarray]:
    """Return each measure of each point and seed, float64 (points, seeds)."""
    from taichi_ants.analysis.colony.study import measures_of
    from taichi_ants.analysis.paper.measures import measures_of_runs

    def reduce(points: Sequence[Any], seeds: Sequence[int], outcome: Outcome) -> Outcome:
        if asked.kind == "runs":
            return measures_of_runs(outcome, asked.measures)
        (point,) = points
        arrays = {key: array[0] for key, array in outcome.items()}
        found = measures_of(arrays, point.ants, point.ticks)
        return {name: found[name][None] for name in asked.measures}

    with progress_bar("sweep") as progress:
        return asked.study.reduced(blocks, reduce, threads, arch, progress)


def main(
    arguments: list[str] | None = None, file: Path | None = None, about: str | None = None
) -> None:
    """Run the command line; the arguments are those of `parse_arguments`."""
    run_command(lambda: sweep(parse_arguments(arguments, file, about)), AGAIN)
