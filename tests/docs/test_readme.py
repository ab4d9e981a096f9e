"""The README: its code, its numbers, its links and its pictures."""

from __future__ import annotations

import re

from command_lines import ROOT

README = (ROOT / "README.md").read_text("utf-8")
WORDS = " ".join(README.split())


def test_the_ten_lines_print_their_number(capsys):
    code, other = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    [promised] = re.findall(r"print\(.*\)  # (\d+) food items delivered\n", code)
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out == f"{promised}\n"
    exec(compile(code.replace("queueing", "paper"), "README.md", "exec"), {})
    assert f"in the same world, {capsys.readouterr().out.strip()}." in WORDS
    exec(compile(other, "README.md", "exec"), {})


def anchors(text: str) -> set[str]:
    """The anchors of the headings of a page."""
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_links_and_pictures_are_there():
    links = re.findall(r"\]\((?!https?:)([^)#]*)(?:#([^)]*))?\)", README)
    assert len(links) > 15
    for path, anchor in links:
        assert (ROOT / path).exists(), path
        assert not anchor or anchor in anchors((ROOT / path).read_text("utf-8")), anchor
    pictures = re.findall(r'src(?:set)?="([^"]+)"', README)
    assert len(pictures) == 8
    for path in pictures:
        assert (ROOT / path).stat().st_size < 3_000_000, path
    alts = re.findall(r"<img [^>]*alt=\"([^\"]+)\"", README)
    assert len(alts) == README.count("<img ") == README.count("<picture>") == 4
