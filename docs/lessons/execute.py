"""Run the lessons and save their results, or write an edition for a class.

    python docs/lessons/execute.py [NOTEBOOK ...]
    python docs/lessons/execute.py --class-edition FOLDER [NOTEBOOK ...]

Needs nbclient and ipykernel, which the extras `lessons` and `test` install. Text is saved in the
notebooks. Pictures become files in `images/`, to which the notebooks refer, so that changes of a
notebook can be reviewed; if you run a cell, you see your own picture instead. A cell that draws has
a description of its picture in its metadata, as `alt`. Pages that play are not saved: they are
large, and web hosts do not show them.

An edition for a class has neither results nor solutions.
"""

from __future__ import annotations

import argparse
import base64
import io
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
IMAGES = "images"
INSTEAD = "(When you run this cell, a page that plays appears here.)"
_SECONDS = 300  # a cell may take


def executed(path: Path) -> tuple[Any, dict[str, bytes]]:
    """The notebook of a file, run from top to bottom, and its pictures as PNG, by their names.

    In the notebook each picture is replaced by a reference, each page by a line of text.

    Raises:
        nbclient.exceptions.CellExecutionError: A cell has failed.
        KeyError: A cell that draws has no `alt`.
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
    pictures = {}
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "text/html" in data:
                output["data"] = {"text/plain": INSTEAD}
            elif "image/png" in data:
                name = f"{IMAGES}/lesson-{path.stem[0]}-{cell.id}.png"
                pictures[name] = packed(base64.b64decode(data["image/png"]))
                shown = f"![{cell.metadata['alt']}]({name})"
                output["data"] = {"text/markdown": shown, "text/plain": name}
                output["metadata"] = {}
    return notebook, pictures


def packed(picture: bytes) -> bytes:
    """A PNG in 256 colours, a quarter as large."""
    from PIL import Image

    file = io.BytesIO()
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    image.quantize(256, Image.Quantize.MAXCOVERAGE).save(file, "png", optimize=True)
    return file.getvalue()


def without_solutions(path: Path) -> Any:
    """Return the notebook of a file without results, and without its section of solutions.

    Raises:
        ValueError: The notebook has no section "## Solutions".
    """
    import nbformat

    notebook = nbformat.read(path, as_version=4)
    first = [cell.source.strip() for cell in notebook.cells].index("## Solutions")
    notebook.cells = notebook.cells[:first]
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    return notebook


def main(arguments: list[str] | None = None) -> None:
    """Run some notebooks, or all of them, and save their results; or write them for a class."""
    import nbformat

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "notebooks", nargs="*", type=Path, metavar="NOTEBOOK", help="(default: all)"
    )
    parser.add_argument(
        "--class-edition",
        type=Path,
        metavar="FOLDER",
        help="write the notebooks there without results and solutions; run none",
    )
    settings = parser.parse_args(arguments)
    paths, folder = settings.notebooks or sorted(FOLDER.glob("*.ipynb")), settings.class_edition
    if folder is not None and folder.resolve() in {path.parent.resolve() for path in paths}:
        parser.error(f"--class-edition {folder} would replace the lessons; choose another folder.")
    for path in paths:
        if folder is None:
            _save(path, *executed(path))
        else:
            folder.mkdir(parents=True, exist_ok=True)
            nbformat.write(without_solutions(path), folder / path.name)
            print(folder / path.name)


def _save(path: Path, notebook: Any, pictures: dict[str, bytes]) -> None:
    import nbformat

    (FOLDER / IMAGES).mkdir(exist_ok=True)
    for old in (FOLDER / IMAGES).glob(f"lesson-{path.stem[0]}-*.png"):
        old.unlink()
    for name, picture in pictures.items():
        (FOLDER / name).write_bytes(picture)
    nbformat.write(notebook, path)
    print(f"{path}: {path.stat().st_size // 1000} kB, {len(pictures)} pictures")


if __name__ == "__main__":
    main()
