"""The live page without a server, in a real browser: a visit to the lab, to look back at."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from browser import started

from taichi_ants import lab

FILE = Path(__file__).parents[2] / "docs" / "live.html"
VISIT = "AQAPVUAeZIQHAQrYBAECwwII_hAeAB4ABTYAHgUWABYABS4AHgUWACYAByEJ3gwHBARkABy2BwAsBA"
TICK = 433  # a wall and a larger number of ants before it
WORLD = """() => {
  const { history } = viewer, moment = history.length - 1, { frames } = history;
  const { ground, trail } = history.worldAt(moment), { cells, poses, tick } = frames[moment];
  const loaded = poses.reduce((sum, pose) => sum + (pose >> 3), 0);
  return [tick, [...cells], loaded, [...ground], [...trail]];
}"""
ROCKS = """() => viewer.history.worldAt(viewer.history.length - 1)
    .ground.filter((one) => one === 5).length"""


def until(tab, script):
    """Wait without evaluating text, which the policy of the page forbids."""
    for _ in range(400):
        if tab.evaluate(script):
            return
        time.sleep(0.05)
    raise AssertionError(script)


@pytest.mark.browser
def test_a_visit_can_be_looked_back_at_continued_and_saved(tmp_path):
    with started() as browser:
        context = browser.new_context(offline=True, accept_downloads=True)
        tab, faults = context.new_page(), []
        tab.on("pageerror", lambda error: faults.append(str(error)))
        tab.on("console", lambda message: faults.append(message.text))
        tab.goto(f"{FILE.as_uri()}#{VISIT};{TICK};0")
        until(tab, f"() => window.viewer?.history.frames.at(-1).ticks === {TICK}")
        colony = lab.played(*lab.decoded(VISIT), TICK)
        tick, cells, loaded, ground, trail = tab.evaluate(WORLD)
        snapshot = colony.snapshot()
        order = np.argsort(snapshot.ant_numbers)
        assert (tick, loaded) == (TICK, int(snapshot.ant_carries.sum()))
        assert cells == snapshot.ant_cells[order].tolist()
        assert ground == snapshot.ground.tolist()
        assert trail == snapshot.trail.tolist()
        # Each tick before can be seen, with what the ants did.
        tab.keyboard.press("Home")
        until(tab, "() => viewer.player.moment === 0")
        acted = tab.evaluate("viewer.history.frames.filter(({ acts }) => acts.length).length")
        assert acted == TICK
        assert tab.evaluate("() => viewer.history.events.length > 20")
        tab.keyboard.press("End")
        # It goes on: a wall, some ticks, an undo.
        tab.keyboard.press("2")
        box = tab.locator("#world").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        before = tab.evaluate(ROCKS)
        tab.mouse.move(x - 30, y)
        tab.mouse.down()
        tab.mouse.move(x + 30, y, steps=4)
        tab.mouse.up()
        until(tab, f"() => ({ROCKS})() > {before}")
        tab.keyboard.press(" ")
        until(tab, f"() => viewer.history.frames.at(-1).ticks > {TICK + 4}")
        tab.keyboard.press(" ")
        tab.keyboard.press("4")  # a trail
        tab.mouse.click(x, y - 40)
        tab.click("#copy-link")
        until(tab, "() => document.getElementById('toast').textContent.startsWith('Link copied')")
        address = tab.evaluate("location.href")
        _, events = lab.decoded(address.split("#")[1].split(";")[0])
        assert events[-1].does == "trail"
        assert lab.replay(address).equal
        tab.click("#undo")  # the trail, then the wall
        tab.click("#undo")
        until(
            tab, f"() => viewer.history.frames.at(-1).ticks === {TICK} && ({ROCKS})() === {before}"
        )
        for name in ("new", "load", "quit"):
            assert not tab.is_visible(f"#{name}")  # these need a server
        tab.keyboard.press("1")
        tab.keyboard.press("ArrowRight")
        until(tab, f"() => viewer.history.frames.at(-1).ticks === {TICK + 1}")
        with tab.expect_download() as saved:
            tab.click("[data-export=page]")
        saved.value.save_as(tmp_path / "recording.html")
        tab.goto((tmp_path / "recording.html").as_uri())
        until(tab, "() => window.viewer?.history.length === 2")
        context.close()
        assert faults == []
