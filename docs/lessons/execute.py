"""Run the lessons and keep what they show: `python docs/lessons/execute.py [NOTEBOOK ...]`.

Needs nbclient and ipykernel, which the extras `lessons` and `test` bring. Figures and text are kept
in the notebooks. Pages that play are not: they are large, and GitHub does not show them.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
INSTEAD = "(When you run this cell, a page that plays appears here.)"
_SECONDS = 300  # a cell may take


def executed(path: Path) -> Any:
    """The notebook of a file, run from top to bottom; each page is replaced by a line of text.

    Raises:
        nbclient.exceptions.CellExecutionError: A cell has failed.
    """
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook,
        timeout=_SECONDS,
        kernel_name="python3",
        record_timing=False,
        coalesce_streams=True,
        resources={"metadata": {"path": str(path.parent)}},
    ).execute()
    notebook.metadata["language_info"] = {"name": "python"}  # without the version of this Python
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            if "text/html" in output.get("data", {}):
                output["data"] = {"text/plain": INSTEAD}
    return notebook


def main(names: list[str]) -> None:
    """Run some notebooks, or all of them, and write them anew."""
    import nbformat

    for path in map(Path, names or sorted(FOLDER.glob("*.ipynb"))):
        nbformat.write(executed(path), path)
        print(f"{path}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
