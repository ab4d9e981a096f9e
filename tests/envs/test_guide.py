"""The Python of docs/how-to/train_an_agent.md works; its numbers are the package's."""

from __future__ import annotations

import pytest
from guides import blocks


@pytest.mark.slow
def test_the_guides_examples_work(capsys):
    names: dict = {}
    code = "\n".join(blocks("how-to/train_an_agent")[:7])
    exec(compile(code, "train_an_agent.md", "exec"), names)
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
@pytest.mark.parametrize(
    ("page", "heading"), [("offline", ""), ("train_an_agent", "Use the example agents")]
)
def test_the_first_block_needs_nothing_else(page, heading, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(blocks(f"how-to/{page}", heading)[0], f"{page}.md", "exec"), {})
