"""The lessons in docs/lessons/: what they show is what they give when they are run afresh."""

import importlib.util
import io
import json
import re

import pytest
from command_lines import ROOT, environment
from PIL import Image

FOLDER = ROOT / "docs" / "lessons"
LESSONS = sorted(FOLDER.glob("*.ipynb"))
SCENES = re.findall(r'^    id: "(\w+)"', (ROOT / "lab/page/scenes.js").read_text("utf-8"), re.M)
_REFERENCE = re.compile(r"!\[([^\]]+)\]\((images/[\w-]+\.png)\)")


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


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=pytest.mark.slow if path.stem[0] == "2" else pytest.mark.long)
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
    plays = [cell for cell in cells_of(path) if cell["source"].startswith("record_")]
    assert shown(afresh.cells).count(execute.INSTEAD) == len(plays)


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_both_editions_come_from_one_notebook(path, tmp_path):
    """Students get every question and no result; their answers are folded. Teachers get it all,
    and for each question a note."""
    executor().write_editions(path, tmp_path)
    students, teachers = (
        cells_of(tmp_path / edition / path.name) for edition in ("students", "teachers")
    )
    saved = cells_of(path)
    assert shown(saved)
    assert not shown(students)
    assert shown(teachers) == shown(saved)
    for name in _REFERENCE.findall("\n".join(shown(teachers))):
        assert (tmp_path / "teachers" / name[1]).is_file()

    def texts(cells):
        return "\n\n".join(cell["source"] for cell in cells)

    assert "<details>" not in texts(teachers)
    assert texts(teachers).count("> **For teachers.** ") == texts(saved).count("**Question")
    assert "teachers" not in json.dumps([cell["metadata"] for cell in students])
    start = texts(students).index("## Solutions")
    solutions = texts(students)[start:]
    for cell in saved[[cell["source"] for cell in saved].index("## Solutions") :]:
        assert cell["source"] in solutions
    assert solutions.count("<details>") == solutions.count("</details>") >= 3
    for cells in (saved, students):
        predictions = [cell for cell in cells if cell["source"].startswith("*My ")]
        assert texts(cells).count("**Question") == len(predictions) >= 5
        assert texts(cells).count("**In the lab.**") == 1
        scenes = re.findall(r"\]\(\.\./lab.html#?(\w*)\)", texts(cells))
        assert scenes
        assert {*scenes} <= {"", *SCENES}
    assert (tmp_path / "lab.html").is_file()
    for cell in saved:
        if "yours" in cell["metadata"].get("tags", ()):
            given, answer = cell["source"].split("# your turn\n")
            [to_write] = [one["source"] for one in students if one["source"].startswith(given)]
            assert answer not in to_write
            assert answer in texts(students)
            compile(to_write, path.name, "exec")
