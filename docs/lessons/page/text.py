"""The text of docs/lessons.html, from the notebooks in docs/lessons; lab/build.py calls `lessons`.

The notebooks are the only source of the lessons. In the metadata of a cell, `page` names what the
page has in its place: experiments of experiments.js, `world:NAME` for a world of the article,
`recorded` for the saved result, `drawn` for one that is a drawing, or `none`. A code cell without
`page` is left out, except in solutions, whose results are shown. The metadata `teachers` is a note
that only the teachers' edition shows.
"""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

_MATH = (
    (r"\\text\{([^}]*)\}", r"\1"),
    (r"\\frac\{(.+?)\}\{(.+?)\}", r'<span class="frac"><span>\1</span><span>\2</span></span>'),
    (r"_(?:\{(.+?)\}|(\w))", r"<sub>\1\2</sub>"),
    (r"\^(?:\{(.+?)\}|(\w))", r"<sup>\1\2</sup>"),
    (r"\\q?quad", "&emsp;"),
    (r"\\(?:big|,)", " "),
    (r"\\leftarrow", "←"),
    (r"\\dots", "…"),
    *((r"\\alpha", "α"), (r"\\gamma", "γ"), (r"\\delta", "δ")),
    (r"\\max", "max"),
)
_WORDS = (
    (r"\[([^\]]+)\]\([^)]+\.md\)", r"\1"),  # the page is alone
    (r"\[([^\]]+)\]\((?:\.\./)?([^)]+)\)", r'<a href="\2">\1</a>'),
    (r"\*\*(.+?)\*\*", r"<b>\1</b>"),
    (r"\*(\S|\S.*?\S)\*", r"<i>\1</i>"),
)
_EXERCISES = "<h2>Exercises</h2>"
_WHERE = '<p class="aside">Do them on paper or in the notebook.{}</p>'
_FIELD = " You can write the function below in this page."
_LIST = re.compile(r"^(?:- |\d\. )", re.M)


def _replaced(text: str, pairs: tuple[tuple[str, str], ...]) -> str:
    for pattern, by in pairs:
        text = re.sub(pattern, by, text, flags=re.S)
    return text


def inline(text: str) -> str:
    """Return words with emphasis, code and links as HTML."""
    parts = html.escape(text, quote=False).split("`")
    parts[::2] = [_replaced(part, _WORDS) for part in parts[::2]]
    parts[1::2] = [f"<code>{part}</code>" for part in parts[1::2]]
    return "".join(parts)


def block(text: str) -> str:
    """Return a block of Markdown, which no blank line divides, as HTML."""
    if text.startswith("<"):
        return text
    if text.startswith("#"):
        marks, _, words = text.partition(" ")
        return f"<h{len(marks)}>{inline(words)}</h{len(marks)}>"
    if text.startswith("$$"):
        return f'<p class="math">{_replaced(html.escape(text.strip("$ "), quote=False), _MATH)}</p>'
    if text.startswith("|"):
        rows = [line.strip("| ").split("|") for line in text.split("\n")]
        cells = ["".join(f"<td>{inline(cell.strip())}</td>" for cell in row) for row in rows]
        head = cells[0].replace("td>", "th>")
        return f"<table>{''.join(f'<tr>{row}</tr>' for row in [head, *cells[2:]])}</table>"
    if _LIST.match(text):
        kind = "ul" if text[0] == "-" else "ol"
        items = "".join(f"<li>{inline(item.strip())}</li>" for item in _LIST.split(text)[1:])
        return f"<{kind}>{items}</{kind}>"
    kind = ' class="question"' if text.startswith("**Question") else ""
    return f"<p{kind}>{inline(text)}</p>"


def markdown(text: str) -> str:
    """Return Markdown as HTML, as far as the lessons use it."""
    text = re.sub(r"(</?details>|<summary>.*?</summary>)", r"\n\n\1\n\n", text)
    blocks = [part.strip() for part in re.split(r"\n{2,}", text) if part.strip()]
    return "\n".join(block(part) for part in blocks if not part.startswith("*Using this notebook"))


def recorded(cell: dict[str, Any], kind: str = "recorded") -> str:
    """Return the saved result of a cell: its text, and for a picture its description."""
    texts = ["".join(out["text"]) for out in cell["outputs"] if "text" in out]
    parts = [f"<pre>{html.escape(text, quote=False)}</pre>" for text in texts]
    if alt := cell["metadata"].get("alt"):
        parts.append(f"<p>The picture: {inline(alt)}</p>")
    return f'<div class="{kind}">{"".join(parts)}</div>' if parts else ""


def piece(name: str, cell: dict[str, Any]) -> str:
    """Return the place of a piece, which the page fills, or a saved result."""
    if name in ("recorded", "drawn"):
        return recorded(cell, name)
    if name.startswith("world:"):
        return f'<figure data-piece="{name[6:]}"></figure>'
    return f'<div class="piece" data-run="{name}"></div>'


def lesson(path: Path) -> str:
    """Return a notebook as a chapter of the page."""
    cells = json.loads(path.read_text("utf-8"))["cells"]
    parts, solutions = [], 0
    for cell in cells:
        source, metadata = "".join(cell["source"]), cell["metadata"]
        names = metadata.get("page", "").split()
        if "none" in names:
            continue
        if cell["cell_type"] == "code":
            if solutions and not names:
                parts.append(recorded(cell))
        elif source.startswith("*My "):
            label = source.strip("*: ")
            parts.append(f'<label class="predict">{label}<textarea rows="2"></textarea></label>')
        elif source.strip() == "## Solutions":
            parts.append("<h2>Solutions</h2>")
            solutions = 1
        elif solutions:
            parts.append("</details>" * (solutions > 1))
            parts.append(
                f"<details><summary><b>Solution {solutions}</b></summary>{markdown(source)}"
            )
            solutions += 1
        else:
            where = _EXERCISES + _WHERE.format(_FIELD if names else "")
            parts.append(markdown(source).replace(_EXERCISES, where))
        if note := metadata.get("teachers"):
            parts.append(f'<aside class="teachers"><b>For teachers.</b> {inline(note)}</aside>')
        parts += [piece(name, cell) for name in names]
    link = f'<a href="lessons/{path.name}">notebook in Python</a>'
    parts.append(f'</details><p class="aside">The same lesson is a {link}.</p>')
    return f'<article id="{path.stem[0]}">' + "\n".join(parts) + "</article>\n"


def lessons(folder: Path) -> tuple[str, str]:
    """Return the contents, and the chapters of all lessons, as HTML."""
    chapters = [lesson(path) for path in sorted(folder.glob("*.ipynb"))]
    titles = [re.search(r"<h1>Lesson (\d): (.*?)</h1>", chapter) for chapter in chapters]
    contents = "".join(f'<li><a href="#{title[1]}">{title[2]}</a></li>' for title in titles)
    return f"<ol>{contents}</ol>", "".join(chapters)
