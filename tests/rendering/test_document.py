"""The examples of `docs/how-to/pictures.md` run, each on its own, and write what they say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PIL import Image

DOCUMENT = Path(__file__).parents[2] / "docs/how-to/pictures.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)
WRITTEN = ["learns.html", "crowd.html", "ant.gif", "start.png", "colony.gif"]


def test_there_is_an_example_for_each_file() -> None:
    assert len(EXAMPLES) == len(WRITTEN)


@pytest.mark.slow
@pytest.mark.parametrize(("example", "name"), list(zip(EXAMPLES, WRITTEN, strict=False)))
def test_examples_run_on_their_own(example, name, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(example, str(DOCUMENT), "exec"), {})
    assert [path.name for path in tmp_path.iterdir()] == [name]
    if name.endswith(".html"):
        assert (tmp_path / name).read_text(encoding="utf-8").startswith("<!doctype html>")
        return
    with Image.open(tmp_path / name) as image:
        assert (getattr(image, "n_frames", 1) > 1) == name.endswith(".gif")
