"""The lessons in docs/lessons/: what they show is what they give when they are run afresh."""

from __future__ import annotations

import importlib.util
import json
import re

import pytest
from command_lines import ROOT, environment

FOLDER = ROOT / "docs" / "lessons"
LESSONS = sorted(FOLDER.glob("*.ipynb"))
MOST = 600_000  # bytes

each_lesson = pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)


def cells_of(path):
    """The cells of a notebook; each with its source as one text."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        cell["source"] = "".join(cell["source"])
    return cells


def shown(cells):
    """What code cells put out: texts as they are, and of pictures that there is one."""
    given = []
    for cell in cells:
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            text = output["text"] if output["output_type"] == "stream" else data["text/plain"]
            is_picture = "image/png" in data
            # Which kind of object a picture is depends on who draws it.
            given.append("a picture" if is_picture else "".join(text))
    return given


def test_there_are_three():
    assert [path.name[0] for path in LESSONS] == ["1", "2", "3"]
    listed = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert all(f"({path.name})" in listed for path in LESSONS)


@each_lesson
def test_it_was_run_from_top_to_bottom_and_has_no_page_in_it(path):
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
    assert kinds == {"text/plain", "image/png"}


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


@pytest.mark.slow
@each_lesson
def test_run_afresh_it_says_the_same(path, kernels, monkeypatch):
    for name, value in environment(kernels).items():
        monkeypatch.setenv(name, value)
    spec = importlib.util.spec_from_file_location("execute", FOLDER / "execute.py")
    execute = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(execute)
    afresh = execute.executed(path)
    assert shown(afresh.cells) == shown(cells_of(path))
    assert execute.INSTEAD in shown(afresh.cells)
