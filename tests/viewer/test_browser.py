"""The page in a real browser: each control, and values that equal the engine's."""

import math
from itertools import pairwise

import numpy as np
import pytest
from browser import Page
from playback import played

from taichi_ants import Colony, Task, TrainingConfig, worlds
from taichi_ants.learners.policies import trail_follower
from taichi_ants.rendering import Episode
from taichi_ants.task import Life, Pheromone, foraging
from taichi_ants.task.constants import ACTION_NAMES, Event
from taichi_ants.viewer import Recording, page, record_colony, record_trace

pytestmark = pytest.mark.browser

MINUS = "\N{MINUS SIGN}"  # as the page writes it


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
    return written(folder, "episode", record_trace(one.trace, "the paper's ant")), one.trace


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


def test_everything_can_be_done_by_keyboard(crowd, colony):
    """That each control is reached and has a name is tested on the live page."""
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


def test_the_legend_chooses_the_pheromone(browser, folder):
    home = {"deposited_when": "without_food", "evaporation": "exponential", "level": 500}
    task = foraging().replace(fields={"home": home}, homing_cue="home")
    learner = TrainingConfig("q_learning", 0.2, 0.9, 0.2, 1.0)
    colony = Colony(worlds.open_world(4, (12, 12, 12)), task, learner, 3, ants=25)
    colony.begin_episode()
    recording = record_colony(colony, 70)
    levels = [list(one.fields) for one in played(recording)]
    present = colony.snapshot().fields
    assert all(np.array_equal(a, b) for a, b in zip(levels[-1], present.values(), strict=True))
    page = Page(browser, written(folder, "fields", recording))
    try:
        page.tab.focus("#shown")
        for number in (1, 0):
            page.press("ArrowDown" if number else "ArrowUp")
            for moment in (70, 3, 40):
                shown = page.read("(at) => [...viewer.history.worldAt(at).trail]", moment)
                assert np.allclose(shown, levels[moment][number])
            assert page.read("viewer.history.pheromone.name") == ("trail", "home")[number]
    finally:
        page.close()


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
