"""The Python of docs/analysis.md works, and the documents name what the lessons use."""

from __future__ import annotations

import ast
import json
import re

import pytest
from command_lines import ROOT

DOCUMENTS = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
LESSONS = sorted((ROOT / "docs" / "lessons").glob("*.ipynb"))


@pytest.mark.slow  # it trains Dyna-Q
def test_the_guides_example_works(capsys):
    guide = (ROOT / "docs" / "analysis.md").read_text("utf-8")
    [code] = [part.split("```")[0] for part in guide.split("```python\n")[1:]]
    exec(compile(code, "analysis.md", "exec"), {})
    told = capsys.readouterr().out
    assert told.startswith("mean 357, with 95 % between 298 and 412\n")
    assert "seed 2: walks the trail, return 476\n" in told
    assert told.endswith("at best 80.7, for which an ant delivers 0 times\n")


def names_used(path):
    """The names of this project that a lesson imports."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = "\n".join("".join(one["source"]) for one in cells if one["cell_type"] == "code")
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("taichi_ants"):
            yield from (alias.name for alias in node.names)


def test_what_lessons_use_is_documented():
    code = "\n".join(
        part
        for path in DOCUMENTS
        for part in re.findall(r"```.*?```|`[^`]+`", path.read_text("utf-8"), re.DOTALL)
    )
    used = {name for path in LESSONS for name in names_used(path)}
    assert {"EpisodeBounds", "classify"} <= used
    assert {name for name in used if not re.search(rf"\b{name}\b", code)} == set()
