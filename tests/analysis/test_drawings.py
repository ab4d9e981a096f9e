"""Figures as markup: what is drawn is what the figure shows, in the colours of the page."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib import rc_context

from taichi_ants.analysis import style, sweeps
from taichi_ants.analysis.drawings import COLOURS, Drawing, drawing, drawings
from taichi_ants.analysis.style import BLUE, INK, frame, legend_entries, new_figure, styled

TITLE, CAPTION = 'Ants & <more> "ants"', "First line\nof two, <here>"
POINTS = np.random.default_rng(0).random((4000, 2)).round(2)


def made(look: dict, label: str = "runs <1>"):
    with styled():
        figure = new_figure(3)
        axis = figure.subplots()
        axis.plot(*POINTS.T, "o", label=label, **look)
        axis.axhline(0.125, color=INK)
        axis.set_xlabel("discount 0.9999")
        frame(figure, TITLE, CAPTION, legend_entries([axis]))
    return figure


@pytest.fixture(scope="module")
def drawn() -> Drawing:
    return drawing("one", made({"color": BLUE, "alpha": 0.6, "markersize": 3}))


def texts(svg: str) -> list[str]:
    return ["".join(one.itertext()) for one in ElementTree.fromstring(svg).iter() if one.text]


def test_title_and_caption_are_told_by_the_page(drawn: Drawing) -> None:
    assert drawn[:3] == ("one", TITLE, "First line of two, <here>")
    assert drawn.svg.startswith('<svg viewBox="0 0 648 216" role="img" aria-label="Ants &amp; &lt;')
    assert not [line for line in texts(drawn.svg) if "Ants" in line or "First" in line]


def test_it_is_well_formed_and_text_stays_as_it_is(drawn: Drawing) -> None:
    assert {"discount 0.9999", "runs <1>"} <= {line.strip() for line in texts(drawn.svg)}
    assert "font-family" not in drawn.svg
    assert "<style" not in drawn.svg  # it would change the whole page
    assert "xlink" not in drawn.svg


def test_colours_are_those_of_the_page(drawn: Drawing) -> None:
    assert "var(--plot-blue)" in drawn.svg
    assert "var(--ink)" in drawn.svg
    for colour in COLOURS:
        assert colour.lower() not in drawn.svg.lower()


def test_every_mark_is_drawn_where_it_is(drawn: Drawing, monkeypatch) -> None:
    """Near to it, where there are many; none is drawn twice."""
    monkeypatch.setattr("taichi_ants.analysis.drawings._MANY", 10**6)
    exact = drawing("one", made({"color": BLUE, "alpha": 0.6, "markersize": 3}))

    def places(svg: str) -> np.ndarray:
        group = max(re.findall(r"<g style=[^>]*opacity[^>]*>(.*?)</g>", svg), key=len)
        return np.array(re.findall(r'x="([^"]*)" y="([^"]*)"', group), float)

    few, all_of_them = places(drawn.svg), places(exact.svg)
    assert len(all_of_them) == len(POINTS)
    assert len(np.unique(few, axis=0)) == len(few) < len(POINTS)
    away = np.abs(all_of_them[:, None] - few[None]).max(axis=2).min(axis=1)
    assert away.max() < 0.8


def test_names_in_several_drawings_do_not_meet() -> None:
    look = {"color": BLUE, "alpha": 0.6}
    several = drawings({"one": made(look), "two": made(look)})
    ids = [set(re.findall(r'id="([^"]*)"', one.svg)) for one in several]
    assert ids[0]
    assert not ids[0] & ids[1]
    again = drawing("one", made(look))
    assert again == several[0]  # the same figure gives the same bytes


# Figures look the same whatever Matplotlib's settings are, and show names as they are.

NAMES = ["a$1_$b", "_hidden", "c^2", "$\\frac$", "_child0"]
SETTINGS = [{"rate": rate, "world": name} for rate in (0.1, 0.2) for name in NAMES]
VALUES = np.random.default_rng(0).normal(size=(10, 3))


def figure_of(names):
    with style.styled():
        figure = style.new_figure(2)
        axes = figure.subplots()
        sweeps.draw_lines(axes, {name: [(1, 0, -1, 1), (2, 3, 2, 4)] for name in names})
        style.frame(figure, "Title of $\\frac$", "caption $", style.legend_entries([axes]))
    return figure


@pytest.mark.parametrize(
    "settings",
    [
        {"text.usetex": True},
        {"font.family": "serif", "axes.formatter.limits": (-1, 1), "lines.linestyle": "--"},
        {"font.size": 30, "axes.grid": False, "savefig.bbox": "tight"},
    ],
)
def test_settings_of_the_user_do_not_reach_figures(settings, tmp_path):
    sweeps.draw(tmp_path / "usual.png", SETTINGS, VALUES, "return")
    with rc_context(settings):
        sweeps.draw(tmp_path / "user.png", SETTINGS, VALUES, "return")
        svg = drawing("one", figure_of(["a"]))
    assert (tmp_path / "user.png").read_bytes() == (tmp_path / "usual.png").read_bytes()
    assert svg == drawing("one", figure_of(["a"]))


def test_names_are_text(tmp_path):
    figure = figure_of(NAMES)
    [legend] = figure.legends
    found = [text.get_text().lstrip("\u200b") for text in legend.get_texts()]
    assert found == NAMES
    assert not any(text.get_parse_math() for text in [*legend.get_texts(), legend.get_title()])
    style.save(figure, tmp_path / "a.png")
    svg = drawing("one", figure_of(NAMES)).svg
    assert all(name in svg for name in NAMES)
