"""The lessons in docs/lessons/: what they show is what they give when they are run afresh."""

from __future__ import annotations

import importlib.util
import io
import json
import re

import pytest
from command_lines import ROOT, environment
from PIL import Image

FOLDER = ROOT / "docs" / "lessons"
LESSONS = sorted(FOLDER.glob("*.ipynb"))
MOST = 50_000  # bytes
_REFERENCE = re.compile(r"!\[([^\]]+)\]\((images/[\w-]+\.png)\)")

each_lesson = pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)


def cells_of(path):
    """The cells of a notebook; each with its source as one text."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        cell["source"] = "".join(cell["source"])
    return cells


def shown(cells):
    """What code cells put out: texts, and references to pictures."""
    given = []
    for cell in cells:
        for output in cell.get("outputs", ()):
            data = output.get("data", {"text/plain": output.get("text")})
            given.append("".join(data.get("text/markdown", data["text/plain"])))
    return given


def executor():
    """The script that runs the lessons."""
    spec = importlib.util.spec_from_file_location("execute", FOLDER / "execute.py")
    execute = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(execute)
    return execute


@each_lesson
def test_it_was_run_from_top_to_bottom_and_holds_text_alone(path):
    assert path.stat().st_size < MOST
    codes = [cell for cell in cells_of(path) if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in codes] == list(range(1, len(codes) + 1))
    outputs = [output for cell in codes for output in cell["outputs"]]
    assert {output["output_type"] for output in outputs} <= {
        "stream",
        "display_data",
        "execute_result",
    }
    assert all(output.get("name", "stdout") == "stdout" for output in outputs)
    kinds = {kind for output in outputs for kind in output.get("data", ())}
    assert kinds == {"text/plain", "text/markdown"}


def test_pictures_lie_beside_the_notebooks():
    """Each where a notebook shows it, with words for those who do not see it, and no others."""
    references = [
        _REFERENCE.fullmatch(text)
        for path in LESSONS
        for text in shown(cells_of(path))
        if text.startswith("![")
    ]
    names = [reference[2] for reference in references]
    assert len(names) > 15
    lying = {f"images/{path.name}" for path in (FOLDER / "images").iterdir()}
    assert sorted(names) == sorted(lying)
    for words, name in (reference.groups() for reference in references):
        assert len(words) > 60
        with Image.open(FOLDER / name) as image:
            image.verify()
            assert image.format == "PNG"
            assert 800 < image.width <= 1280


@each_lesson
def test_questions_come_before_results_and_solutions_after_exercises(path):
    cells = cells_of(path)
    texts = [cell["source"] for cell in cells if cell["cell_type"] == "markdown"]
    asked = [text for text in texts if "**Question" in text]
    numbers = [int(n) for text in asked for n in re.findall(r"\*\*Question (\d+)\.\*\*", text)]
    assert numbers == list(range(1, len(numbers) + 1))
    for text in asked:
        assert texts[texts.index(text) + 1].startswith("*My ")
    (exercises,) = [text for text in texts if text.startswith("## Exercises")]
    place = texts.index("## Solutions")
    assert place == texts.index(exercises) + 1
    solved = [re.match(r"\*\*(\d+)\.\*\* ", text) for text in texts[place:]]
    wanted = re.findall(r"^(\d+)\. \*\*", exercises, re.MULTILINE)
    assert [match[1] for match in solved if match] == wanted
    (heading,) = [cell for cell in cells if cell["source"] == "## Solutions"]
    assert heading["metadata"]["jp-MarkdownHeadingCollapsed"]


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=pytest.mark.slow if path.stem[0] == "1" else pytest.mark.long)
        for path in LESSONS
    ],
    ids=lambda path: path.stem,
)
def test_run_afresh_it_says_the_same(path, kernels, monkeypatch):
    monkeypatch.delenv("MPLBACKEND", raising=False)  # commands that other tests call have set it
    for name, value in environment(kernels).items():
        monkeypatch.setenv(name, value)
    execute = executor()
    afresh, pictures = execute.executed(path)
    assert shown(afresh.cells) == shown(cells_of(path))
    for name, picture in pictures.items():
        sizes = [Image.open(file).size for file in (io.BytesIO(picture), FOLDER / name)]
        assert sizes[0] == sizes[1]
    assert execute.INSTEAD in shown(afresh.cells)
