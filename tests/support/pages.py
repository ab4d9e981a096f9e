"""Readers of HTML pages: tables and links."""

from __future__ import annotations

import re
from html.parser import HTMLParser


class _Tables(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tables: list[tuple[str, list[list[str]]]] = []
        self._words: list[str] | None = None

    def handle_starttag(self, tag: str, attributes: list) -> None:
        if tag == "table":
            self.tables.append(("", []))
        elif tag == "tr":
            self.tables[-1][1].append([])
        if tag in ("td", "th", "caption"):
            self._words = []

    def handle_endtag(self, tag: str) -> None:
        if tag in ("td", "th", "caption") and self._words is not None:
            text = " ".join(" ".join(self._words).split())
            _, rows = self.tables[-1]
            if tag == "caption":
                self.tables[-1] = (text, rows)
            else:
                rows[-1].append(text)
            self._words = None

    def handle_data(self, data: str) -> None:
        if self._words is not None:
            self._words.append(data)


def tables(page: str) -> dict[str, list[list[str]]]:
    """Return the rows of each table, headers first, by caption; "" if a table has none."""
    parser = _Tables()
    parser.feed(page)
    return dict(parser.tables)


def addresses(page: str) -> set[str]:
    """Return all addresses that the page links to or loads."""
    markup = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    return set(re.findall(r"""(?:href|src|action)=["']?([^"'\s>]+)""", markup))
