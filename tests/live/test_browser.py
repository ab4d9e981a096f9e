"""The live page in a real browser: each control, and worlds that equal the engine's."""

import time
from pathlib import Path

import numpy as np
import pytest
from browser import WORLD, Page, world_of
from rooms import CHOSEN, Guest, running

from taichi_ants import Colony, load_policy
from taichi_ants.commands import watch
from taichi_ants.learners.expected_sarsa import EXPECTED_SARSA
from taichi_ants.learners.policies import Policy, trail_follower
from taichi_ants.live.choices import Choices
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def shared(browser):
    policies = {"mine": Policy(trail_follower("ants"), "ants", {})}
    with running(Choices(policies)) as one:
        yield one


@pytest.fixture
def room(shared):
    with Guest(shared) as guest:
        guest.ask("begin", chosen=CHOSEN)
        guest.until("whole")
    shared.speed = 12.0
    return shared


@pytest.fixture
def page(browser, room):
    opened = Page(browser, room.url, accept_downloads=True)
    yield opened
    opened.close()


def wait(page: Page, script: str) -> None:
    page.tab.wait_for_function(script)


def assert_same(page: Page, room) -> None:
    """What the page has is what the engine has, once time stands still there too."""
    while room.playing:
        time.sleep(0.01)
    for _ in range(100):
        if page.read(WORLD) == world_of(room.session.colony):
            break
        time.sleep(0.1)  # what has changed is on its way
    assert page.read(WORLD) == world_of(room.session.colony)


def edits(room, n: int) -> list[dict]:
    """The edits of a session, as soon as there are n."""
    for _ in range(500):
        if len(room.session.edits) >= n:
            break
        time.sleep(0.02)
    time.sleep(0.1)
    return [edit for _, edit in room.session.edits]


def place(page: Page, cell: int) -> tuple[float, float]:
    """Where the middle of a cell lies on the page."""
    x, y = page.read("cell => viewer.stage.toPage(viewer.history.grid.centre(cell))", cell)
    box = page.tab.locator("#world").bounding_box()
    return box["x"] + x, box["y"] + y


def open_new(page: Page) -> None:
    """Show what a new session can be."""
    page.tab.click("#new > summary")
    page.tab.wait_for_selector("#begin")


def cell_of(room, *cube: int) -> int:
    return int(room.session.colony.grid.index(cube))


def test_steps_and_play_show_the_world_of_the_engine(page, room):
    for tick in (1, 2, 3):
        page.click("#forward")
        wait(page, f"viewer.history.frames.at(-1).tick === {tick}")
        assert_same(page, room)
    assert room.session.ticks == 3
    page.tab.focus("#world")
    page.press("Shift+ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 13")
    assert_same(page, room)
    page.tab.keyboard.press("Space")
    wait(page, "live.running && viewer.history.frames.at(-1).tick >= 18")
    assert page.tab.get_attribute("#play", "aria-label") == "Pause"
    page.tab.keyboard.press("Space")
    wait(page, "!live.running")
    assert_same(page, room)
    ticks = room.session.ticks
    page.click("#back")
    page.click("#back")  # to look back stops nothing and asks for nothing
    assert page.read("viewer.history.frames[viewer.player.moment].tick") == ticks - 2
    page.click("#forward")
    assert room.session.ticks == ticks
    page.press("End")
    assert page.read("viewer.player.moment === viewer.player.last")
    page.click("#forward")
    wait(page, f"viewer.history.frames.at(-1).tick === {ticks + 1}")
    assert_same(page, room)


@pytest.mark.parametrize("how", ["mouse", "keyboard"])
def test_each_tool_changes_the_world_of_the_engine(page, room, how):
    here, ground = cell_of(room, 5, 5, 0), lambda: room.session.colony.snapshot().ground
    number = 0

    def use(tool: str, key: str, cell: int, does: int = 1) -> list[dict]:
        nonlocal number
        if how == "keyboard":
            page.press(key)
            page.read("cell => viewer.chooseCell(cell, true)", cell)
            page.tab.focus("#world")
            page.tab.keyboard.press("Enter")
        else:
            page.tab.click(f'[data-tool="{tool}"]')
            page.tab.mouse.click(*place(page, cell))
        assert page.tab.get_attribute(f'[data-tool="{tool}"]', "aria-pressed") == "true"
        number += does
        done = edits(room, number)
        assert len(done) == number, done
        assert_same(page, room)
        return done[-does:]

    (edit,) = use("rock", "2", here)
    assert edit == {"place": {"what": "rock", "cells": [here]}}
    assert ground()[here] == OBSTACLE
    use("erase", "6", here)
    assert ground()[here] == EMPTY
    use("food", "3", here)
    assert ground()[here] == FOOD
    there = cell_of(room, 5, 4, 0)
    (edit,) = use("trail", "4", there)
    assert edit == {"trail": {"level": 500, "cells": [there]}}
    ants = len(room.session.colony.snapshot().ant_cells)
    (edit,) = use("ants", "5", there)
    assert edit == {"add_ants": {"cells": [there]}}
    assert len(room.session.colony.snapshot().ant_cells) == ants + 1
    done = use("erase", "6", there, 2)
    assert [name for edit in done for name in edit] == ["remove_ants", "trail"]
    free = cell_of(room, 3, 3, 0)
    (edit,) = use("queen", "7", free)
    assert edit == {"place": {"what": "queen", "cells": [free]}}
    assert ground()[free] == QUEEN
    page.press("1")
    page.click_cell(here)
    assert "contains food" in page.text("#cell")


def test_a_change_is_undone_and_the_session_before_comes_back(page, room):
    page.press("Shift+ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    assert page.tab.is_disabled("#undo")
    assert page.tab.is_hidden("#go-back") == (room._previous is None)
    ground = room.session.colony.snapshot().ground
    page.press("2", "]")
    page.tab.mouse.move(*place(page, cell_of(room, 5, 5, 0)))
    page.tab.mouse.down()
    for k in range(4):  # in several edits
        page.tab.mouse.move(*place(page, cell_of(room, 5, 5 - k, k)))
        page.settle()
    page.tab.mouse.up()
    assert len(edits(room, 2)) > 1
    page.tab.fill("#set-epsilon", "0.5")
    wait(page, "live.state.values.epsilon.value === 0.5")
    page.tab.focus("#world")
    page.press("ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 11")
    drawn = room.session
    page.press("Control+z")  # the slider
    wait(page, "live.state.values.epsilon.value !== 0.5 && viewer.history.length === 1")
    assert len(room.session.edits) == len(drawn.edits) - 1
    assert_same(page, room)
    page.click("#undo")  # the whole stroke
    wait(page, "document.querySelector('#undo').disabled")
    assert np.array_equal(room.session.colony.snapshot().ground, ground)
    assert_same(page, room)
    page.click("#restart")
    wait(page, "viewer.history.frames.at(-1).tick === 0")
    page.click("#go-back")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    assert_same(page, room)
    page.tab.click("#play")  # it goes on from there
    wait(page, "viewer.history.frames.at(-1).tick > 11")
    page.tab.click("#play")
    wait(page, "!live.running")


def test_a_new_session_is_what_was_chosen(page, room):
    open_new(page)
    page.tab.select_option("#world-name", "far_piles")
    page.tab.fill("#world-seed", "4")
    page.tab.fill("#size", "25")
    page.tab.select_option("#task", "foraging")
    page.tab.click("#settings-box summary")
    page.tab.check('[data-path="task.life.births"]')
    page.tab.fill("#ants", "30")
    page.tab.fill("#episode", "0")
    page.tab.fill("#seed", "9")
    page.tab.select_option("#policy", "learn expected_sarsa")
    page.click("#begin")
    wait(page, "viewer.history.grid.ranges[0] === 25")
    setup = room.session.setup
    assert (setup.world, setup.world_seed, setup.ants, setup.seed) == ("far_piles", 4, 30, 9)
    assert (setup.ticks_per_episode, setup.policy.learner) == (0, "expected_sarsa")
    assert (setup.task.observation, setup.task.life.births) == ("ants", True)
    assert page.tab.input_value("#task") == "foraging"
    assert_same(page, room)
    assert page.text("#now-chosen") == "three far piles · foraging · Expected SARSA"
    open_new(page)
    assert page.text("#policy-help") == f"The ants learn: {EXPECTED_SARSA.summary}."
    page.tab.uncheck('[data-path="task.traffic.swap"]')
    assert page.tab.input_value("#task") == ""  # other settings
    page.tab.select_option("#policy", "file mine")
    assert page.tab.is_disabled('[data-path="task.observation"]')
    assert page.text("#policy-help") == "The ants follow mine, and do not learn."
    page.tab.select_option("#world-name", "map")
    page.tab.fill("#ants", "3")
    page.click("#begin")
    wait(page, "viewer.history.grid.ranges[0] < 25")
    assert np.array_equal(room.session.setup.policy, trail_follower("ants"))
    assert not room.session.setup.learns
    assert_same(page, room)
    open_new(page)
    page.tab.select_option("#world-name", "open")
    page.tab.fill("#size", "9999")
    page.tab.fill("#world-seed", "")
    page.click("#begin")  # the browser says why not
    assert room.session.setup.ants == 3
    page.tab.select_option("#world-name", "map")  # what is hidden now does not matter
    page.tab.fill("#map", "nothing\nat all")
    page.click("#begin")
    page.tab.wait_for_selector("#toast.bad:not([hidden])")
    assert page.text("#toast").endswith(".")


def test_the_token_is_seen_in_no_command_line_and_no_address(browser, room, monkeypatch):
    """A browser opens a private file that leads to the page, under the policy of the page."""
    opened = []
    monkeypatch.setattr(watch.webbrowser, "open", opened.append)
    monkeypatch.setattr(watch.sys, "platform", "elsewhere")  # where a display is not asked for
    context, faults = browser.new_context(), []
    tab = context.new_page()
    tab.on("console", lambda message: faults.append(message.text))
    with watch._opened(room.url):
        (address,) = opened
        path = Path(address.removeprefix("file://"))
        assert room.token not in address
        assert path.stat().st_mode & 0o777 == 0o600
        assert path.parent.stat().st_mode & 0o777 == 0o700
        tab.goto(address)
        tab.locator("#now dd").first.wait_for()
    assert not path.parent.exists()
    for again in (tab.reload, lambda: None):
        assert tab.url == f"http://127.0.0.1:{room.port}/"
        again()
        tab.locator("#now dd").first.wait_for()
    tab.locator("#theme").click()
    assert context.cookies() == []
    assert faults == []
    tab.go_back()
    assert room.token not in tab.url
    other = context.new_page()  # another tab has no token
    other.goto(f"http://127.0.0.1:{room.port}/")
    other.locator("#lost").wait_for()
    assert "Open the address that the server prints." in other.locator("#lost").inner_text()
    context.close()


def test_files_are_saved_and_loaded(page, room, tmp_path):
    page.press("Shift+ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    for kind in ("session", "gif", "policy", "colony"):
        with page.tab.expect_download() as got:
            page.tab.click(f'[data-export="{kind}"]')
        got.value.save_as(tmp_path / got.value.suggested_filename)
    state = room.session.interventions.state()
    assert np.array_equal(
        load_policy(tmp_path / "policy.npz").q_values, room.session.colony.q_values[0]
    )
    assert Colony.load(tmp_path / "colony.npz").ticks == 10
    page.click("#restart")
    wait(page, "viewer.history.length === 1")
    page.tab.set_input_files("#upload", tmp_path / "session.npz")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    assert room.session.interventions.state() == state
    assert_same(page, room)
    page.tab.set_input_files("#upload", tmp_path / "session.gif")
    page.tab.wait_for_selector("#toast.bad:not([hidden])")
    assert room.session.interventions.state() == state


def test_fingers_draw_and_two_of_them_move_the_view(browser, room):
    phone = Page(browser, room.url, (390, 844), has_touch=True, device_scale_factor=2)
    phone.tab.click('[data-tool="rock"]')
    session = phone.context.new_cdp_session(phone.tab)

    def touch(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    one, other = (place(phone, cell_of(room, *cube)) for cube in ((5, 2, 0), (2, 5, 0)))
    touch("touchStart", one)
    touch("touchMove", other)
    touch("touchEnd")
    edits(room, 1)
    wait(phone, "live.tools.fresh.size === 0")
    rocks = int((room.session.colony.snapshot().ground == OBSTACLE).sum())
    assert room.session.colony.snapshot().ground[cell_of(room, 3, 4, 0)] == OBSTACLE
    scale = phone.read("viewer.stage.camera.scale")
    middle = (one[0] + other[0]) / 2, (one[1] + other[1]) / 2
    touch("touchStart", (middle[0] - 30, middle[1]))
    touch("touchStart", (middle[0] - 30, middle[1]), (middle[0] + 30, middle[1]))
    for apart in (40, 60):
        touch("touchMove", (middle[0] - apart, middle[1]), (middle[0] + apart, middle[1]))
    touch("touchEnd")
    assert phone.read("viewer.stage.camera.scale") > 1.3 * scale
    time.sleep(0.2)
    assert abs(int((room.session.colony.snapshot().ground == OBSTACLE).sum()) - rocks) <= 1
    assert phone.read("document.documentElement.scrollWidth") == 390
    phone.close()


def test_every_control_is_reached_by_keyboard_and_has_a_name(page):
    open_new(page)
    reached = {}
    page.tab.focus("#theme")
    for _ in range(90):
        page.tab.keyboard.press("Tab")
        name, label, outlined = page.read(
            """() => { const it = document.activeElement, line = getComputedStyle(it);
              const tool = it.dataset.tool ?? it.dataset.export;
              const words = it.getAttribute("aria-label") || it.labels?.[0]?.innerText;
              return [it.id || tool || it.tagName, words || it.innerText,
                      line.outlineStyle !== "none" && parseFloat(line.outlineWidth) >= 1]; }"""
        )
        reached[name] = label and outlined
    for control in (
        *("world-name", "task", "policy", "ants", "episode", "seed", "begin", "restart"),
        *("set-epsilon", "set-ants", "next-episode", "session", "load", "page", "gif", "policy"),
        *("colony", "quit", "look", "rock", "queen", "play", "speed", "help-button", "world"),
        *("zoom-in", "zoom-out", "fit", "forward", "time"),
    ):
        assert control in reached
    del reached["BODY"]
    assert [name for name, good in reached.items() if not good] == []
