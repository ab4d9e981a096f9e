"""The live page in a real browser: each control, and worlds that equal the engine's."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Page, assert_policy_holds, printed, shares, started
from command_lines import crowding
from rooms import CHOSEN, Guest, running

from taichi_ants import Colony, TrainingConfig, World, load_policy
from taichi_ants.commands import watch
from taichi_ants.learners.expected_sarsa import EXPECTED_SARSA
from taichi_ants.learners.policies import Policy, trail_follower
from taichi_ants.live.choices import Choices
from taichi_ants.live.server import SessionServer
from taichi_ants.live.session import Log, Session
from taichi_ants.live.setup import MOST_ANTS, Setup
from taichi_ants.task import Labour, foraging
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds import to_text

pytestmark = pytest.mark.browser

WORLD = """() => {
  const { history } = viewer, moment = history.length - 1, frame = history.frames[moment];
  const { ground, trail } = history.worldAt(moment);
  return { ground: [...ground], trail: [...trail], cells: [...frame.cells].sort((a, b) => a - b),
           loaded: frame.poses.reduce((sum, pose) => sum + (pose >> 3 & 1), 0),
           tick: frame.tick, deliveries: frame.deliveries };
}"""

# Whether the session is there for which the page has asked.
BEGUN = "!live.stands && !live.begins && viewer.history.length === 1"
LINES = """[...document.querySelectorAll(".curve .line")].map((line) => line.getAttribute("d"))"""


@pytest.fixture(scope="module")
def browser():
    with started() as one:
        yield one


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


def world_of(room) -> dict:
    """What `WORLD` is in the engine."""
    colony = room.session.colony
    snapshot = colony.snapshot()
    return {
        "ground": snapshot.ground.tolist(),
        "trail": snapshot.trail.tolist(),
        "cells": sorted(snapshot.ant_cells.tolist()),
        "loaded": int(snapshot.ant_carries.sum()),
        "tick": colony.ticks,
        "deliveries": int(colony.outcome().deliveries[0, 0]),
    }


def assert_same(page: Page, room) -> None:
    """What the page has is what the engine has, once time stands still there too."""
    while room.playing:
        time.sleep(0.01)
    for _ in range(100):
        if page.read(WORLD) == world_of(room):
            break
        time.sleep(0.1)  # what has changed is on its way
    assert page.read(WORLD) == world_of(room)


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


def test_episodes_go_by_as_fast_as_they_can(page, room):
    page.tab.fill("#speed", "100")
    assert page.text("#speed-value") == "fastest"
    page.tab.click("#play")
    wait(page, "viewer.history.frames.at(-1).episode >= 3")
    page.tab.click("#play")
    wait(page, "!live.running")
    assert_same(page, room)
    assert page.read("viewer.history.frames.at(-1).episode") == room.session.colony.episode
    assert room.speed == 1000
    page.tab.keyboard.press("ArrowDown")
    wait(page, "live.speed < 1000")


def test_an_ant_is_followed_and_explained(page, room):
    page.tab.focus("#world")
    page.press("n")
    assert "It has not acted yet." in page.text("#ant")
    page.click("#forward")
    wait(page, "document.querySelector('#ant').innerText.includes('In the last tick')")
    said = page.text("#ant")
    assert "Chooses" in said
    assert "TD error" in said
    page.tab.fill("#speed", "100")
    page.tab.click("#play")
    wait(page, "viewer.history.frames.at(-1).episode >= 2")
    page.tab.click("#play")
    wait(page, "!live.running && viewer.history.frames.at(-1).acts.length === 0")
    if page.read("viewer.history.frames.at(-1).tick"):
        assert "At this speed, actions are not shown." in page.text("#ant")


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


def test_several_nests_are_shown_and_the_nearest_queen_moves(browser, shared):
    world = World((7, 7, 7), [(0, 6, 0), (6, 0, 3)], [(0, 0, 5), (1, 0, 5)])
    with Guest(shared) as guest:
        guest.ask("begin", chosen={**CHOSEN, "world": "map", "map": to_text(world)})
        guest.until("whole")
    page = Page(browser, shared.url)
    try:
        page.press("Shift+ArrowRight")
        wait(page, "viewer.history.frames.at(-1).tick === 10")
        assert_same(page, shared)
        colony = shared.session.colony
        queens = page.read("[...viewer.history.frames.at(-1).queens]")
        assert queens == colony.snapshot().queens.tolist()
        nests = page.read("[...viewer.history.frames.at(-1).poses].map((pose) => pose >> 4)")
        assert sorted(nests) == sorted(colony.nests[0, colony.living[0]].tolist())
        assert page.text("#legend").endswith("trail nest 0 nest 1")
        far = colony.grid.distances((6, 0, 3))
        free = [c for c in np.flatnonzero(far == 1) if shared.session.interventions.is_empty(c)]
        page.press("7")
        page.read("cell => viewer.chooseCell(cell, true)", int(free[0]))
        page.tab.focus("#world")
        page.tab.keyboard.press("Enter")
        (edit,) = edits(shared, 1)
        assert edit == {"place": {"what": "queen", "nest": 1, "cells": [int(free[0])]}}
        assert_same(page, shared)
        assert colony.snapshot().queens.tolist() == [queens[0], int(free[0])]
    finally:
        page.close()


def test_a_field_is_shown_and_drawn(browser):
    task = foraging().replace(
        fields={"home": {"deposited_when": "without_food", "level": 90}}, homing_cue="home"
    )
    learner = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.9)
    setup = Setup("paper", task, learner, 12, pheromone="home")
    with running(Choices({}), setup=setup) as room:
        page = Page(browser, room.url)
        try:
            page.press("Shift+ArrowRight")
            wait(page, "viewer.history.frames.at(-1).tick === 11")
            colony = room.session.colony
            for _ in range(50):
                shown = page.read(WORLD)["trail"]
                if shown == colony.snapshot().fields["home"].tolist():
                    break
                time.sleep(0.1)
            assert shown == colony.snapshot().fields["home"].tolist()
            assert max(shown) > 0
            assert "home" in page.text("#legend")
            there = cell_of(room, 5, 4, 0)
            page.press("4")
            page.read("cell => viewer.chooseCell(cell, true)", there)
            page.tab.focus("#world")
            page.tab.keyboard.press("Enter")
            (edit,) = edits(room, 1)
            assert edit == {"trail": {"level": 90, "cells": [there], "field": "home"}}
        finally:
            page.close()


def test_castes_and_kinds_of_food_are_shown_and_drawn(browser):
    task = foraging().replace(
        castes={"nurse": {"threshold": 5.0}, "scout": {"share": 0.5}},
        foods={"seed": {}, "sap": {"loads": 3}},
        labour=Labour("thresholds", demand=1.0, relief=1, stop_probability=0.1),
    )
    learner = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.9)
    with running(Choices({}), setup=Setup("paper", task, learner, 12)) as room:
        page = Page(browser, room.url)
        try:
            page.press("Shift+ArrowRight")
            wait(page, "viewer.history.frames.at(-1).tick === 11")
            assert_same(page, room)
            colony = room.session.colony
            legend = page.text("#legend")
            assert all(name in legend for name in ("seed", "sap", "idle ant"))
            slot = int(np.flatnonzero(colony.castes[0] == 1)[0])
            page.read("number => viewer.follow(number)", int(colony.numbers[0, slot]))
            page.settle()
            assert page.text("#ant .groups") == "scout"
            assert page.tab.is_hidden("#kind")
            page.press("3")
            assert page.tab.is_visible("#kind")
            page.tab.select_option("#kind", "sap")
            there = cell_of(room, 5, 4, 0)
            page.read("cell => viewer.chooseCell(cell, true)", there)
            page.tab.focus("#world")
            page.tab.keyboard.press("Enter")
            (edit,) = edits(room, 1)
            assert edit == {"place": {"what": "food", "cells": [there], "kind": "sap"}}
            wait(page, "viewer.history.worldAt(viewer.history.length - 1).kinds.includes(1)")
            page.settle()
            assert "sap" in page.text("#cell")
            assert page.read("cell => viewer.stage.foods[1].includes(cell)", there)
        finally:
            page.close()


def test_a_change_is_undone_and_the_session_before_comes_back(page, room):
    page.press("Shift+ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    assert page.tab.is_disabled("#undo")
    assert page.tab.is_hidden("#go-back") == (room._former is None)
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


def test_undo_undoes_what_was_done_a_moment_ago(page, room):
    """Before the page has sent the change, or been told that there is something to undo."""
    undo = "dispatchEvent(new KeyboardEvent('keydown', {key: 'z', ctrlKey: true, bubbles: true}))"
    slid = "(slider.value = 0.5, slider.dispatchEvent(new Event('input', {bubbles: true})))"
    epsilon = room.session.colony.epsilon
    page.read(f"(slider => ({slid}, slider.{undo}))(byId('set-epsilon'))")
    wait(page, BEGUN)
    assert room._former.edits == [(0, {"epsilon": {"value": 0.5}})]
    assert room.session.colony.epsilon == epsilon
    page.press("2")
    page.read(f"live.tools.down({cell_of(room, 5, 5, 0)}), document.body.{undo}")
    wait(page, BEGUN)
    assert [name for _, edit in room._former.edits for name in edit] == ["place"]
    assert_same(page, room)
    page.tab.click("#play")
    wait(page, "live.running")
    page.read(f"document.body.{undo}")
    wait(page, "byId('toast').textContent.startsWith('There is nothing to undo')")
    wait(page, "live.running")  # time passes all the same
    assert room.playing
    page.tab.click("#play")
    wait(page, "!live.running")


def test_fields_and_sliders_are_those_of_the_session_that_comes_back(page, room):
    page.tab.fill("#set-epsilon", "0.5")
    edits(room, 1)
    page.press("Control+z")  # while the slider is still held
    wait(page, BEGUN)
    wait(page, f"Number(byId('set-epsilon').value) === {room.session.colony.epsilon}")
    open_new(page)
    page.tab.select_option("#policy", "file mine")
    page.click("#begin")
    wait(page, "byId('now-chosen').textContent.endsWith('mine')")
    assert page.tab.is_disabled('[data-path="task.observation"]')
    page.click("#go-back")
    wait(page, "byId('policy').value.startsWith('learn ')")
    assert page.tab.is_enabled('[data-path="task.observation"]')
    page.click("#go-back")
    wait(page, "byId('policy').value === 'file mine'")
    assert page.tab.is_disabled('[data-path="task.observation"]')


def test_what_is_in_sight_stays_there_when_a_change_is_undone(page, room):
    looks = "[viewer.stage.camera, viewer.stage.fitted, viewer.followed, viewer.aims, viewer.cell]"
    page.read("viewer.follow(2), viewer.stage.zoom(2), viewer.stage.pan(20, 10)")
    page.read(f"viewer.chooseCell({cell_of(room, 5, 5, 0)})")
    before = page.read(looks)
    page.tab.fill("#set-epsilon", "0.5")
    edits(room, 1)
    page.press("Control+z")
    wait(page, BEGUN)
    assert room.session.edits == []
    assert page.read(looks) == before
    assert not page.tab.is_hidden("#ant")
    with Guest(room) as guest:  # in another world there is another thing to see
        guest.ask("begin", chosen={**CHOSEN, "world": "far_piles", "size": 20})
        wait(page, "viewer.history.grid.ranges[0] === 20")
    assert page.read("viewer.stage.fitted && viewer.followed < 0 && viewer.cell < 0")


def test_a_stroke_of_a_large_brush_is_drawn_without_holes(page, room):
    page.press("2", "]", "]", "[")
    page.tab.mouse.move(*place(page, cell_of(room, 6, 1, 0)))
    assert page.read("viewer.tool.cells().length") == 7
    page.tab.mouse.down()
    page.tab.mouse.move(*place(page, cell_of(room, 1, 6, 0)))  # in one leap
    page.tab.mouse.up()
    wait(page, "live.tools.fresh.size === 0")
    edits(room, 1)
    ground = room.session.colony.snapshot().ground
    line = [cell_of(room, 6 - k, 1 + k, 0) for k in range(6)]
    around = [cell + o for cell in line for o in (0, *page.read("viewer.history.grid.offsets"))]
    taken = set(room.session.colony.snapshot().ant_cells.tolist())
    assert all(ground[cell] == OBSTACLE for cell in around if cell not in taken)
    assert_same(page, room)
    camera = page.read("viewer.stage.camera")
    page.press("1")
    x, y = place(page, line[2])
    page.tab.mouse.move(x, y)
    page.tab.mouse.down()
    page.tab.mouse.move(x + 60, y, steps=3)
    page.tab.mouse.up()
    assert page.read("viewer.stage.camera") != camera  # who only looks moves the view


def test_sliders_change_the_colony(page, room):
    shown = page.read("Object.keys(live.state.values)")
    assert set(shown) == set(room.session.values())
    for name, value in [("epsilon", 0.5), ("learning_rate", 0.25), ("ants", 20), ("slope", 30)]:
        page.tab.fill(f"#set-{name}", str(value))
        edits(room, 1)
        wait(page, f"live.state.values['{name}'].value === {value}")
        sent = {"ants": {"ants": {"number": 20}}, "slope": {"task": {"pheromone.slope": 30}}}
        assert room.session.edits[-1][1] == sent.get(name, {name: {"value": value}})
    assert room.session.colony.epsilon == 0.5
    page.tab.uncheck("#set-evaporation")
    wait(page, "live.state.values.evaporation.value === 0")
    page.click("#forward")
    wait(page, "viewer.history.frames.at(-1).tick === 1")
    assert_same(page, room)
    page.click("#next-episode")
    wait(page, "viewer.history.frames.at(-1).episode === 1")
    page.click("#restart")
    wait(page, "viewer.history.length === 1")
    assert room.session.ticks == 0
    assert room.session.edits == []


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


def test_who_fills_the_form_goes_on_while_others_begin_a_session(page, room):
    open_new(page)
    page.tab.select_option("#world-name", "open")
    page.tab.fill("#size", "33")
    page.tab.click("#settings-box summary")
    page.tab.check('[data-path="task.life.births"]')
    with Guest(room) as other:
        other.ask("begin", chosen={**CHOSEN, "ants": 7})
        other.until("whole")
    wait(page, "live.state.values.ants.value === 7")
    assert page.text("#now-chosen").startswith("the paper")
    assert page.tab.input_value("#world-name") == "open"
    assert page.tab.input_value("#size") == "33"
    assert page.tab.is_checked('[data-path="task.life.births"]')
    page.click("#begin")
    wait(page, "viewer.history.grid.ranges[0] === 33")
    assert room.session.setup.task.life.births
    with Guest(room) as other:  # what has begun is not half filled
        other.ask("begin", chosen=CHOSEN)
        other.until("whole")
    wait(page, "viewer.history.grid.ranges[0] < 33")
    assert page.tab.input_value("#world-name") == "paper"


def test_a_long_map_is_pasted_at_once(page, room):
    open_new(page)
    page.tab.select_option("#world-name", "map")
    most, lines = room.choices.as_dict()["most"]["text"], 4000
    page.tab.fill("#map", "Q . .\n" + ". . .\n" * (lines - 1), timeout=3000)
    assert page.tab.input_value("#map").count("\n") == lines
    page.tab.focus("#map")
    page.tab.keyboard.insert_text("x" * most)
    page.tab.wait_for_selector("#toast.bad:not([hidden])")
    assert len(page.tab.input_value("#map")) == most
    page.tab.fill("#map", "Q F 0\n")
    assert page.tab.input_value("#map") == "Q F 0\n"


def test_all_pages_see_how_far_a_replay_is(page, browser, room, tmp_path):
    page.press("Shift+ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    before, log = room.session, room.session.log()
    replace(log, steps=10**8, ticks=10**8).write(tmp_path / "endless.npz")
    page.tab.set_input_files("#upload", tmp_path / "endless.npz")
    late = Page(browser, room.url, (390, 844), has_touch=True)
    assert_same(late, room)
    for one in (page, late):
        wait(one, "document.querySelector('#works progress')?.value > 0")
        assert one.text("#works span").endswith(" of 100 000 000 ticks")
        assert one.read("document.querySelector('.controls').inert")
    late.tab.click("#works button")
    for one in (page, late):
        wait(one, "!document.querySelector('#works progress')")
        assert not one.read("document.querySelector('.controls').inert")
    assert room.session is before
    page.click("#forward")
    assert_same(page, room)
    late.close()


def test_a_file_that_is_made_shows_how_far_it_is(page, room, tmp_path):
    page.press("Shift+ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    replace(room.session.log(), steps=10**8, ticks=10**8).write(tmp_path / "endless.npz")
    room.session.log = lambda: Log.read(tmp_path / "endless.npz")
    page.tab.click('[data-export="gif"]')
    page.tab.wait_for_selector("#works progress")
    assert page.text("#works span").startswith("Making the GIF")
    page.tab.click("#works button")
    wait(page, "!document.querySelector('#works progress')")
    assert page.text("#toast") == "Cancelled."


def test_the_panel_tells_of_the_moment_that_is_drawn(page, room):
    page.tab.fill("#speed", "100")
    page.tab.click("#play")
    wait(page, "viewer.history.length > 20")
    # As the screen shows it, between two frames of the page.
    told = """new Promise((done) => requestAnimationFrame(() => setTimeout(() => done(
        [viewer.panelTells, Number(viewer.stage.shown.split(" ")[0])]))))"""
    agree = [one == other for one, other in (page.read(told) for _ in range(20))]
    assert sum(agree) > 10 / crowding()  # where it costs too much, the panel may be a moment behind
    page.tab.click("#play")
    wait(page, "!live.running")
    page.settle()
    told, drawn = page.read(told)
    assert told == drawn
    facts = page.read(
        "Object.fromEntries([...document.querySelectorAll('#now div')]"
        ".map((one) => [one.children[0].innerText, one.children[1].innerText]))"
    )
    assert int(facts["tick"]) == page.read("viewer.history.frames[viewer.player.moment].tick")


def test_a_page_that_waits_says_so(browser, room, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(room, "_turn", lambda: time.sleep(0.01))  # as while a large world is drawn
        time.sleep(0.3)
        context = browser.new_context(bypass_csp=True)
        tab = context.new_page()
        tab.goto(room.url)
        assert tab.inner_text("#toast") == "Waiting for the simulation …"
        assert tab.evaluate("document.querySelector('.controls').inert")
    tab.wait_for_function("window.viewer")
    assert tab.is_hidden("#toast")
    assert not tab.evaluate("document.querySelector('.controls').inert")
    context.close()


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


def test_a_page_that_was_cut_off_says_why(browser, room):
    page = Page(browser, room.url)
    page.read("live.ask('edit')")
    wait(page, "document.querySelector('#lost').innerText.includes('an edit has to be')")
    assert page.tab.is_disabled("#play")
    page.tab.click("#again")
    wait(page, "live.open && byId('lost').hidden && !byId('play').disabled")
    page.close()


def test_files_are_saved_and_loaded(page, room, tmp_path):
    page.press("Shift+ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    for kind in ("session", "page", "gif", "policy", "colony"):
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


def test_pages_look_on_together(page, browser, room):
    page.click("#forward")
    late = Page(browser, room.url, color_scheme="dark")
    assert_same(late, room)
    late.click_cell(cell_of(room, 5, 5, 0))
    late.press("2", "Enter")
    edits(room, 1)
    assert_same(late, room)
    assert_same(page, room)
    wait(page, "document.querySelector('#watchers').innerText === '2 pages show this session'")
    page.tab.click("#play")
    wait(late, "live.running && viewer.player.playing")
    late.tab.click("#play")
    wait(page, "!live.running")
    late.close()


def test_a_page_that_was_slow_sees_all_again(page, room):
    page.read("() => { live.seen = () => {}; }")  # as if it drew nothing
    for _ in range(4):
        page.tab.keyboard.press("Shift+ArrowRight")
    wait(page, "live.state.ticks >= 40")
    assert page.read("viewer.history.frames.at(-1).tick") < 40
    page.read("() => { delete live.seen; viewer.dirty = true; }")
    wait(page, "viewer.history.frames.at(-1).whole")
    assert_same(page, room)
    back = page.read("viewer.history.length") - 3
    page.read("moment => viewer.player.go(moment)", back)
    page.read("viewer.history.worldAt(0)")
    page.press("End")
    assert_same(page, room)


def test_a_long_history_forgets_its_beginning(page, room):
    page.read("() => { viewer.history.bytes += 2 ** 27 - 8000; }")
    for ticks in range(10, 50, 10):
        page.tab.keyboard.press("Shift+ArrowRight")
        wait(page, f"viewer.history.frames.at(-1).tick === {ticks}")
    wait(page, "viewer.history.first > 0")
    page.press("Home")
    first = page.read("viewer.history.first")
    assert page.moment == first > 0
    page.press("End")
    assert_same(page, room)


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
        *("colony", "quit", "look", "rock", "queen", "play", "speed"),
    ):
        assert control in reached
    del reached["BODY"]
    assert [name for name, good in reached.items() if not good] == []


def test_the_page_ends_with_the_server(browser, shared):
    with running(shared.choices) as one:
        page = Page(browser, one.url)
        page.tab.click("#quit")
        page.tab.click("#quit")
        wait(page, "document.querySelector('#lost').innerText.startsWith('The server has stopped')")
        assert page.tab.is_disabled("#play")
        page.faults.clear()  # it tries to connect again
        page.close()


def test_a_page_whose_connection_was_lost_goes_on_by_itself(page, room):
    page.press("Shift+ArrowRight")
    wait(page, "viewer.history.frames.at(-1).tick === 10")
    known = page.read("viewer.history.length")
    # Looked at in the page, which may connect again before a test could ask.
    assert page.read("""() => new Promise((done) => {
      const look = () => byId('lost').hidden || done(byId('play').disabled);
      new MutationObserver(look).observe(byId('lost'), { attributes: true });
      live.socket.close();
    })""")
    with Guest(room) as other:  # time passes meanwhile
        other.ask("step", ticks=5)
    wait(page, "live.open && byId('lost').hidden && viewer.history.frames.at(-1).tick === 15")
    assert page.read("viewer.history.length") == known + 1
    assert_same(page, room)
    page.click("#forward")
    wait(page, "viewer.history.frames.at(-1).tick === 16")
    assert_same(page, room)


def test_a_page_keeps_what_it_has_when_the_server_is_killed(browser, shared, tmp_path):
    world = """moment => { const { ground, trail } = viewer.history.worldAt(moment);
      const ant = viewer.history.ant(moment, 3);
      return [[...ground], [...trail], [...viewer.history.frames[moment].cells], ant]; }"""
    with running(shared.choices) as one:
        port, token = one.port, one.token
        page = Page(browser, one.url, accept_downloads=True)
        for ticks in (11, 21, 31, 41):
            page.press("Shift+ArrowRight")
            wait(page, f"viewer.history.frames.at(-1).tick === {ticks}")
        page.read("() => { viewer.history.bytes += 2 ** 27; }")  # it forgets its beginning
        page.press("ArrowRight")
        wait(page, "viewer.history.first > 0 && viewer.history.frames.at(-1).tick === 42")
        page.read("live.socket.close()")  # so that a later moment is whole, too
        page.tab.wait_for_selector("#lost:not([hidden])")
        wait(page, "live.open && byId('lost').hidden")
        page.press("ArrowRight")
        wait(page, "viewer.history.frames.at(-1).tick === 43")
    page.tab.wait_for_selector("#lost:not([hidden])")
    with page.tab.expect_download() as got:
        page.tab.click("#keep")
    got.value.save_as(tmp_path / "kept.html")
    assert_policy_holds(browser, tmp_path / "kept.html")
    first, length = page.read("[viewer.history.first, viewer.history.length]")
    kept = Page(browser, tmp_path / "kept.html")
    assert kept.read("viewer.history.length") == length - first
    for moment in range(first, length):
        one, other = kept.read(world, moment - first), page.read(world, moment)
        if moment == first:  # what was drawn ahead, in a moment before, is not known any more
            one[-1]["act"] = other[-1]["act"] = None
        assert one == other, moment
    assert kept.read("document.querySelector('.controls, .palette, #lost')") is None
    kept.close()
    other = SessionServer(Session(shared.choices.setup(CHOSEN)), shared.choices, port)
    other.token = token
    thread = threading.Thread(target=other.run, daemon=True)
    thread.start()
    wait(page, "byId('lost').innerText.includes('another session')")
    assert page.read("viewer.history.length") == length  # nothing is taken from it
    page.tab.click("#again")
    wait(page, "byId('lost').hidden && viewer.history.length === 1")
    assert_same(page, other)
    other.end()
    thread.join()
    page.faults.clear()  # Chromium tells of each attempt in vain
    page.close()


def test_the_page_says_that_ants_move_aside(page, room):
    cells = room.session.colony.snapshot().ant_cells.tolist()
    assert "ants in the way move aside" in page.tab.get_attribute('[data-tool="rock"]', "title")
    page.press("2")
    page.tab.mouse.click(*place(page, cells[3]))
    wait(page, "byId('toast').innerText === '1 ant moved aside.'")
    edits(room, 1)
    assert room.session.colony.snapshot().ground[cells[3]] == OBSTACLE
    assert len(room.session.colony.snapshot().ant_cells) == len(cells)
    assert_same(page, room)


def test_the_form_takes_as_many_ants_as_a_session_can_have(page):
    assert page.tab.get_attribute("#ants", "max") == str(MOST_ANTS)


# Elements beyond the sides of their card, and words that do not fit into their button or label.
OVERFLOWING = """() => [...document.querySelectorAll(".card, .bar, .transport, .palette")].flatMap((card) => {
  const { left, right, width } = card.getBoundingClientRect();
  return !width ? [] : [...card.querySelectorAll(":not(.unseen, .unseen *, svg *)")].filter((one) => {
    const box = one.getBoundingClientRect();
    const cut = one.matches("button, label, h2, dd, output, summary") && one.clientWidth
      && (one.scrollWidth > one.clientWidth + 1 || one.scrollHeight > one.clientHeight + 2);
    return box.width && (box.right > right + 1 || box.left < left - 1 || cut);
  }).map((one) => one.outerHTML.slice(0, 120)); })"""  # noqa: E501


@pytest.mark.parametrize("width", [390, 1024, 1440])
def test_nothing_leaves_its_card(browser, room, width):
    opened = Page(browser, room.url, (width, 800), has_touch=width < 500)
    assert opened.read(OVERFLOWING) == []
    open_new(opened)
    opened.tab.click("#settings-box > summary")
    opened.read("document.querySelectorAll('.help').forEach((one) => one.click())")
    assert opened.read(OVERFLOWING) == []
    assert opened.read("document.documentElement.scrollWidth") == width
    opened.close()


def test_every_setting_has_help_for_fingers_and_keys(browser, room):
    phone = Page(browser, room.url, (390, 844), has_touch=True)
    declared = {one["path"]: one["help"] for one in phone.read("live.choices.settings")}
    slider = phone.tab.locator("#sliders .field", has=phone.tab.locator("#set-slope"))
    assert not slider.locator("small").is_visible()
    slider.locator(".help").tap()
    assert slider.locator("small").inner_text() == declared["task.pheromone.slope"]
    assert slider.locator(".help").get_attribute("aria-expanded") == "true"
    slider.locator(".help").press("Enter")
    assert not slider.locator("small").is_visible()
    open_new(phone)
    phone.tab.click("#settings-box > summary")
    boxes = phone.tab.locator("#new :is(.setting, .field):visible").all()
    assert len(boxes) > 30
    for box in boxes:
        button = box.locator(".help").bounding_box()
        assert min(button["width"], button["height"]) >= 26  # large enough for a finger
        assert box.locator("small").text_content()
    sees = phone.tab.locator(".setting", has=phone.tab.locator("[data-path='task.observation']"))
    assert (
        sees.locator("small")
        .text_content()
        .endswith("the three cells ahead, distinguishing ants with the other load from rocks")
    )
    phone.close()


def test_a_sentence_and_three_cards_say_what_to_try(page, room):
    assert page.text("#sees") == (
        "Ants search for food and carry it to their queen, and lay trails that other ants can "
        "follow."
    )
    page.tab.focus("[data-try=wall]")
    page.tab.keyboard.press("Enter")
    assert page.tab.get_attribute("[data-tool=rock]", "aria-pressed") == "true"
    assert page.read("document.activeElement.id") == "world"
    assert page.read(WORLD)["trail"] != [0] * room.session.colony.grid.size
    page.click("[data-try=trail]")
    edits(room, 1)
    assert not room.session.colony.snapshot().trail.any()
    wait(page, "!viewer.history.worldAt(viewer.history.length - 1).trail.some((one) => one > 0)")
    page.tab.click("#undo")
    wait(page, "viewer.history.worldAt(viewer.history.length - 1).trail.some((one) => one > 0)")
    assert room.session.values()["evaporation"]["value"] == 1
    page.click("[data-try=rule]")
    edits(room, 1)
    assert room.session.values()["evaporation"]["value"] == 0
    assert "trails do not evaporate" in page.text("#toast")


def test_the_page_is_printed_with_its_world(browser, room, tmp_path):
    dark = Page(browser, room.url, color_scheme="dark")
    text, sheets = printed(dark.tab, tmp_path)
    light = dark.read(
        "() => { viewer.wear('light'); const { colours } = viewer.stage;"
        " return [colours.empty, colours.queen]; }"
    )
    empty, queen = shares(sheets, *light)
    assert empty > 0.05
    assert queen > 5e-5
    assert "delivered" in text
    assert "observation" in text  # the card about the session is open
    assert "Start session" not in text
    assert "Try this" not in text
    dark.close()


def test_play_is_among_the_first_that_tab_reaches(page):
    page.tab.reload()
    page.tab.wait_for_function("window.viewer")
    page.press("Tab")
    assert page.read("document.activeElement.innerText") == "Skip to Play"
    page.press("Enter")
    assert page.read("document.activeElement.id") == "play"


def test_it_stays_at_thirty_frames_a_second(page, room, record_property):
    page.tab.fill("#speed", "60")
    page.tab.click("#play")
    wait(page, "viewer.history.length > 30")
    frames, began = page.read("[viewer.history.length, performance.now()]")
    time.sleep(3)
    later, ended = page.read("[viewer.history.length, performance.now()]")
    rate = 1000 * (later - frames) / (ended - began)
    record_property("frames_a_second", rate)
    print(f"{rate:.0f} frames a second")
    page.tab.click("#play")
    wait(page, "!live.running")
    assert rate > 20 / crowding()  # of 30


def test_curves_are_over_time_and_a_late_page_has_them(page, browser, room):
    """A point for the return of each episode, and ticks over all of them as the axis."""
    page.tab.fill("#speed", "100")
    page.tab.click("#play")
    wait(page, "viewer.history.frames.at(-1).episode >= 4")
    page.tab.click("#play")
    wait(page, "!live.running")
    page.settle()
    late = Page(browser, room.url)
    session = room.session
    for one in (page, late):
        assert one.read("viewer.history.frames.at(-1).ticks") == session.ticks
        assert one.tab.get_attribute("#time", "max") == str(session.ticks)
        assert one.tab.get_attribute("#time", "min") == "0"
        names = one.tab.locator(".curve .label span").all_inner_texts()
        assert names == ["delivered in total", "return per episode", "epsilon"]
        assert "delivered this episode" in one.text("#now")
        lines = [
            [float(point.split()[0]) for point in line.removesuffix("h0").lstrip("M").split("L")]
            for line in one.read(LINES)
        ]
        ended = 50 * np.arange(1, session.colony.episode + 1) / session.ticks * 100
        assert np.abs(ended[:, None] - lines[1]).min(axis=0).max() < 0.01
        if len(ended) < 500:  # a longer one is thinned
            assert len(lines[1]) == len(ended)
        for line in lines:
            assert line == sorted(line)
        assert (lines[0][0], lines[0][-1]) == (0, 100)
    late.close()


def test_play_pressed_while_a_session_begins_is_kept(page, room):
    page.tab.click("#play")
    wait(page, "live.running")
    open_new(page)
    page.read("""() => {
      [window.told, window.old] = [[], viewer];
      const note = ({ detail }) => told.push(...detail.works.map((one) => one.kind));
      live.news.addEventListener("state", note);
    }""")
    page.tab.click("#begin")
    page.tab.click("#play")
    wait(page, "viewer !== old && viewer.history.frames.at(-1).tick > 2")
    assert page.tab.get_attribute("#play", "aria-label") == "Pause"
    assert "kernels" in page.read("told")
    page.tab.click("#play")
    wait(page, "!live.running")
