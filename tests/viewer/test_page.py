"""Pages as files: their size, that they need nothing else, and where they come from."""

from __future__ import annotations

import base64
import html
import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import taichi_ants
from taichi_ants import Colony, TrainingConfig, World, commands, rollout, worlds
from taichi_ants.learners.policies import save_policy, trail_follower
from taichi_ants.rendering import Episode
from taichi_ants.task import Caste, Food, Task
from taichi_ants.viewer import record_colony, record_trace
from taichi_ants.viewer.page import part

TITLE = 'An <ant> & its "trail"'


@pytest.fixture(scope="module")
def episode():
    return record_trace(Episode.play(worlds.paper(), trail_follower()).trace, TITLE)


def luminance(colour: str) -> float:
    """As the contrast of WCAG 2 has it."""
    parts = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


@pytest.mark.parametrize("theme", [0, 1])
def test_text_can_be_read_and_ants_stand_out(theme):
    values = dict(re.findall(r"--([a-z-]+): ([^;]+);", part("colours.css").split("}")[theme]))

    def contrast(one: str, other: str) -> float:
        high, low = sorted([luminance(one), luminance(other)], reverse=True)
        return (high + 0.05) / (low + 0.05)

    for ink in ("ink", "faint", "chosen", "good", "bad"):
        assert contrast(values[ink], values["card"]) > 4.5, ink
    for cell in (values["empty"], *values["trail"].split()):
        # Where the trail comes near the colour of ants, the edge around them sets them apart.
        assert max(contrast(values[name], cell) for name in ("ant", "halo")) > 3
    for trail in values["trail"].split():  # food in small cells is a dot with a ring
        assert max(contrast(values[name], trail) for name in ("food", "food-floor")) > 1.75
    assert contrast(values["food"], values["food-floor"]) > 2.9
    levels = [luminance(colour) for colour in values["trail"].split()]
    assert levels == sorted(levels, reverse=theme == 0)


def test_notebooks_show_worlds_traces_and_colonies(monkeypatch):
    """By IPython's formatter, to which the package tells it when it is imported."""
    display = pytest.importorskip("IPython.core.formatters").DisplayFormatter()
    shell = SimpleNamespace(display_formatter=display)
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    taichi_ants._show_pages_in_notebooks()

    def html_of(value):
        return display.format(value, include=["text/html"])[0].get("text/html")

    trace = rollout(worlds.paper(), trail_follower())
    shown = html_of(trace)
    assert shown.startswith("<iframe ")
    inner = html.unescape(re.search(r'srcdoc="([^"]*)"', shown)[1])
    assert inner.startswith("<!doctype html>")
    assert inner.endswith("</html>\n")
    object.__setattr__(trace, "arguments", None)
    assert html_of(trace) is None
    config = TrainingConfig("q_learning", 0.1, 0.9, 0.2, 1.0)
    colony = Colony(worlds.paper(), None, config, ants=3)
    assert html_of(colony) is None
    colony.begin_episode()
    assert "<iframe " in html_of(colony)
    assert colony.ticks == 0
    assert "<iframe " in html_of(record_colony(colony, ticks=2))
    of_castes = Task(castes={"a": Caste()})
    of_foods = Task(foods={"seed": Food(), "sap": Food()}, delivery="truncates")
    for several in (of_castes, of_foods):
        begun = Colony(worlds.paper(), several, config, ants=3)
        begun.begin_episode()
        assert "<iframe " in html_of(begun)
    for world in (worlds.paper(), World((3, 4, 1), (0, 0, 0))):
        alternative, source = re.findall(r'"([^"]*)"', html_of(world))
        assert html.unescape(alternative) == repr(world)
        content = base64.b64decode(source.removeprefix("data:image/png;base64,"))
        assert content.startswith(b"\x89PNG")
    assert html_of(World((600, 600, 1), (0, 0, 0))) is None


def test_the_command_writes_pages(tmp_path, capsys):
    policy = tmp_path / "policy.npz"
    save_policy(policy, trail_follower(), {})
    ant, ants = tmp_path / "new" / "ant.html", tmp_path / "ants.HTML"
    given = ["--policy", str(policy), "--out"]
    for arguments in (
        ["episode", *given, str(ant), "--title", "walks"],
        ["colony", *given, str(ants), "--ants", "3", "--ticks", "9", "--follow", "2"],
    ):
        with pytest.raises(SystemExit) as done:
            commands.run("render", arguments)
        assert done.value.code == 0
    assert capsys.readouterr().out.startswith(f"{ant}: 34 steps, return 45, delivered\n")
    assert "<title>walks</title>" in ant.read_text(encoding="utf-8")
    assert ants.read_text(encoding="utf-8").endswith("</html>\n")
