"""The Python of docs/analysis.md works, and the documents name what the lessons use."""

from __future__ import annotations

import pytest
from command_lines import ROOT


@pytest.mark.slow  # it trains Dyna-Q
def test_the_guides_example_works(capsys):
    guide = (ROOT / "docs" / "analysis.md").read_text("utf-8")
    [code] = [part.split("```")[0] for part in guide.split("```python\n")[1:]]
    exec(compile(code, "analysis.md", "exec"), {})
    told = capsys.readouterr().out
    assert told.startswith("mean 357, with 95 % between 298 and 412\n")
    assert "seed 2: walks the trail, return 476\n" in told
    assert told.endswith("at best 80.7, for which an ant delivers 0 times\n")
