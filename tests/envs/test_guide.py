"""The Python of docs/environments.md works, from top to bottom; its numbers are the package's."""

from __future__ import annotations

import pytest
from command_lines import ROOT


@pytest.mark.slow
def test_the_guides_examples_work(capsys):
    guide = (ROOT / "docs" / "environments.md").read_text("utf-8")
    code = "\n".join(part.split("```")[0] for part in guide.split("```python\n")[1:])
    names: dict = {}
    exec(compile(code, "environments.md", "exec"), names)
    assert capsys.readouterr().out.splitlines()[:5] == [
        "3 [1 1 1 0 0] 0",
        "0.9: return 45, 1 deliveries",
        "0.99: return 476, 0 deliveries",
        "0.9: return 13, 1 deliveries",
        "0.99: return 13, 1 deliveries",
    ]
    assert names["colony"].states.shape == (8, 64)
    assert names["env"].agents == []


@pytest.mark.slow
@pytest.mark.parametrize("page", ["offline", "examples"])
def test_the_first_block_of_a_page_needs_nothing_else(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    code = text.split("```python\n")[1].split("```")[0]
    exec(compile(code, f"{page}.md", "exec"), {})
