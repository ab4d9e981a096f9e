"""The live page without a server, in a real browser: a visit to the lab, to look back at."""

import time
from pathlib import Path

import pytest
from browser import WORLD, world_of

from taichi_ants import lab

FILE = Path(__file__).parents[2] / "docs" / "live.html"
VISIT = "AQAPVUAeZIQHAQrYBAECwwII_hAeAB4ABTYAHgUWABYABS4AHgUWACYAByEJ3gwHBARkABy2BwAsBA"
TICK = 433  # a wall and a larger number of ants before it


def until(tab, script):
    """Wait without evaluating text, which the policy of the page forbids."""
    for _ in range(400):
        if tab.evaluate(script):
            return
        time.sleep(0.05)
    raise AssertionError(script)


@pytest.mark.browser
def test_a_visit_can_be_looked_back_at_continued_and_saved(browser, tmp_path):
    context = browser.new_context(offline=True, accept_downloads=True)
    tab, faults = context.new_page(), []
    tab.on("pageerror", lambda error: faults.append(str(error)))
    tab.on("console", lambda message: faults.append(message.text))
    tab.goto(f"{FILE.as_uri()}#{VISIT};{TICK};0")
    until(tab, f"() => window.viewer?.history.frames.at(-1).ticks === {TICK}")
    colony = lab.played(*lab.decoded(VISIT), TICK)
    assert tab.evaluate(WORLD) == world_of(colony)
    # Each tick before can be seen, with what the ants did.
    tab.keyboard.press("Home")
    until(tab, "() => viewer.player.moment === 0")
    acted = tab.evaluate("viewer.history.frames.filter(({ acts }) => acts.length).length")
    assert acted == TICK
    assert tab.evaluate("() => viewer.history.events.length > 20")
    tab.keyboard.press("End")
    # It goes on: some ticks, and a trail in the middle.
    tab.keyboard.press(" ")
    until(tab, f"() => viewer.history.frames.at(-1).ticks > {TICK + 4}")
    tab.keyboard.press(" ")
    tab.keyboard.press("4")
    tab.click("#world")
    tab.click("#copy-link")
    until(tab, "() => document.getElementById('toast').textContent.startsWith('Link copied')")
    address = tab.evaluate("location.href")
    _, events = lab.decoded(address.split("#")[1].split(";")[0])
    assert events[-1].does == "trail"
    assert lab.replay(address).equal
    for name in ("new", "load", "quit"):
        assert not tab.is_visible(f"#{name}")  # these need a server
    with tab.expect_download() as saved:
        tab.click("[data-export=page]")
    saved.value.save_as(tmp_path / "recording.html")
    tab.goto((tmp_path / "recording.html").as_uri())
    until(tab, "() => window.viewer?.history.length > 4")
    context.close()
    assert faults == []
