"""Run the lessons and keep what they show: `python docs/lessons/execute.py [NOTEBOOK ...]`.

Needs nbclient and ipykernel, which the extras `lessons` and `test` bring. Text is kept in the
notebooks. Pictures become files in `images/`, to which the notebooks refer, so that a change of a
notebook can be read; who runs a cell sees the own picture instead. A cell that draws has words for
those who do not see it in its metadata, as `alt`. Pages that play are not kept: they are large, and
web hosts do not show them.
"""

from __future__ import annotations

import base64
import io
import sys
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


def main(names: list[str]) -> None:
    """Run some notebooks, or all of them, and write them and their pictures anew."""
    import nbformat

    for path in map(Path, names or sorted(FOLDER.glob("*.ipynb"))):
        notebook, pictures = executed(path)
        (FOLDER / IMAGES).mkdir(exist_ok=True)
        for old in (FOLDER / IMAGES).glob(f"lesson-{path.stem[0]}-*.png"):
            old.unlink()
        for name, picture in pictures.items():
            (FOLDER / name).write_bytes(picture)
        nbformat.write(notebook, path)
        print(f"{path}: {path.stat().st_size // 1000} kB, {len(pictures)} pictures")


if __name__ == "__main__":
    main(sys.argv[1:])
