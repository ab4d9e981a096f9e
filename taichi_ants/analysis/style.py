"""The style of the figures: colours, markers and fonts; functions that make and save figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import XAxis, YAxis
    from matplotlib.figure import Figure

__all__ = ["use"]
# 9 inches are about 900 pixels, the width of a README; the DPI doubles that for sharp screens.
WIDTH = 9.0
DPI = 180

# The first two, four or five of these are the colours of Okabe and Ito and of Tol that people with
# any colour deficiency distinguish best.
BLUE, ORANGE, RED, WINE, SKY = "#0072B2", "#E69F00", "#CC3311", "#882255", "#56B4E9"
INK, GREY, PALE = "#222222", "#767676", "#E4E4E4"
# Colours of lines, in this order.
COLOURS = (BLUE, ORANGE, RED, WINE, SKY, "#CC79A7", INK, "#009E73", "#999933", GREY)


@cache
def _settings() -> Mapping[Any, Any]:
    from matplotlib import rc_params_from_file
    from matplotlib.rcsetup import cycler

    path = Path(__file__).with_name("taichi_ants.mplstyle")
    style = rc_params_from_file(path, use_default_template=False)
    return {**style, "axes.prop_cycle": cycler(color=COLOURS)}


def styled() -> AbstractContextManager:
    """Return the matplotlib context in which to make and save figures.

    Settings of the user, such as those of a matplotlibrc, have no effect in it.
    """
    from matplotlib import rc_context, rcParamsDefault

    defaults = {name: value for name, value in rcParamsDefault.items() if "backend" not in name}
    return rc_context({**defaults, **_settings()})


def label(name: str) -> str:
    """Return a name as the label of an artist; matplotlib hides labels that begin with _."""
    return f"\u200b{name}" if name.startswith("_") else name  # a space without width


def use() -> None:
    """Apply the style of the project to all figures of a notebook.

    >>> from taichi_ants.analysis import style
    >>> style.use()
    """
    from matplotlib import rcParams

    rcParams.update({**_settings(), "figure.figsize": (8.0, 3.0), "figure.dpi": 110})


def new_figure(height: float) -> Figure:
    """Return an empty figure of full width and the height in inches, without pyplot's state."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.05, wspace=0.03, hspace=0.03)
    return Figure(figsize=(WIDTH, height), dpi=DPI, layout=layout)


def frame(figure: Figure, title: str, caption: str, entries: Mapping[str, Artist]) -> None:
    """Add a title and a legend above the panels and a caption of 120-character lines below."""
    widest = max(map(len, entries), default=0)
    columns = int(WIDTH / (0.6 + 0.068 * widest))  # inches at 9 points
    bold = {"size": 12, "weight": "bold"}
    look: dict[str, Any] = {"ncols": max(1, min(columns, len(entries))), "columnspacing": 1.6}
    look |= {"borderpad": 0.2, "loc": "outside upper left", "alignment": "left"}
    look |= {"title_fontproperties": bold}
    # The title belongs to the legend, which the layout engine would draw over a figure's title.
    figure.legend(entries.values(), entries.keys(), title=title, **look)
    figure.supxlabel(caption, x=0.008, ha="left", fontsize=8, color=GREY)


def logarithmic(axis: XAxis | YAxis, steps: Sequence[float]) -> None:
    """Make an axis logarithmic, with plain numbers at `steps` (1 to 9) of each decade."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    axis.set_major_locator(LogLocator(subs=steps, numticks=30))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def legend_entries(axes: Iterable[Axes]) -> dict[str, Artist]:
    """Return the artists with a label in any panel, by label."""
    entries: dict[str, Artist] = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    return entries


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG file; raise AntsError if that fails."""
    places = [axis.get_position(original=True) for axis in figure.axes]
    with styled():
        write_atomically(path, partial(figure.savefig, format="png", dpi=DPI, facecolor="white"))
    for axis, place in zip(figure.axes, places, strict=True):  # as new for the next layout
        axis.set(position=place, in_layout=True)
