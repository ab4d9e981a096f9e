"""The Python of docs/how-to/colonies.md works, and the documents name what the lessons use."""

from __future__ import annotations

import pytest
from guides import blocks


@pytest.mark.slow  # it trains Dyna-Q
def test_the_guides_example_works(capsys):
    [code] = blocks("how-to/colonies", "Analyse your own results")
    exec(compile(code, "colonies.md", "exec"), {})
    told = capsys.readouterr().out
    assert told.startswith("mean 357, with 95 % between 298 and 412\n")
    assert "seed 2: walks the trail, return 476\n" in told
    assert told.endswith("at best 80.7, for which an ant delivers 0 times\n")
