"""Run the lessons and save their results, or write editions for students and teachers.

    python docs/lessons/execute.py [NOTEBOOK ...]
    python docs/lessons/execute.py --editions FOLDER [NOTEBOOK ...]

Needs nbclient and ipykernel, which the extras `lessons` and `test` install. Text is saved in the
notebooks. Pictures become files in `images/`, to which the notebooks refer, so that changes of a
notebook can be reviewed; if you run a cell, you see your own picture instead. A cell that draws has
a description of its picture in its metadata, as `alt`. Pages that play are not saved: they are
large, and web hosts do not show them.

The edition for students has no results, and its answers are folded. The edition for teachers has
all results, its answers are open, and it has notes, which are saved in the metadata of questions as
`teachers`. Both editions are also a page, docs/lessons.html, which lab/build.py makes from the
notebooks (see page/text.py).
"""

from __future__ import annotations

import argparse
import base64
import io
import re
import shutil
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
IMAGES = "images"
SOLUTIONS = "## Solutions"
YOURS = "# your turn"
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


def for_students(path: Path) -> Any:
    """Return the notebook of a file without results, with folded solutions and parts to write.

    In a cell with the tag `yours`, students write what follows `# your turn`; the saved lines are
    a folded answer below it. The code of solutions is folded too.

    Raises:
        ValueError: The notebook has no section "## Solutions", or a cell no line `# your turn`.
    """
    import nbformat

    notebook = nbformat.read(path, as_version=4)
    first = [cell.source.strip() for cell in notebook.cells].index(SOLUTIONS)
    cells = []
    for cell in notebook.cells[:first]:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
        cells.append(cell)
        cell.metadata.pop("teachers", None)
        if "yours" in cell.metadata.get("tags", ()):
            answer = folded("Answer", [cell])
            start = cell.source.index(YOURS) + len(YOURS)
            indent = cell.source[:start].rpartition("\n")[2].removesuffix(YOURS)
            cell.source = f"{cell.source[:start]}\n{indent}raise NotImplementedError"
            cells.append(nbformat.v4.new_markdown_cell(answer, id=f"{cell.id}-answer"))
    cells.append(notebook.cells[first])
    solutions: list[list[Any]] = []
    for cell in notebook.cells[first + 1 :]:
        if cell.cell_type == "markdown":
            solutions.append([])
        solutions[-1].append(cell)
    for number, parts in enumerate(solutions, start=1):
        answer = folded(f"Solution {number}", parts)
        cells.append(nbformat.v4.new_markdown_cell(answer, id=parts[0].id))
    notebook.cells = cells
    return notebook


def folded(title: str, cells: list[Any]) -> str:
    """Markdown that shows cells when a reader asks for them."""
    texts = [
        cell.source if cell.cell_type == "markdown" else f"```python\n{cell.source}\n```"
        for cell in cells
    ]
    return "\n\n".join([f"<details>\n<summary><b>{title}</b></summary>", *texts, "</details>"])


def for_teachers(path: Path) -> Any:
    """Return the notebook of a file with its results and notes, and with all answers open."""
    import nbformat

    notebook = nbformat.read(path, as_version=4)
    cells = []
    for cell in notebook.cells:
        cell.source = cell.source.replace("<details>", "<details open>")
        cell.metadata.pop("jp-MarkdownHeadingCollapsed", None)
        cells.append(cell)
        if note := cell.metadata.pop("teachers", None):
            note = f"> **For teachers.** {note}"
            cells.append(nbformat.v4.new_markdown_cell(note, id=f"{cell.id}-note"))
    notebook.cells = cells
    return notebook


def write_editions(path: Path, folder: Path) -> None:
    """Write both editions of a lesson, and the pages and pictures to which they refer."""
    import nbformat

    for edition, notebook in (("students", for_students(path)), ("teachers", for_teachers(path))):
        (folder / edition).mkdir(parents=True, exist_ok=True)
        nbformat.write(notebook, folder / edition / path.name)
        print(folder / edition / path.name)
    for page in set(re.findall(r"\]\(\.\./([\w./-]+)", path.read_text(encoding="utf-8"))):
        (folder / page).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(FOLDER.parent / page, folder / page)  # the lab, for example
    (folder / "teachers" / IMAGES).mkdir(exist_ok=True)
    for picture in (path.parent / IMAGES).glob(f"lesson-{path.stem[0]}-*.png"):
        shutil.copy(picture, folder / "teachers" / IMAGES)


def main(arguments: list[str] | None = None) -> None:
    """Run some lessons, or all of them, and save their results; or write their editions."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "notebooks", nargs="*", type=Path, metavar="NOTEBOOK", help="(default: all)"
    )
    parser.add_argument(
        "--editions",
        type=Path,
        metavar="FOLDER",
        help="write the editions for students and teachers there; run none",
    )
    settings = parser.parse_args(arguments)
    for path in settings.notebooks or sorted(FOLDER.glob("*.ipynb")):
        if settings.editions is None:
            _save(path, *executed(path))
        else:
            write_editions(path, settings.editions)


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
