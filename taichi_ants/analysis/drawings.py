"""Figures as SVG for HTML pages, in the colours and the font of the page."""

from __future__ import annotations

import html
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from taichi_ants.analysis.style import BLUE, GREY, INK, ORANGE, PALE, RED, SKY, WINE, save, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Colours of figures -> CSS variables of the page, which differ in light and dark mode.
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
_MANY = 500  # marks of a line, from which overlapping ones are left out


class Drawing(NamedTuple):
    """A figure for a page: its name, its title and caption as text, and the rest as SVG."""

    name: str
    title: str
    caption: str
    svg: str


def drawing(name: str, figure: Figure) -> Drawing:
    """Return a figure that `style.frame` made as markup, after removing its title and caption."""
    from matplotlib import rc_context

    [legend] = figure.legends
    title, caption = legend.get_title().get_text(), figure.get_supxlabel()
    legend.set_title("")
    figure.supxlabel("")
    for axis in figure.axes:
        _thin(axis)
    text = io.StringIO()
    # Text remains text; the salt makes the ids of each figure unique on the page.
    with styled(), rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    return Drawing(name, title, " ".join(caption.split()), _for_page(text.getvalue(), title))


def drawings(figures: Mapping[str, Figure], folder: Path | None = None) -> list[Drawing]:
    """Return all figures as markup, after writing them as PNG files into the folder, if any."""
    if folder is not None:
        for name, figure in figures.items():
            save(figure, folder / f"{name}.png")
    return [drawing(name, figure) for name, figure in figures.items()]


def _thin(axis: Axes) -> None:
    """Remove marks within half a point of another one, to keep the page small."""
    axis.get_xlim(), axis.get_ylim()  # matplotlib updates the limits only when they are read
    for line in axis.lines:
        data = np.asarray(line.get_xydata())
        if len(data) > _MANY:
            points = axis.transData.transform(data) * 72 / axis.figure.dpi
            _, first = np.unique(np.round(2 * points), axis=0, return_index=True)
            line.set_data(*data[np.sort(first)].T)


def _for_page(svg: str, title: str) -> str:
    """Return the element of an SVG file with rounded numbers and the styles of the page."""
    svg = svg[svg.index("<svg") :].strip().replace("xlink:href", "href")
    svg = re.sub(r'(?s)<metadata>.*?</metadata>|<style.*?</style>| font-family: [^;"]*;', "", svg)
    svg = re.sub(r'<g id="[^"]*">', "<g>", svg)
    # Coordinates and paths in tenths of a point.
    svg = re.sub(
        r' (?:d|x|y|transform)="[^"]*"',
        lambda match: re.sub(r"-?\d+\.\d{2,}", lambda n: f"{float(n[0]):.1f}", match[0]),
        svg,
    )
    svg = re.sub(r"(?:<use [^>]*/>\s*){2,}", _marks, svg)
    svg = re.sub(r"\s*\n\s*", "\n", svg)
    for colour, name in COLOURS.items():
        svg = re.sub(re.escape(colour), f"var(--{name})", svg, flags=re.I)
    box = re.findall(r'viewBox="([^"]*)"', svg)[0]
    head = f'<svg viewBox="{box}" role="img" aria-label="{html.escape(title)}"'
    return re.sub(r"<svg[^>]*", lambda _: head, svg, count=1)


_USE = re.compile(r'href="([^"]*)" x="([^"]*)" y="([^"]*)"(?: style="([^"]*)")?')


def _marks(match: re.Match) -> str:
    """Return a group of equal marks that share one style attribute."""
    uses = _USE.findall(match[0])
    [(mark, look), *others] = {(mark, look) for mark, _, _, look in uses}
    if others or "opacity" not in look:
        return match[0]
    marks = "".join(f'<use href="{mark}" x="{x}" y="{y}"/>' for _, x, y, _ in uses)
    return f'<g style="{look}">{marks}</g>\n'
