"""The frame of the scripts in `experiments/models`: options, a table, a figure and its numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from taichi_ants import files
from taichi_ants.analysis import style
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.studies.command_line import Parser, run_command, whole_number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Row = dict[str, Any]


class Results(NamedTuple):
    """The results of a script.

    Attributes:
        numbers: The rows of the CSV file, the numbers of the figure.
        summary: The rows of the table, one for each seed and condition: the column of the
            condition, then measures.
        title: The title of the figure.
        draw: A function that draws the figure into axes.
    """

    numbers: list[Row]
    summary: list[Row]
    title: str
    draw: Callable[[Axes], object]


def run(
    script: str,
    doc: str | None,
    measure: Callable[[list[int]], Results],
    arguments: Sequence[str] | None = None,
) -> None:
    """Run a script with the options --seeds and --out.

    It writes NAME.csv and NAME.png, where NAME is that of the script, and prints a table of means
    over seeds with 95 % intervals.

    Args:
        script: The path of the script, `__file__`.
        doc: Its docstring, which the option --help prints.
        measure: A function of the seeds that returns the results.
        arguments: The command line; None for that of the process.
    """
    name = Path(script).stem
    parser = Parser(doc)
    parser.add_argument("--seeds", type=whole_number(1), default=20, help="number of seeds")
    parser.add_argument("--out", type=Path, default=Path("results") / name, help="output folder")
    options = parser.parse_args(arguments)

    def main() -> None:
        folder = files.check_writable_folder(options.out)
        results = measure(list(range(options.seeds)))
        files.write_csv(folder / f"{name}.csv", results.numbers, list(results.numbers[0]))
        print(table(results.summary))
        with style.styled():
            figure = style.new_figure(3.5)
            axes = figure.subplots()
            results.draw(axes)
            style.frame(figure, results.title, "", style.legend_entries([axes]))
        style.save(figure, folder / f"{name}.png")
        print(f"\nNumbers: {folder / name}.csv. Figure: {folder / name}.png.")

    run_command(main)


def table(rows: Sequence[Row]) -> str:
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
