"""The Python of the guides on models, rules, colonies and protocols works."""

from __future__ import annotations

import subprocess
import sys

import pytest
from command_lines import ROOT
from guides import blocks


@pytest.mark.slow  # colonies that learn, and rules that compile
@pytest.mark.parametrize("page", ["models", "how-to/models"])
def test_the_examples_of_a_guide_work(page, tmp_path):
    parts = blocks(page) if page == "models" else blocks(page)[:5]
    assert len(parts) > 2
    script = tmp_path / "guide.py"  # rules need a file
    script.write_text("\n\n".join(parts).replace("range(1000, 1100)", "range(1000, 1002)"), "utf-8")
    (tmp_path / "experiments").symlink_to(ROOT / "experiments")
    subprocess.run([sys.executable, str(script)], cwd=tmp_path, check=True, timeout=300)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "heading", "word"),
    [
        ("concepts/world_and_ants", "", "Food"),
        ("concepts/world_and_ants", "", "Caste"),
        ("how-to/measures", "Change a colony during a run", ""),
    ],
)
def test_other_examples_work(page, heading, word):
    parts = [block for block in blocks(page, heading) if word in block]
    assert parts
    exec("\n".join(parts), {})
