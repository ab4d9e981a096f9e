"""The frame of the scripts in this folder: options, a table, a figure and its numbers."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from taichi_ants import files
from taichi_ants.analysis import style
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.tables import Table
from taichi_ants.studies.command_line import Parser, run_command, whole_number

sys.path.append(str(Path(__file__).parents[1]))
import published

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Rows = list[dict[str, Any]]


class ScriptResults(NamedTuple):
    """The results of a script: the rows of its CSV file and of its table, and its figure.

    A row of the table has the condition of a seed, then measures. `draw` draws on the axes of the
    figure, which is `height` inches high, or on its array of panels, if it has several.
    """

    numbers: Rows
    summary: Rows
    title: str
    draw: Callable[[Any], object]
    caption: str = ""
    panels: tuple[int, int] = (1, 1)
    height: float = 3.5


def run(
    script: str, doc: str | None, measure: Callable[[list[int]], Sequence[Any]], seeds: int = 20
) -> None:
    """Run a script, the path of a file, with the options --seeds, --out and --publish.

    It writes NAME.csv and NAME.png, where NAME is that of the script, and prints a table of means
    over seeds with 95 % intervals. `measure` returns `ScriptResults` of a list of seeds.
    """
    name, parser = Path(script).stem, Parser(doc)
    parser.add_argument("--seeds", type=whole_number(1), default=seeds, help="number of seeds")
    parser.add_argument("--out", type=Path, default=Path("results") / name, help="output folder")
    add = "write table and figure to the docs"
    parser.add_argument("--publish", action="store_true", help=add)
    options = parser.parse_args()

    def main() -> None:
        folder = files.check_writable_file(options.out / f"{name}.csv").parent
        found = ScriptResults(*measure(list(range(options.seeds))))
        files.write_csv(folder / f"{name}.csv", found.numbers, list(found.numbers[0]))
        with style.styled():
            figure = style.new_figure(found.height)
            axes = figure.subplots(*found.panels, sharex=True, sharey=True)
            found.draw(axes)
            style.frame(figure, found.title, found.caption, style.legend_entries(np.ravel(axes)))
        picture = folder / f"{name}.png"
        style.save(figure, picture)
        published.show(name, [table(found.summary)], options.publish, picture)
        print(f"Numbers: {folder / name}.csv. Figure: {picture}.")

    run_command(main)


def table(rows: Rows) -> Table:
    """Return means with 95 % bootstrap intervals, a line for each value of the first column."""
    by, *names = rows[0]
    lines = []
    for condition in dict.fromkeys(row[by] for row in rows):
        values = np.array([[row[n] for n in names] for row in rows if row[by] == condition], float)
        means = [_shown(mean) for mean in values.mean(axis=0)]
        if len(values) > 1:
            ends = zip(*bootstrap_interval(values.T), strict=True)
            means = [
                f"{m} [{_shown(a)}, {_shown(b)}]" for m, (a, b) in zip(means, ends, strict=True)
            ]
        lines.append([str(condition), *means])
    return Table("", [by, *names], lines)


def _shown(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def band(axes: Axes, x: Sequence[float], values: np.ndarray, label: str, marker: str = "") -> None:
    """Draw the mean of values (seeds, x) as a line, with its 95 % interval as a band."""
    (line,) = axes.plot(x, values.mean(axis=0), label=style.label(label), marker=marker)
    if len(values) > 1:
        low, high = bootstrap_interval(values.T)
        axes.fill_between(x, low, high, color=line.get_color(), alpha=0.2, linewidth=0)
