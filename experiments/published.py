"""Fill the numbers and tables of README.md and docs/ from docs/results/data.

A command with the option --publish writes its tables there, as NAME.json, and fills the pages. This
script only fills the pages, for example after you wrote a sentence that quotes a number. A page has
a table between the lines `<!-- NAME -->` and `<!-- /NAME -->`. A sentence quotes a cell between
`<!--n NAME; ROW; COLUMN-->` and `<!--/n-->`: ROW is the text of a cell of that row, or of several,
with ";" between them. Without the "!" that may follow COLUMN, the interval is left out.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import json
    import re
    import shutil
    from collections.abc import Sequence
    from dataclasses import asdict
    from pathlib import Path

    import numpy as np
    import numpy.typing as npt

    from taichi_ants.analysis.statistics import bootstrap_interval
    from taichi_ants.analysis.tables import Table, interval, number, plain_text
    from taichi_ants.errors import AntsError
    from taichi_ants.files import read_text, to_json, write_text
    from taichi_ants.studies.command_line import Parser, run_command

ROOT = Path(__file__).resolve().parents[1]
FIGURES = ROOT / "docs" / "figures"
_TABLE = re.compile(r"(<!-- (\w+) -->\n).*?(<!-- /\2 -->)", re.DOTALL)
_NUMBER = re.compile(r"(<!--n ([^>]+?)-->)[^<]*(<!--/n-->)")


def mean(values: npt.ArrayLike, digits: int = 0) -> str:
    """Return a mean over seeds with its 95 % interval as text."""
    over = np.asarray(values, float)
    (low,), (high,) = bootstrap_interval(over[None])
    return f"{number(over.mean(), digits)} {interval(low, high, digits)}"


def data_file(name: str) -> Path:
    """Return the file with the tables of this name."""
    return ROOT / "docs" / "results" / "data" / f"{name}.json"


def write(path: Path, tables: Sequence[Table]) -> None:
    """Write tables to a file, a row of a table on each line."""
    parts = []
    for table in tables:
        head = asdict(table)
        rows = ",\n".join(f" {to_json(row)}" for row in head.pop("rows"))
        parts.append(f'{to_json(head)[:-1]}, "rows": [\n{rows}\n]}}')
    write_text(path, "[" + ",\n".join(parts) + "]\n")


def fill() -> None:
    """Write the published tables and numbers into all pages, or into none if one is unclear."""
    for page, text in [(page, filled(read_text(page))) for page in pages()]:
        write_text(page, text)


def show(name: str, tables: Sequence[Table], publishes: bool, figure: Path | None = None) -> None:
    """Print tables; if asked to, write them and a figure to the docs, and fill the pages."""
    print(plain_text(tables, 120), end="")
    if publishes:
        write(data_file(name), tables)
        if figure is not None:
            shutil.copyfile(figure, FIGURES / figure.name)
        fill()


def pages() -> list[Path]:
    """Return the pages that have tables or numbers."""
    every = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in every if re.search(r"<!-- /\w+ -->|<!--/n-->", read_text(page))]


def tables(name: str) -> list[Table]:
    """Return the published tables of a name; AntsError if there are none."""
    return [Table(**table) for table in json.loads(read_text(data_file(name)))]


def filled(text: str) -> str:
    """Return the text of a page with published tables and numbers; AntsError if one is unclear."""

    def table(mark: re.Match[str]) -> str:
        found = "\n".join(table.markdown() for table in tables(mark[2]))
        return f"{mark[1]}\n{found}\n{mark[3]}"

    return _NUMBER.sub(lambda mark: mark[1] + cell(mark[2]) + mark[3], _TABLE.sub(table, text))


def cell(place: str) -> str:
    """Return the cell at "NAME; ROW; COLUMN", without its interval if no "!" follows."""
    name, *row, column = (part.strip() for part in place.rstrip("!").split(";"))
    found = [
        cells[columns.index(column)]
        for table in tables(name)
        if column in (columns := [" ".join(words.split()) for words in table.columns])
        for cells in table.rows
        if all(part in cells for part in row)
    ]
    if len(found) != 1:
        raise AntsError(
            f"a page quotes {place!r}, but {len(found)} cells are there; change the page and run "
            "experiments/published.py, or restore docs/results/data with git."
        )
    text = " ".join(found[0].split())
    return text if place.endswith("!") else re.split(r" [\[(]", text)[0]


if __name__ == "__main__":
    parser = Parser(__doc__)
    parser.parse_args()
    run_command(fill)
