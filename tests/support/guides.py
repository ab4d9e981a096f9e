"""The code that pages of docs/ show."""

from __future__ import annotations

import re

from command_lines import ROOT

BLOCK = re.compile(r"^```(?P<language>\w*)\n(?P<code>.*?)^```$", re.M | re.S)


def section(page: str, heading: str = "") -> str:
    """The text of a page such as "how-to/worlds", or of one of its sections."""
    text = (ROOT / f"docs/{page}.md").read_text("utf-8")
    if not heading:
        return text
    prose = BLOCK.sub(lambda block: block[0].replace("#", "_"), text)  # comments are no headings
    start = re.search(rf"^(#+) {re.escape(heading)}\n", prose, re.M)
    end = re.compile(rf"^#{{1,{len(start[1])}}} |\Z", re.M).search(prose, start.end())
    return text[start.end() : end.start()]


def blocks(page: str, heading: str = "", language: str = "python") -> list[str]:
    """The blocks of code in a language of a page, or of one of its sections."""
    found = BLOCK.finditer(section(page, heading))
    return [block["code"] for block in found if block["language"] == language]
