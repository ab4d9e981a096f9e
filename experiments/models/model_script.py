"""The frame of the scripts in this folder: options, a table, a figure and its numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants import files
from taichi_ants.analysis import style
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.studies.command_line import Parser, run_command, whole_number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Rows = list[dict[str, Any]]
# The rows of the CSV file, the numbers of the figure; the rows of the table, one for each seed and
# condition: the column of the condition, then measures; the title of the figure; what draws it.
Results = tuple[Rows, Rows, str, Callable[["Axes"], object]]


def run(script: str, doc: str | None, measure: Callable[[list[int]], Results]) -> None:
    """Run a script, the path of a file, with the options --seeds and --out.

    It writes NAME.csv and NAME.png, where NAME is that of the script, and prints a table of means
    over seeds with 95 % intervals. `measure` is a function of the seeds.
    """
    name, parser = Path(script).stem, Parser(doc)
    parser.add_argument("--seeds", type=whole_number(1), default=20, help="number of seeds")
    parser.add_argument("--out", type=Path, default=Path("results") / name, help="output folder")
    options = parser.parse_args()

    def main() -> None:
        folder = files.check_writable_file(options.out / f"{name}.csv").parent
        numbers, summary, title, draw = measure(list(range(options.seeds)))
        files.write_csv(folder / f"{name}.csv", numbers, list(numbers[0]))
        print(table(summary))
        with style.styled():
            figure = style.new_figure(3.5)
            axes = figure.subplots()
            draw(axes)
            style.frame(figure, title, "", style.legend_entries([axes]))
        style.save(figure, folder / f"{name}.png")
        print(f"\nNumbers: {folder / name}.csv. Figure: {folder / name}.png.")

    run_command(main)


def table(rows: Rows) -> str:
    """Return means with 95 % bootstrap intervals, a line for each value of the first column."""
    by, *names = rows[0]
    lines = [[by, *names]]
    for condition in dict.fromkeys(row[by] for row in rows):
        same = [row for row in rows if row[by] == condition]
        lines.append([str(condition), *(_interval([row[name] for row in same]) for name in names)])
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    padded = ["  ".join(map(str.ljust, line, widths)).rstrip() for line in lines]
    return "\n".join([padded[0], "-" * max(map(len, padded)), *padded[1:]])


def _interval(values: Sequence[float]) -> str:
    array = np.array([values], float)
    if array.shape[1] < 2:
        return f"{array.mean():.4g}"
    low, high = bootstrap_interval(array)
    return f"{array.mean():.4g} [{low[0]:.4g}, {high[0]:.4g}]"


def band(axes: Axes, x: np.ndarray, values: np.ndarray, label: str) -> None:
    """Draw the mean of values (seeds, x) as a line, with its 95 % interval as a band."""
    (line,) = axes.plot(x, values.mean(axis=0), label=style.label(label))
    if len(values) > 1:
        low, high = bootstrap_interval(values.T)
        axes.fill_between(x, low, high, color=line.get_color(), alpha=0.2, linewidth=0)
