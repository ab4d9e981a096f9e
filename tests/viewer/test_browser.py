"""The page in a real browser: each control, and values that equal the engine's."""

from __future__ import annotations

import base64
import math
import re
from itertools import pairwise

import numpy as np
import pytest
from browser import Page, assert_policy_holds, printed, shares, started
from command_lines import crowding
from playback import played

from taichi_ants import Colony, Task, TrainingConfig, World, trace_training, worlds
from taichi_ants.learners.policies import trail_follower
from taichi_ants.rendering import Episode
from taichi_ants.task import Caste, Food, Labour, Life, Pheromone, Threshold, foraging
from taichi_ants.task.constants import ACTION_NAMES, FOOD
from taichi_ants.task.events import Event
from taichi_ants.viewer import Recording, page, record_colony, record_episode, record_trace
from taichi_ants.viewer.page import SCRIPTS, part

pytestmark = pytest.mark.browser

MINUS = "\N{MINUS SIGN}"  # as the page writes it


@pytest.fixture(scope="module")
def browser():
    with started() as one:
        yield one


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pages")


def written(folder, name: str, recording: Recording):
    path = folder / f"{name}.html"
    path.write_text(page(recording), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def episode(folder):
    """The paper's, and its trace."""
    one = Episode.play(worlds.paper(), trail_follower())
    return written(folder, "episode", record_episode(one, "the paper's ant")), one.trace


@pytest.fixture(scope="module")
def colony(folder):
    """Ants that are born, die and learn from each other, on trails that halve and spread."""
    rules = Task(
        pheromone=Pheromone("exponential", half_life=20, diffusion=0.1),
        evaporation_in_training=True,
        life=Life(births=True, lifespan=60, regrowth=9),
    )
    world = worlds.open_world(4, (12, 12, 12))
    many = Colony(world, rules, TrainingConfig("q_learning", 0.2, 0.9, 0.2, 1.0), 3, ants=25)
    many.begin_episode()
    recording = record_colony(many, 90, title="a crowd")
    return written(folder, "colony", recording), list(played(recording)), recording


@pytest.fixture
def ant(browser, episode):
    opened = Page(browser, episode[0])
    yield opened
    opened.close()


@pytest.fixture
def crowd(browser, colony):
    opened = Page(browser, colony[0])
    yield opened
    opened.close()


STATE = """moment => {
  const { ground, trail } = viewer.history.worldAt(moment), frame = viewer.history.frames[moment];
  return { ground: [...ground], trail: [...trail], cells: [...frame.cells],
           poses: [...frame.poses], numbers: [...frame.numbers], states: [...frame.states] };
}"""


def test_worlds_on_the_page_are_those_of_the_engine(crowd, colony):
    """Forwards, backwards, and with jumps; to the last bit of levels that halve and spread."""
    moments = colony[1]
    rng = np.random.default_rng(0)
    for number in [0, 1, 2, 90, 40, 39, 3, *rng.integers(0, 91, 8).tolist()]:
        shown, true = crowd.read(STATE, number), moments[number]
        assert shown["ground"] == true.ground.tolist()
        assert np.array_equal(np.array(shown["trail"], np.float32), true.trail)
        assert shown["numbers"] == true.numbers.tolist()
        assert shown["cells"] == true.cells.tolist()
        assert shown["poses"] == (true.headings + 8 * true.loaded).tolist()
        assert shown["states"] == true.states.tolist()
    crowd.read(
        "viewer.history.kept = []; viewer.history.keepEvery = 1; viewer.history.mostKept = 8"
    )
    for number in (90, 5, 66):  # copies are thinned out, and still right
        assert crowd.read(STATE, number)["ground"] == moments[number].ground.tolist()


def test_ants_on_the_page_do_what_those_of_the_engine_do(crowd, colony):
    """Every ant of every tick: choice, why, reward, TD error, and how its table entry moved."""
    whole = crowd.read(
        """() => viewer.history.frames.slice(0, -1).map((frame, moment) =>
             [...frame.numbers].map((number) => viewer.history.ant(moment, number)))"""
    )
    rewards = Task().rewards.by_event()
    seen = set()
    for shown, (before, after) in zip(whole, pairwise(colony[1]), strict=True):
        for place, one in enumerate(shown):
            state, action = int(before.states[place]), int(after.actions[place])
            act, values = one["act"], before.row(state, 128)
            assert one["state"] == state
            assert np.array_equal(np.array(one["values"], np.float32), values)
            assert (act["action"], Event[act["event"]]) == (action, after.events[place])
            assert act["reward"] == rewards[after.events[place]]
            best = np.flatnonzero(values == values.max())
            why = "explored" if action not in best else "tie" if len(best) > 1 else "best"
            assert act["why"] == why
            assert act["tdError"] == after.td_errors[place]
            assert (act["before"], act["after"]) == (values[action], after.row(state, 128)[action])
            pairs = zip(before.states.tolist(), after.actions.tolist(), strict=True)
            assert act["sharers"] == list(pairs).count((state, action))
            seen |= {why}
    assert seen == {"best", "tie", "explored"}


def test_a_followed_ant_is_explained(ant, episode):
    trace = episode[1]
    assert ant.read("viewer.followed") == 0
    for moment in (0, 16, 17, 33):
        ant.read("moment => viewer.player.go(moment)", moment)
        said = ant.text("#ant")
        action = ACTION_NAMES[trace.actions[moment]]
        reward = f"{trace.rewards[moment]:+d}".replace("+0", "0")
        assert f"state {trace.states[moment]} " in said
        assert f"Chooses {action} highest value" in said
        assert f"reward {reward}" in said
        assert "with food" in said if moment > 16 else "no food" in said
        values = ant.tab.locator(".bars .value").all_inner_texts()
        assert [float(text.replace(MINUS, "-")) for text in values] == [
            round(float(value), 2) for value in trace.q_values[moment]
        ]
        assert ant.tab.locator(".bars .name.is-chosen").inner_text() == f"▸ {action}"
        assert ant.read("viewer.history.path(viewer.player.moment, 0).length") == moment + 1 - (
            moment > 16
        )
    ant.press("End")
    assert "The recording ends here" in ant.text("#ant")
    assert ant.text("#now").startswith("tick 34 ants 1 with food 0 delivered 1 return 45")


def test_what_an_ant_learns_is_told(browser, folder):
    config = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99)
    trace = trace_training(worlds.paper(), config, seed=7, episodes=2, max_steps=60)
    one = Page(browser, written(folder, "trace", record_trace(trace)))
    for step in (0, 5, 30, 70):
        moment = step + int(trace.episodes[step])
        one.read("moment => viewer.player.go(moment)", moment)
        said, state = one.text("#ant").replace(MINUS, "-"), trace.states[step]
        (error,) = re.findall(r"TD error ([-+]?[\d.]+)", said)
        assert float(error) == pytest.approx(trace.td_errors[step], abs=0.0051)
        (now, then) = map(float, re.findall(r"([-\d.]+) → ([-\d.]+)", said)[0])
        action = trace.actions[step]
        assert now == pytest.approx(trace.q_values[step, action], abs=0.0051)
        assert then == pytest.approx(trace.tables[step, state, action], abs=0.0051)
        assert f"episode {trace.episodes[step]} tick {trace.steps[step]} " in one.text("#now")
    assert "episode 1" in one.text("#place")
    one.close()


def test_buttons_and_keys_move_through_time(ant):
    assert ant.tab.is_disabled("#back")
    for control, moment in [("#forward", 1), ("#last", 34), ("#back", 33), ("#first", 0)]:
        ant.click(control)
        assert ant.moment == moment, control
    ant.tab.click("#world", position={"x": 5, "y": 5})
    for key, moment in [
        *(("ArrowRight", 1), ("Shift+ArrowRight", 11), ("ArrowLeft", 10), ("End", 34)),
        *(("Shift+ArrowLeft", 24), ("Home", 0), ("ArrowLeft", 0)),
        *(("e", 16), ("e", 33), ("e", 33), ("Shift+E", 16)),
    ]:
        ant.press(key)
        assert ant.moment == moment, key


def test_it_plays_pauses_and_starts_again(ant):
    ant.tab.keyboard.press("Space")
    assert ant.tab.get_attribute("#play", "aria-label") in ("Play", "Pause")
    ant.tab.wait_for_function("viewer.player.moment >= 2")
    assert ant.tab.get_attribute("#play", "aria-label") == "Pause"
    ant.click("#play")
    stopped = ant.moment
    ant.tab.wait_for_timeout(200)
    assert ant.moment == stopped
    for _ in range(20):
        ant.tab.keyboard.press("ArrowUp")
    assert ant.read("viewer.player.speed") == 200
    assert ant.text("#speed-value") == "200 ticks/s"
    ant.click("#play")  # until its end
    assert ant.moment == 34
    ant.tab.keyboard.press("ArrowDown")
    assert ant.read("viewer.player.speed") == 160
    ant.tab.fill("#speed", "0")
    assert ant.read("viewer.player.speed") == 0.5
    ant.tab.keyboard.press("Space")
    assert ant.moment == 0
    ant.tab.keyboard.press("Space")
    ant.settle()


def test_the_time_line_and_the_curves_seek(ant):
    ant.tab.fill("#time", "21")
    ant.settle()
    assert ant.moment == 21
    assert ant.tab.get_attribute("#time", "aria-valuetext") == "tick 21"
    assert ant.text("#place") == "tick 21 of 34"
    box = ant.tab.locator(".curve svg").nth(1).bounding_box()
    ant.tab.mouse.click(box["x"] + box["width"] / 2, box["y"] + 10)
    ant.settle()
    assert ant.moment == 17
    events = ant.read("viewer.history.events.map(({ moment, kind }) => [moment, kind])")
    assert events == [[17, "PICKED_UP"], [34, "DELIVERED"]]
    assert ant.tab.locator("#events .picked").get_attribute("d").count("M") == 1
    assert ant.tab.locator("#events .gaps").get_attribute("d") == ""  # each action is recorded
    # Who never explores has no curve of epsilon.
    assert ant.tab.locator(".curve:visible b").all_inner_texts() == ["0", "19"]


def test_a_click_follows_an_ant_or_looks_at_a_cell(crowd, colony):
    moment = 50
    crowd.read("moment => viewer.player.go(moment)", moment)
    true = colony[1][moment]
    crowd.click_cell(int(true.cells[4]))
    number = int(true.numbers[4])
    assert crowd.read("viewer.followed") == number
    assert crowd.text("#ant h2").startswith(f"Ant {number} ")
    crowd.click("#ant-after")
    assert crowd.read("viewer.followed") == true.numbers[5]
    crowd.click("#ant-before")
    crowd.click("#ant-close")
    crowd.tab.wait_for_selector("#ant", state="hidden")  # the panel may be a moment behind
    taken = set(true.cells.tolist())
    for held, words in [(7, "contains food"), (5, "contains a rock"), (13, "contains the queen")]:
        cells = [c for c in np.flatnonzero(true.ground == held).tolist() if c not in taken]
        cell = next(c for c in cells if crowd.read("c => viewer.history.grid.exists(c)", c))
        crowd.click_cell(cell)
        assert crowd.read("viewer.cell") == cell
        assert words in crowd.text("#cell")
        x, y, z = crowd.read("c => viewer.history.grid.cube(c)", cell)
        assert f"Cell ({x}, {y}, {z})" in crowd.text("#cell")
    marked = np.flatnonzero((true.ground == 0) & (true.trail >= 1)).tolist()
    cell = next(c for c in marked if c not in taken)
    crowd.click_cell(cell)
    assert f"trail {true.trail[cell]:.2f} (darkest from 250)" in crowd.text("#cell")
    crowd.click("#cell-close")
    crowd.tab.wait_for_selector("#cell", state="hidden")


def test_who_wants_a_cell_is_told(crowd, colony):
    """Two ants that move to one cell: one enters it, the other tries in vain."""
    found = 0
    for moment, (before, after) in enumerate(pairwise(colony[1])):
        wanted: dict[int, list[int]] = {}
        grid = crowd.read("viewer.history.grid.offsets")
        for place, action in enumerate(after.actions.tolist()):
            if action < 3:
                heading = (int(before.headings[place]) + action - 1) % 6
                cell = int(before.cells[place]) + grid[heading]
                wanted.setdefault(cell, []).append(int(before.numbers[place]))
        for cell, numbers in wanted.items():
            if len(numbers) < 2 or found == 5:
                continue
            found += 1
            crowd.read("([m, c]) => { viewer.player.go(m); viewer.chooseCell(c); }", [moment, cell])
            said = crowd.text("#cell")
            for number in numbers:
                assert f"ant {number} (" in said
            assert "failed" in said
            crowd.tab.click(f'#cell [data-follow="{numbers[0]}"]')
            assert crowd.read("viewer.followed") == numbers[0]
    assert found == 5


def test_everything_can_be_done_by_keyboard(crowd, colony):
    reached = []
    for _ in range(30):
        crowd.tab.keyboard.press("Tab")
        reached.append(
            crowd.read(
                """() => { const it = document.activeElement, line = getComputedStyle(it);
                  return [it.id, it.getAttribute("aria-label") || it.innerText,
                          line.outlineStyle !== "none" && parseFloat(line.outlineWidth) >= 2]; }"""
            )
        )
        if reached[-1][0] == "speed":
            break
    names = [name for name, *_ in reached]
    for control in ("theme", "help-button", "world", "zoom-in", "zoom-out", "fit", "forward",
                    "play", "last", "time", "speed"):  # fmt: skip
        assert control in names
    assert all(label and outlined for _, label, outlined in reached)
    crowd.tab.focus("#world")
    crowd.press("n")
    first = crowd.read("viewer.followed")
    crowd.press("n", "n", "p")
    assert crowd.read("viewer.followed") == first + 1
    crowd.press("f")
    assert crowd.tab.get_attribute("#ant-aim", "aria-pressed") == "true"
    crowd.press("u")  # the cursor begins at the followed ant
    here = crowd.read("viewer.cell")
    assert here == colony[1][0].cells[first + 1]
    for key, heading in zip("uiolkj", (5, 0, 1, 2, 3, 4), strict=True):
        crowd.press(key)
        there = crowd.read("viewer.cell")
        expected = here + crowd.read("h => viewer.history.grid.offsets[h]", heading)
        assert there in (expected, here)  # it stays inside of the world
        here = there
    cell = int(colony[1][0].cells[9])
    crowd.read("cell => viewer.chooseCell(cell, true)", cell)
    crowd.press("Enter")
    assert crowd.read("viewer.followed") == colony[1][0].numbers[9]
    crowd.press("Escape", "Escape")
    assert crowd.read("[viewer.followed, viewer.cell]") == [-1, -1]
    crowd.press("?")
    assert crowd.tab.is_visible("#help")
    assert crowd.tab.locator("#keys dt").count() == 15
    crowd.tab.keyboard.press("Escape")
    assert not crowd.tab.is_visible("#help")
    crowd.press("ArrowRight")
    assert crowd.tab.inner_text("#spoken").startswith("Tick 1, ")


def test_the_view_moves_and_comes_back(crowd):
    camera = "({ ...viewer.stage.camera })"
    whole = crowd.read(camera)
    crowd.click("#zoom-in")
    assert crowd.read(camera)["scale"] == pytest.approx(1.4 * whole["scale"])
    crowd.click("#zoom-out")
    assert crowd.read(camera)["scale"] == pytest.approx(whole["scale"])
    box = crowd.tab.locator("#world").bounding_box()
    x, y = box["x"] + 0.6 * box["width"], box["y"] + 0.4 * box["height"]
    under = "([x, y]) => viewer.stage.cellAt(x, y)"
    place = [x - box["x"], y - box["y"]]
    before = crowd.read(under, place)
    crowd.tab.mouse.move(x, y)
    crowd.tab.mouse.wheel(0, -300)
    crowd.tab.wait_for_function("scale => viewer.stage.camera.scale > scale", arg=whole["scale"])
    assert crowd.read(under, place) == before  # what lies under the mouse stays there
    crowd.tab.mouse.down()
    crowd.tab.mouse.move(x + 40, y + 30, steps=4)
    crowd.tab.mouse.up()
    assert crowd.read(under, [place[0] + 40, place[1] + 30]) == before
    assert crowd.read("viewer.cell") == -1  # a drag is no click
    crowd.tab.focus("#world")
    for key, axis, sign in [("w", "y", -1), ("s", "y", 1), ("a", "x", -1), ("d", "x", 1)]:
        now = crowd.read(camera)
        crowd.press(key)
        assert np.sign(crowd.read(camera)[axis] - now[axis]) == sign
    crowd.press("+", "-", "0")
    assert crowd.read(camera) == whole
    crowd.click("#zoom-in")
    crowd.click("#fit")
    assert crowd.read(camera) == whole


def test_fingers_tap_and_pinch(browser, colony):
    phone = Page(browser, colony[0], (390, 844), has_touch=True, device_scale_factor=2)
    cell = int(colony[1][0].cells[3])
    x, y = phone.read("cell => viewer.stage.toPage(viewer.history.grid.centre(cell))", cell)
    box = phone.tab.locator("#world").bounding_box()
    phone.tab.touchscreen.tap(box["x"] + x, box["y"] + y)
    phone.settle()
    assert phone.read("viewer.followed") == colony[1][0].numbers[3]
    scale = phone.read("viewer.stage.camera.scale")
    session = phone.context.new_cdp_session(phone.tab)
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def touch(kind: str, apart: float) -> None:
        points = [
            {"x": middle[0] + s * apart, "y": middle[1], "id": i} for i, s in ((0, -1), (1, 1))
        ]
        given = {"type": kind, "touchPoints": [] if kind == "touchEnd" else points}
        session.send("Input.dispatchTouchEvent", given)

    touch("touchStart", 30)
    for apart in (36, 45, 60):
        touch("touchMove", apart)
    touch("touchEnd", 0)
    assert phone.read("viewer.stage.camera.scale") == pytest.approx(2 * scale, rel=0.05)
    # Nothing is wider than the screen, and no two controls lie over each other.
    assert phone.read("document.documentElement.scrollWidth") == 390
    boxes = [phone.tab.locator(s).bounding_box() for s in ("#play", "#place", "#speed", "#time")]
    for k, one in enumerate(boxes):
        for other in boxes[k + 1 :]:
            apart = (
                one["x"] + one["width"] <= other["x"] + 1
                or other["x"] + other["width"] <= one["x"] + 1
                or one["y"] + one["height"] <= other["y"] + 1
                or other["y"] + other["height"] <= one["y"] + 1
            )
            assert apart
    phone.close()


def test_a_page_on_which_nothing_changes_rests(ant):
    frames = """() => { let n = 0; const next = window.requestAnimationFrame;
      window.requestAnimationFrame = (act) => { n++; return next(act); };
      return new Promise((done) => setTimeout(() => done(n), 300)); }"""
    ant.settle()
    assert ant.read(frames) == 0
    ant.tab.keyboard.press("Space")
    assert ant.read(frames) > 2
    ant.tab.keyboard.press("Space")
    ant.settle()


def test_food_is_a_dot_with_a_ring_where_cells_are_small(browser, folder):
    """A trail may be as light as food; the ring is lighter then."""
    world = World((60, 60, 60), (0, 0, 0), foods=[(30, 0, 0)], trails=[((29, 0, 0), 250)])
    many = Colony(world, Task(), TrainingConfig("sarsa", 0.1, 0.9, 0.1, 0.9), ants=1)
    many.begin_episode()
    page = Page(browser, written(folder, "small", record_colony(many)))
    assert page.read("viewer.stage.camera.scale < 6")
    names = page.read(
        """cell => { const { stage } = viewer, { colours, ratio } = stage;
          const [x, y] = stage.toPage(viewer.history.grid.centre(cell)), found = [];
          for (let k = 0; k < 81; k++) {
            const across = k % 9 - 4, up = Math.floor(k / 9) - 4;
            const { data } = stage.context.getImageData(x * ratio + across, y * ratio + up, 1, 1);
            const same = (colour) => bytesOf(colour).every((byte, i) => byte === data[i]);
            found.push(Object.keys(colours).find((name) => same(colours[name])));
          }
          return found; }""",
        int(world.grid.index((30, 0, 0))),
    )
    assert {"food", "food-floor"} <= set(names)
    page.close()


def test_large_numbers_keep_apart(ant):
    ant.read("() => { viewer.history.frames[0].returns = 30779170; viewer.player.go(0); }")
    ant.settle()
    shown = ant.tab.inner_text("#now").replace("\N{NARROW NO-BREAK SPACE}", " ")
    assert "30 779 170" in shown
    boxes = ant.read(
        """[...document.querySelectorAll("#now dd")].map((one) => {
          const range = document.createRange();
          range.selectNodeContents(one);
          const { left, right, top } = range.getBoundingClientRect();
          return [Math.round(top), left, right]; })"""
    )
    for (row, _, right), (other, left, _) in pairwise(boxes):
        assert row != other or right + 6 < left


def test_the_panel_shows_what_an_ant_with_food_sees(ant, episode):
    """It sees no trails: the cells in its view look so, and the panel says why."""
    fills = """[...document.querySelectorAll(".sees g text")].map((it) =>
        it.previousElementSibling.getAttribute("fill"))"""
    moment = int(np.flatnonzero(episode[1].states >= 64)[3])
    ant.read("moment => viewer.player.go(moment)", moment)
    ant.settle()
    ant.read("() => { viewer.history.world.trail.fill(100); viewer.draw(0, false); }")
    letters = ant.text("#ant b").split()[1:]
    colours = {"E": "var(--empty)", "O": "var(--rock)", "S": "var(--empty)"}
    assert ant.read(fills) == [colours[letter] for letter in letters]
    assert "ants with food do not see the trail" in ant.text("#ant")
    ant.read("() => { viewer.history.kept = []; viewer.history.world.moment = 1e9; }")


def test_a_page_is_printed_light_and_without_controls(browser, episode):
    dark = Page(browser, episode[0], color_scheme="dark")
    dark.tab.emulate_media(media="print", color_scheme="dark")
    dark.read("dispatchEvent(new Event('beforeprint'))")
    assert dark.read("document.documentElement.dataset.theme") == "light"
    assert dark.read("viewer.stage.colours.page") == "#ffffff"
    for hidden in ("#play", "#time", "#theme", "#zoom-in", "#hint", "#ant-close"):
        assert dark.tab.is_hidden(hidden), hidden
    for shown in ("#world", "#now", "#ant", "#curves", "#legend"):
        assert dark.tab.is_visible(shown), shown
    dark.read("dispatchEvent(new Event('afterprint'))")
    assert dark.read("document.documentElement.dataset.theme") == "dark"
    dark.close()


def test_ants_are_printed_in_their_world(browser, episode, tmp_path):
    """The first print of a page has cells, trails and marks, in light colours, and all facts."""
    dark = Page(browser, episode[0], color_scheme="dark")
    dark.read("viewer.player.go(9)")
    dark.settle()
    text, sheets = printed(dark.tab, tmp_path)
    assert len(sheets) <= 2
    assert dark.read("document.documentElement.dataset.theme") == "dark"
    light = dark.read(
        """() => { viewer.wear("light"); const { ramp, colours } = viewer.stage;
          const level = ramp[Math.round(255 * (25 - 9) / 250)].map((one) => one.toString(16));
          return [colours.empty, "#" + level.join(""), colours.food, colours.queen]; }"""
    )
    empty, trail, food, queen = shares(sheets, *light)
    assert empty > 0.08  # much more than in the legend
    assert trail > 0.002
    assert food > 5e-5
    assert queen > 5e-5
    assert all(words in text for words in ("Chooses forward", "observation", "delivered", "trail"))
    dark.close()


def test_light_and_dark(browser, episode):
    dark = Page(browser, episode[0], color_scheme="dark")
    look = "document.documentElement.dataset.theme"
    pixel = """([cell]) => { const [x, y] = viewer.stage.toPage(viewer.history.grid.centre(cell));
      const r = viewer.stage.ratio;
      return [...viewer.stage.context.getImageData(x * r, y * r, 1, 1).data.slice(0, 3)]; }"""
    empty = [int(worlds.paper().grid.index((5, 5, 0)))]
    assert dark.read(look) == "dark"
    assert dark.read(pixel, empty) == [0x1E, 0x24, 0x2B]
    dark.click("#theme")
    assert dark.read(look) == "light"
    assert dark.read(pixel, empty) == [0xEA, 0xEE, 0xF4]
    dark.press("t")
    assert dark.read(look) == "dark"
    dark.close()
    light = Page(browser, episode[0], color_scheme="light", reduced_motion="reduce")
    assert light.read(look) == "light"
    light.tab.keyboard.press("Space")  # ants do not glide
    shares = (
        "stage => { const s = []; const draw = viewer.stage.draw.bind(viewer.stage);"
        "viewer.stage.draw = (m, share, marks) => { s.push(share); draw(m, share, marks); };"
        "return new Promise((done) => setTimeout(() => done(s), 400)); }"
    )
    assert set(light.read(shares)) <= {0}
    light.tab.keyboard.press("Space")
    light.tab.emulate_media(color_scheme="dark")
    light.tab.wait_for_function("document.documentElement.dataset.theme === 'dark'")
    light.close()


def test_cells_have_the_colours_of_what_they_hold(crowd, colony):
    """In the view of the page, at the middle of each cell; the drawings lie on another canvas."""
    true = colony[1][70]
    crowd.read("viewer.player.go(70)")
    crowd.settle()
    shown = crowd.read(
        """() => { const { stage, history } = viewer, shown = [];
          for (let cell = 0; cell < history.grid.size; cell++) {
            const [x, y] = stage.toPage(history.grid.centre(cell)).map((at) => at * stage.ratio);
            const pixel = stage.context.getImageData(x, y, 1, 1);
            shown.push(history.grid.exists(cell) ? [...pixel.data] : null);
          }
          return shown; }"""
    )
    ramp = np.array(crowd.read("viewer.stage.ramp"))
    read = crowd.read("viewer.stage.colours")
    named = {0: "empty", 5: "rock", 7: "food-floor", 13: "queen-floor"}
    ground = {held: list(bytes.fromhex(read[name][1:])) for held, name in named.items()}
    for cell, colour in enumerate(shown):
        if colour is None:
            continue
        expected = ground[int(true.ground[cell])]
        if true.ground[cell] == 0 and true.trail[cell] >= 1:
            expected = ramp[math.floor(min(float(true.trail[cell]) / 250, 1) * 255 + 0.5)]
        assert colour == [*expected, 255]


def test_nests_have_their_colours_and_their_tables(browser, folder):
    """The queen and the ants of the second nest, and the values by which a followed ant acts."""
    world = World((8, 8, 8), [(6, 0, 0), (0, 0, 0)], foods=[(3, 1, 0), (4, 1, 0)])
    many = Colony(world, None, TrainingConfig("q_learning", 0.2, 0.9, 0.2, 1.0), 3, ants=8)
    many.begin_episode()
    opened = Page(browser, written(folder, "nests", record_colony(many, 40)))
    opened.read("viewer.player.go(40)")
    opened.settle()
    queens = many.grid.index(world.queens).tolist()
    assert opened.read("cell => viewer.stage.queenColour(cell)", queens[0]) == "queen"
    assert opened.read("cell => viewer.stage.queenColour(cell)", queens[1]) == "queen 1"
    assert opened.read("viewer.stage.colours['queen 1']") == "#83000f"
    assert opened.text("#legend").count("nest") == 2
    legend = opened.read("document.querySelector('#legend').innerHTML")
    assert all(colour in legend for colour in ("#83000f", "#a312dc", "nest 0", "nest 1"))
    nests, numbers = many.nests[0], many.numbers[0]
    for slot, number in enumerate(numbers.tolist()):
        shown = opened.read("number => viewer.history.ant(40, number)", number)
        assert shown["nest"] == nests[slot]
        values = many.q_values[0, nests[slot], many.states[0, slot]]
        assert np.array_equal(np.float32(shown["values"]), values)
        assert shown["loaded"] == many.carrying[0, slot]
    drawn = opened.read("[...viewer.stage.sprites.keys()].map((key) => key.split('.')[0])")
    assert any(key.startswith("ant 2") for key in drawn)
    opened.close()


def test_castes_and_kinds_of_food_have_names_colours_and_tables(browser, folder):
    castes = {"nurse": Caste(threshold=Threshold("fixed", value=5)), "scout": Caste(share=0.5)}
    foods = {"seed": Food(deliver=90, regrowth=2), "sap": Food(deliver=40, regrowth=2)}
    labour = Labour("thresholds", demand=0.05, relief=1, stop_probability=0.5)
    task = foraging().replace(castes=castes, foods=foods, labour=labour, life={"regrowth": None})
    world = World((8, 8, 8), (6, 0, 0), [(5, 0, 1), (3, 1, 0), (4, 1, 0)], food_kinds=[0, 1, 1])
    many = Colony(world, task, TrainingConfig("q_learning", 0.2, 0.9, 0.3, 1.0), 3, ants=16)
    many.begin_episode()
    many.tick(60)
    opened = Page(browser, written(folder, "groups", record_colony(many, 40)))
    opened.read("viewer.player.go(40)")
    opened.settle()
    legend = opened.text("#legend")
    assert all(name in legend for name in ("idle ant", "seed", "sap"))
    snapshot = many.snapshot()
    for kind in (0, 1):
        there = np.flatnonzero((snapshot.ground == FOOD) & (snapshot.food_kinds == kind)).tolist()
        assert opened.read("kind => viewer.stage.foods[kind] ?? []", kind) == there
    met = set()
    for slot, number in enumerate(many.numbers[0].tolist()):
        shown = opened.read("number => viewer.history.ant(40, number)", number)
        caste, idle = int(many.castes[0, slot]), bool(many.idle[0, slot])
        assert (shown["caste"], shown["idle"]) == (caste, idle)
        values = many.q_values[0, caste, many.states[0, slot]]
        assert np.array_equal(np.float32(shown["values"]), values)
        met.add((caste, idle))
    assert {(0, True), (1, False)} <= met
    slot = int(np.flatnonzero(many.idle[0])[0])
    opened.read("number => viewer.follow(number)", int(many.numbers[0, slot]))
    opened.settle()
    assert opened.text("#ant .groups") == "nurse · idle"
    opened.close()


def test_the_page_works_under_its_policy(browser, colony):
    path, *_ = colony
    assert_policy_holds(browser, path)


def test_a_source_can_be_live(browser, folder, colony):
    """Frames that come one by one; the page waits at the end, and goes on when there are more."""
    path, moments, recording = colony
    empty = re.sub(r'(id="recording">)[^<]*', r"\1", path.read_text(encoding="utf-8"))
    live = folder / "live.html"
    live.write_text(empty, encoding="utf-8")
    context = browser.new_context(viewport={"width": 1280, "height": 720}, bypass_csp=True)
    tab = context.new_page()
    faults: list[str] = []
    tab.on("pageerror", lambda error: faults.append(str(error)))
    tab.goto(live.as_uri())
    frames = [base64.b64encode(frame).decode() for frame in recording.frames]
    bytes_of = "(text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer"
    tab.evaluate(
        f"""([header, first]) => {{ const bytes = {bytes_of};
          show({{ header, live: true, start(receive) {{
            window.push = (text) => receive(bytes(text)); receive(bytes(first)); }} }});
          viewer.timeline.setSpeed(200); viewer.player.play(); }}""",
        [recording.header, frames[0]],
    )
    for frame in frames[1:40]:
        tab.evaluate("push", frame)
    tab.wait_for_function("viewer.player.moment === 39")
    assert tab.evaluate("viewer.player.playing")
    for frame in frames[40:]:
        tab.evaluate("push", frame)
    tab.wait_for_function("viewer.player.moment === 90 && !viewer.dirty")
    assert tab.evaluate(STATE, 90)["ground"] == moments[90].ground.tolist()
    assert tab.evaluate("document.querySelector('#time').max") == "90"
    context.close()
    assert not faults


def test_the_page_asks_for_nothing_and_runs_no_text(browser, episode):
    """Its policy forbids the network and all scripts but its own; it plays all the same."""
    context = browser.new_context()
    tab = context.new_page()
    faults, asked = [], []
    tab.on("console", lambda message: faults.append(message.text))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(episode[0].as_uri())
    tab.locator("#place b").wait_for()
    tab.keyboard.press("End")
    tab.locator("#place b", has_text="34").wait_for()
    assert asked == [episode[0].as_uri()]
    assert not faults
    tab.evaluate("fetch('https://example.org').catch(() => 0)")
    assert any("Content Security Policy" in fault for fault in faults)
    context.close()


def test_one_moment_has_no_time_line(browser, folder):
    world = World((4, 4, 4), (0, 0, 0), foods=[(3, 0, 0)])
    one = Colony(world, None, TrainingConfig("q_learning", 0.2, 0.9, 0.2, 1.0))
    one.begin_episode()
    opened = Page(browser, written(folder, "moment", record_colony(one)))
    assert not opened.tab.is_visible("#transport")
    opened.press("Space", "ArrowRight", "End")
    assert opened.moment == 0
    opened.close()


@pytest.mark.long
def test_frames_per_second(browser, folder):
    """A hundred thousand cells and five thousand ants, drawn without a graphics processor."""
    world = worlds.open_world(1, (183, 183, 183))
    config = TrainingConfig("sarsa", 0.01, 0.9, 0.05, 1.0)
    rules = {"sharing": "frozen", "q_values": trail_follower(), "start": "spread"}
    many = Colony(world, None, config, ants=5000, **rules)
    many.begin_episode()
    opened = Page(browser, written(folder, "large", record_colony(many, 100)))
    for zoom in (1, 8):
        rate, script = opened.read(
            """async (zoom) => {
              viewer.stage.zoom(zoom); viewer.player.go(0);
              viewer.timeline.setSpeed(20); viewer.player.play();
              const pause = (ms) => new Promise((done) => setTimeout(done, ms));
              await pause(500);
              let spent = 0; const draw = viewer.draw.bind(viewer);
              viewer.draw = (...all) => {
                const start = performance.now();
                draw(...all);
                spent += performance.now() - start;
              };
              const before = viewer.frames, from = performance.now();
              await pause(3000);
              const drawn = viewer.frames - before, took = performance.now() - from;
              viewer.player.pause(); viewer.draw = draw;
              return [1000 * drawn / took, spent / drawn]; }""",
            zoom,
        )
        print(f"zoom {zoom}: {rate:.0f} frames a second, {script:.1f} ms of script each")
        assert script < 33 * crowding()
        assert rate > 15 / crowding()
    opened.close()


def test_the_script_is_whole():
    """Each part is in the page once, in an order in which classes stand before their use."""
    whole = "".join(map(part, SCRIPTS))
    for name in re.findall(r"new ([A-Z]\w+)\(", whole):
        assert f"class {name} " in whole or name in (
            *("Path2D", "Map", "Set", "Blob", "Response", "DataView", "TextDecoder"),
            *("DecompressionStream", "Uint8Array", "Uint32Array", "Int32Array", "Float32Array"),
            *(
                "TextEncoder",
                "CompressionStream",
                "ResizeObserver",
                "AbortController",
                "Promise",
                "Error",
            ),
        )


def test_what_lies_between_moments_is_not_made_up(browser, folder):
    """The pace is in ticks, and there is no way from a cell to one far away."""
    rules = TrainingConfig("q_learning", 0.2, 0.9, 0.2, 1.0)
    one = Colony(worlds.paper(), Task("queues", life=Life(births=True)), rules)
    one.begin_episode()
    recording = record_colony(one, 60, frame_interval=10)
    assert recording.header["title"].startswith("Ants in a world of ")
    opened = Page(browser, written(folder, "thinned", recording))
    opened.read("viewer.player.go(6)")
    assert opened.read("viewer.history.path(6, 0).length") == 1
    assert opened.tab.get_attribute("#time", "max") == "60"
    assert opened.tab.locator("#events .gaps").get_attribute("d") == "M0.0 7H1000.0"
    opened.read("viewer.timeline.setSpeed(12)")
    assert opened.text("#speed-value") == "120 ticks/s"
    opened.tab.focus("#time")
    opened.press("ArrowLeft")
    assert opened.moment == 5
    opened.press("ArrowRight")
    assert opened.moment == 6
    opened.read("viewer.follow(0)")
    meaning = opened.text("#ant .sees small")
    assert re.match(r"[A-Z] \w+(, [A-Z] [\w ]+)*", meaning)
    letters = (
        "P ant with the other load on a better cell, A on a cell that is not better, "
        "p ant with the same load on a better cell"
    )
    view = {"task": "", "rest": "EPA", "letters": ["E", "P", "A"]}
    opened.read("view => { viewer.history.stateName = () => view; viewer.dirty = true; }", view)
    assert opened.text("#ant .sees small") == f"E empty; {letters}"
    opened.close()
