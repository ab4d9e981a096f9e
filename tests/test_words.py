"""The project's words: one term for each thing, and no text that only its authors understand."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from command_lines import ROOT

README_LINES = 120

# What a machine judges well: spelling, and names that we gave up. Each with what to write instead.
TERMS = {
    r"\bpolic(y|ies) (written )?by hand|\bhand-written rule": "hand-written policy",
    r"\bcombinations? of settings\b": "configuration",
    r"\bfoods\b": "food items",
    r"\blures?\b": "cue",
    r"\bQ-Learning\b|\bSarsa\b|\bDyna Q\b|\bDynaQ\b": "Q-learning, SARSA, Dyna-Q",
    r"\b(behavior|neighbor(?!s\.html)|favor)": "British spelling",
    r"(?<![\w.])/(home|root|tmp|work|mnt)/": "no paths of a machine",
    r"\b[Ii]ssue #?\d": "no numbers of issues",
}
_ANY = re.compile("|".join(f"(?:{pattern})" for pattern in TERMS))
_CODE = re.compile(r"```.*?```|<!--.*?-->", re.DOTALL)
_INLINE = re.compile(r"`[^`]*`|https?://\S+|\$[^$]+\$")
_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")


class Text(NamedTuple):
    """Words with the place where they are."""

    place: str
    text: str


def plain(text: str) -> str:
    """Without code, links and emphasis."""
    text = _INLINE.sub("`x`", _LINK.sub(r"\1", text))
    return " ".join(text.replace("*", "").replace("_ci_", " ").split())


def paragraphs_of_markdown(place: str, text: str) -> Iterator[Text]:
    """Paragraphs, items of lists, and cells of tables; no code and no headings."""
    for block in re.split(r"\n\s*\n", _CODE.sub("\n\n", text)):
        lines = block.splitlines()
        if any(line.lstrip().startswith("|") for line in lines):
            for line in lines:
                for cell in re.split(r"(?<!\\)\|", line):
                    yield Text(place, plain(cell))
            continue
        for item in re.split(r"\n\s*(?:[-*]|\d+\.)\s", "\n" + block):
            if not re.match(r"\s*(#|\*\*[^*]+\*\*\s*$)", item):  # a heading
                yield Text(place, plain(item))


def documents() -> Iterator[Text]:
    for path in (ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))):
        yield from paragraphs_of_markdown(str(path.relative_to(ROOT)), path.read_text("utf-8"))
    for path in sorted((ROOT / "docs" / "lessons").glob("*.ipynb")):
        for number, cell in enumerate(json.loads(path.read_text("utf-8"))["cells"]):
            if cell["cell_type"] == "markdown":
                place = f"{path.name}, cell {number}"
                yield from paragraphs_of_markdown(place, "".join(cell["source"]))


def python_files() -> list[Path]:
    """The modules that users run, import or read."""
    folders = ("taichi_ants", "experiments", "examples", "benchmarks")
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def docstrings(path: Path, nodes: list[ast.AST]) -> Iterator[Text]:
    """Paragraphs and items of docstrings, without code and names of items."""
    item = r"\n(?=[ ]{4}[`*\w][\w.`*, ]*: )|\n\s*(?:-|\d+\.)\s"
    for node in nodes:
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            text, place = ast.get_docstring(node) or "", getattr(node, "name", "")
            text = re.sub(r"::\n\n(?:[ ]{4,}.*\n?)+", "\n\n", text)
            for block in re.split(r"\n\s*\n", text):
                block = re.sub(r"^(Args|Attributes|Raises|Returns):\s*", "\n", block)
                for one in re.split(item, block):
                    words = plain(re.sub(r"^\s*[`*\w][\w.`*, ]*: ", "", one))
                    yield Text(f"{path.relative_to(ROOT)}:{place}", words)


def messages(path: Path, nodes: list[ast.AST]) -> Iterator[Text]:
    """The text of errors, of help and of settings: strings of two words or more in calls."""
    named = ("AntsError", "Setting", "add_argument", "add_parser", "Parser", "MissingPackage")
    for node in nodes:
        if not isinstance(node, ast.Call):
            continue
        called = (
            node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        )
        if called in named:
            for value in (*node.args, *(one.value for one in node.keywords)):
                text = "".join(_literal(value))
                if " " in text.strip():
                    yield Text(f"{path.relative_to(ROOT)}:{node.lineno}", plain(text))


def _literal(node: ast.AST) -> Iterator[str]:
    """The text of a string or an f-string, its values as `x`."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.JoinedStr):
        for part in node.values:
            yield part.value if isinstance(part, ast.Constant) else "`x`"


def faults(texts: Iterator[Text]) -> list[str]:
    """Terms of which we write another, with their place and what to write."""
    return [
        f"{place}: write {advice}: {text}"
        for place, text in texts
        if _ANY.search(text)
        for pattern, advice in TERMS.items()
        if re.search(pattern, text)
    ]


def test_documents_use_the_terms():
    found = faults(documents())
    assert not found, "\n".join(found)


def test_docstrings_and_messages_use_the_terms():
    found = []
    for path in python_files():
        nodes = list(ast.walk(ast.parse(path.read_text("utf-8"))))
        found += faults(docstrings(path, nodes)) + faults(messages(path, nodes))
    assert not found, "\n".join(found)


def test_readme_is_short():
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= README_LINES
