"""Write the tables and figures of the runs that a folder of results has.

While a study runs, some runs are missing. Their rows are left out, and figures and comparisons wait
for the last run. The command reads only the folder, and can run at any time.
"""

import argparse
from pathlib import Path

from taichi_ants.studies import command_line


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("folder", type=Path, metavar="FOLDER", help="folder of results")
    add("--no-figures", action="store_true", help="skip figures")
    add("--parquet", action="store_true", help="write the tables as Parquet, too (extra parquet)")
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Write the tables, and print the report."""
    from taichi_ants.files import read_text
    from taichi_ants.studies.command import opened, write_tables
    from taichi_ants.studies.folder import REPORT
    from taichi_ants.studies.store import Store

    with opened(settings.folder) as planned:
        store = Store(settings.folder)
        missing = int(planned.study.missing(store).sum())
        options = not settings.no_figures, settings.parquet, missing > 0
        write_tables(settings.folder, planned, store, *options)
    print(read_text(settings.folder / REPORT))
    if missing:
        print(f"{missing} runs are missing; `taichi-ants status` shows how long they take.")
