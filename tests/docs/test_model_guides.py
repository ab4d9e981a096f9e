"""The Python of the guides on models, rules, colonies and protocols works."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from command_lines import ROOT


@pytest.mark.slow  # colonies that learn, and rules that compile
@pytest.mark.parametrize("page", ["models", "rules"])
def test_the_examples_of_a_guide_work(page, tmp_path):
    guide = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    parts = [part.split("```")[0] for part in guide.split("```python\n")[1:]]
    assert len(parts) > 2
    script = tmp_path / f"{page}.py"  # rules need a file
    script.write_text("\n\n".join(parts).replace("range(1000, 1100)", "range(1000, 1002)"), "utf-8")
    (tmp_path / "experiments").symlink_to(ROOT / "experiments")
    subprocess.run([sys.executable, str(script)], cwd=tmp_path, check=True, timeout=300)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "word"), [("colony", "Food"), ("colony", "Caste"), ("protocol", "")]
)
def test_other_examples_work(page, word):
    blocks = re.findall(
        r"```python\n(.*?)```", (ROOT / "docs" / f"{page}.md").read_text(), re.DOTALL
    )
    parts = [block for block in blocks if word in block]
    assert parts
    exec("\n".join(parts), {})
