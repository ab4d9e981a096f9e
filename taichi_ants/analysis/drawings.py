"""Figures as markup for pages: vectors, in the colours and the letters of the page."""

from __future__ import annotations

import html
import io
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from taichi_ants.analysis.style import BLUE, GREY, INK, ORANGE, PALE, RED, SKY, WINE, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Colours of the figures -> those of the page, which differ in light and dark.
COLOURS = {
    INK: "ink",
    GREY: "faint",
    PALE: "edge",
    BLUE: "plot-blue",
    ORANGE: "plot-orange",
    RED: "plot-red",
    WINE: "plot-wine",
    SKY: "plot-sky",
}


class Drawing(NamedTuple):
    """A figure for a page.

    Attributes:
        name, title, caption: What it is called, and what is said above and below it.
        svg: The rest of the figure.
    """

    name: str
    title: str
    caption: str
    svg: str


def drawing(name: str, figure: Figure) -> Drawing:
    """A figure of `style.frame` as markup. Title and caption are taken out of the figure itself."""
    from matplotlib import rc_context

    [legend] = figure.legends
    title, caption = legend.get_title().get_text(), figure.get_supxlabel()
    legend.set_title("")
    figure.supxlabel("")
    text = io.StringIO()
    # Text stays text, and the names inside of a figure are those of no other one.
    with styled(), rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    return Drawing(name, title, " ".join(caption.split()), _for_page(text.getvalue(), title))


def drawings(figures: Mapping[str, Figure]) -> list[Drawing]:
    """All of some figures, see `drawing`."""
    return [drawing(name, figure) for name, figure in figures.items()]


def _for_page(svg: str, title: str) -> str:
    """The element of an SVG file, with short numbers and without what the page says itself."""
    svg = svg[svg.index("<svg") :].strip().replace("xlink:href", "href")
    svg = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>", "", svg, flags=re.S)
    svg = re.sub(r' font-family: [^;"]*;', "", svg)
    svg = re.sub(r'<g id="[^"]*">', "<g>", svg)
    svg = re.sub(r' (?:d|x|y|transform)="[^"]*"', _short, svg)
    svg = re.sub(r"(?:<use [^>]*/>\s*){2,}", _marks, svg)
    svg = re.sub(r"\s*\n\s*", "\n", svg)
    for colour, name in COLOURS.items():
        svg = re.sub(re.escape(colour), f"var(--{name})", svg, flags=re.I)
    box = re.search(r'viewBox="([^"]*)"', svg)
    assert box is not None
    head = f'<svg viewBox="{box[1]}" role="img" aria-label="{html.escape(title)}"'
    return re.sub(r"<svg[^>]*", lambda _: head, svg, count=1)


def _short(found: re.Match) -> str:
    """A place or a path in tenths of a point."""
    return re.sub(r"-?\d+\.\d{2,}", lambda number: f"{float(number[0]):.1f}", found[0])


_USE = re.compile(r'href="([^"]*)" x="([^"]*)" y="([^"]*)"(?: style="([^"]*)")?')


def _marks(found: re.Match) -> str:
    """The marks of many runs: their look once, and each place once, to half a point."""
    uses = _USE.findall(found[0])
    [(mark, look), *others] = {(mark, look) for mark, _, _, look in uses}
    if others or "opacity" not in look:
        return found[0]
    places = dict.fromkeys(
        (round(2 * float(x)) / 2, round(2 * float(y)) / 2) for _, x, y, _ in uses
    )
    marks = "".join(f'<use href="{mark}" x="{x:g}" y="{y:g}"/>' for x, y in places)
    return f'<g style="{look}">{marks}</g>\n'
