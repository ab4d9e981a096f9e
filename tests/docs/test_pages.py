"""Every Python block of the pages runs, and prints what its page says.

The blocks of a page are one program, from top to bottom. A block after `<!-- not run: reason -->`
is left out. A comment behind a `print` begins with what it prints, if it begins with a value, and
so do the lines of a `text` block that follows.
"""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from command_lines import ROOT, environment

BLOCK = re.compile(r"^```(?P<language>\w*)\n(?P<code>.*?)^```$", re.M | re.S)
PAGES = {
    str(path.relative_to(ROOT)): text
    for path in sorted((ROOT / "docs").rglob("*.md"))  # test_readme.py runs the README's
    if "```python\n" in (text := path.read_text("utf-8"))
}


def program_and_lines(text: str) -> tuple[str, list[str]]:
    """The program of a page, and the lines that it prints according to the page."""
    parts, lines, runs = [], [], False
    for block in BLOCK.finditer(text):
        if block["language"] == "python":
            runs = "<!-- not run: " not in text[: block.start()].rpartition("\n\n")[2]
            if runs:
                parts.append(block["code"])
                lines += re.findall(r"^print\(.*\) +# ([-\d([{TF].*)$", block["code"], re.M)
        elif block["language"] == "text" and runs:
            lines += filter(None, block["code"].splitlines())
    return "\n\n".join(parts), lines


def test_at_most_thirty_pages_are_written_by_hand():
    """Apart from cards of models, lessons, the page of a broken link, and files of the root.

    A page is generated if most of it is.
    """
    by_hand = set()
    for page in (ROOT / "docs").rglob("*.md"):
        text = page.read_text("utf-8")
        own = re.sub(r"<!-- generated: .*?<!-- end -->", "", text, flags=re.S)
        is_generated = "api" in page.parts or len(own) < len(text) / 2 or own.startswith("```{incl")
        if not is_generated and not {"models", "lessons", "404.md"} & {*page.parts}:
            by_hand.add(page)
    assert 25 < len(by_hand) <= 30, by_hand


# Scripts of models have tests of their own, see tests/examples/.
MARKED = [
    pytest.param(page, marks=pytest.mark.long if "models/" in page else pytest.mark.slow)
    for page in PAGES
]


@pytest.mark.parametrize("page", MARKED)  # a process each, and some train
def test_the_program_of_a_page_prints_what_the_page_says(page, kernels, tmp_path):
    program, lines = program_and_lines(PAGES[page])
    script = tmp_path / "page.py"  # a file, because rules and learners are read from their source
    script.write_text(program, "utf-8")
    for folder in ("experiments", "examples"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    how = {"cwd": tmp_path, "env": environment(kernels), "capture_output": True, "text": True}
    done = subprocess.run([sys.executable, str(script)], timeout=300, check=False, **how)
    assert done.returncode == 0, done.stderr
    printed = iter(done.stdout.splitlines())
    for line in lines:  # in this order, with others between them
        begins = (one and re.match(rf"{re.escape(one)}(?![\w.])", line) for one in printed)
        assert any(begins), (line, done.stdout)
