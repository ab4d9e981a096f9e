"""The page gives a true reason for what each ant does, or none, under every rule of choice."""

from __future__ import annotations

import numpy as np
import pytest
from browser import Page, started

from taichi_ants import Colony, Field, Task, TrainingConfig, World, rules, worlds
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.rules import registry
from taichi_ants.task import Caste, Choice, Life, Noise, Pheromone, foraging
from taichi_ants.task.constants import ACTION_NAMES
from taichi_ants.viewer import record_colony, save_page

pytestmark = pytest.mark.browser

LASTING = Life(regrowth=0)
GUIDED = Task(castes={"guide": Caste(policy="trail_follower"), "worker": Caste()}, life=LASTING)


def straight(codes, random):
    """Return the action of an ant that needs no action values."""
    return 1 if codes[1] != 1 and random < 0.9 else random * 5 // 1


def learning(learner: str, epsilon: float = 0.0) -> TrainingConfig:
    return TrainingConfig(learner, 0.1, 0.9, epsilon, 1.0, min_epsilon=0.0)


# By name: the task, the learner (None: no table), the sharing, and the policy.
COLONIES = {
    "Q-learning": (Task(life=LASTING), "q_learning", "shared", None),
    "SARSA, terminates": (Task(life=LASTING), "sarsa", "shared", None),
    "SARSA, truncates": (
        foraging().replace(delivery="truncates", life=LASTING),
        "sarsa",
        "shared",
        0,
    ),
    "SARSA(λ) alone": (Task(life=LASTING), "sarsa_lambda", "independent", None),
    "a hand-written policy": (Task(), "sarsa", "frozen", trail_follower()),
    "a random policy": (Task(), "sarsa", "frozen", random_policy()),
    "castes": (GUIDED, "sarsa", "shared", None),
    "misreading": (Task(noise=Noise(misread=0.3), life=LASTING), "sarsa", "shared", None),
    "slipping": (Task(noise=Noise(slip=0.3), life=LASTING), "sarsa", "shared", None),
    "softmax": (Task(choice=Choice("softmax"), life=LASTING), "sarsa", "shared", None),
    "deneubourg": (Task(choice=Choice("deneubourg"), life=LASTING), None, "frozen", None),
    "an own rule": (lambda: Task(choice=Choice("straight"), life=LASTING), None, "frozen", None),
}

STORIES = """() => viewer.history.frames.flatMap((frame, moment) =>
  [...frame.numbers].map((number) => {
    const ant = viewer.history.ant(moment, number);
    viewer.history.worldAt(moment);
    return [moment, number, ant.act, viewer.panel.storyOf(ant), viewer.panel.barsOf(ant)]; })
  .filter(([, , act]) => act))"""


@pytest.fixture(scope="module", autouse=True)
def _registered():
    rules.register("choice")(straight)
    yield
    del registry.RULES.yours["straight"]


@pytest.fixture(scope="module")
def browser():
    with started() as one:
        yield one


def begun(name: str, epsilon: float = 0.0) -> Colony:
    """Return a colony that has learned for a while, in the middle of an episode."""
    task, learner, sharing, policy = COLONIES[name]
    task = task() if callable(task) else task
    table = policy if isinstance(policy, np.ndarray) else None
    config = None if learner is None else learning(learner, epsilon)
    world = worlds.open_world(3, (9, 9, 9))
    colony = Colony(world, task, config, 1, ants=12, sharing=sharing, q_values=table)
    colony.begin_episode()
    colony.tick(30)
    return colony


@pytest.mark.parametrize("name", COLONIES)
def test_reasons_are_those_of_the_rule(browser, tmp_path, name):
    """Ants that never explore never act at random, whatever they learn, misread or slip."""
    colony = begun(name)
    recording = record_colony(colony, 60)
    save_page(tmp_path / "page.html", recording)
    page = Page(browser, tmp_path / "page.html")
    stories, rule = page.read(STORIES), colony.task.choice.rule
    assert len(stories) == 12 * 60
    whys = {act["why"] for *_, act, _, _ in stories}
    if rule == "greedy":
        assert whys <= {"best", "tie", ""}
        assert whys & {"best", "tie"}
    else:
        assert whys == {"rule"}
    by_values = rule in ("greedy", "softmax")
    for _, _, act, story, bars in stories:
        assert f"Chooses <b>{ACTION_NAMES[act['action']]}</b>" in story
        assert (f"by the rule {rule}" in story) == (rule != "greedy")
        assert ("equal values" in story) == (act["why"] == "tie")
        assert ("action values" in bars) == by_values
        slips = act["executed"] != act["action"]
        assert (f"becomes <b>{ACTION_NAMES[act['executed']]}</b>" in story) == slips
    assert any(act["executed"] != act["action"] for *_, act, _, _ in stories) == (
        name == "slipping"
    )
    page.read("moment => { viewer.player.go(5); viewer.follow(0); }")
    assert ("epsilon" in page.text("#now")) == by_values
    about = dict(recording.header["about"])
    assert about.get("rule of choice", "greedy") == rule
    assert ("policy" in about) == (COLONIES[name][2] == "frozen" and by_values)
    said = page.read("viewer.panel.sentence(5, 0)")
    assert "undefined" not in said
    assert ("by the rule" in said) == (rule != "greedy")
    page.close()


def test_only_castes_that_learn_show_what_they_learn(browser, tmp_path):
    colony = begun("castes", epsilon=0.2)
    save_page(tmp_path / "page.html", record_colony(colony, 30))
    page = Page(browser, tmp_path / "page.html")
    castes = dict(zip(colony.numbers[0].tolist(), colony.castes[0].tolist(), strict=True))
    met = set()
    for _, number, act, story, _ in page.read(STORIES):
        learns = castes[number] == 1
        assert ("Q(" in story) == ("TD error" in story) == learns
        met.add((learns, act["why"]))
    assert (True, "explored") in met
    page.close()


def test_a_slip_changes_the_entry_of_the_chosen_action(browser, tmp_path):
    colony = begun("slipping", epsilon=0.5)
    save_page(tmp_path / "page.html", recording := record_colony(colony, 30))
    page = Page(browser, tmp_path / "page.html")
    slipped = [one for one in page.read(STORIES) if one[2]["action"] != one[2]["executed"]]
    assert len(slipped) > 20
    assert any(act["before"] != act["after"] for *_, act, _, _ in slipped)
    for *_, act, story, _ in slipped:
        assert f", {ACTION_NAMES[act['action']]})" in story
    assert recording.header["format"] == 4
    page.close()


SHORT = Pheromone("exponential", half_life=4)
HOME = {"home": Field(deposited_when="without_food", deposit="add", level=100, cap=1000)}
# The task, the pheromone that the page shows, and its view for ants without and with food; None if
# they follow something else.
SEEN = [
    (Task(pheromone=SHORT), "trail", "half", None),
    (Task(pheromone=Pheromone(view="strongest")), "trail", "strongest", None),
    (
        Task(pheromone=Pheromone(view="strongest_under_carriers")),
        *("trail", "strongest_under_carriers", None),
    ),
    (Task(pheromone=SHORT, homing_cue="trail"), "trail", "half", "half"),
    (Task(fields=HOME, homing_cue="home"), "home", None, "half"),
    (Task(pheromone=SHORT, fields=HOME, homing_cue="home"), "trail", "half", None),
]
MEANINGS = """() => viewer.history.frames.flatMap((frame, moment) => {
  const { trail, ground } = viewer.history.worldAt(moment);
  return [...frame.numbers].map((number) => {
    const ant = viewer.history.ant(moment, number), box = document.createElement("div");
    box.innerHTML = viewer.panel.viewOf(ant);
    const cells = [-1, 0, 1].map((k) => ant.cell + viewer.history.grid.offsets[(ant.heading + k + 6) % 6]);
    return [ant.loaded, box.querySelector("small").textContent, cells.map((cell) => trail[cell]),
      [...box.querySelectorAll("text")].map((one) => one.textContent),
      [...box.querySelectorAll("g > path")].map((one) => one.getAttribute("fill"))]; }); })"""  # noqa: E501


@pytest.mark.parametrize(("task", "shown", "without", "with_food"), SEEN)
def test_what_hides_a_trail_is_told(browser, tmp_path, task, shown, without, with_food):
    task = task.replace(life=LASTING)
    world, many = worlds.open_world(3, (9, 9, 9)), {"ants": 30, "sharing": "frozen"}
    colony = Colony(world, task, learning("sarsa", 0.3), 1, q_values=trail_follower(), **many)
    colony.begin_episode()
    colony.tick(50)
    save_page(tmp_path / "page.html", record_colony(colony, 20, pheromone=shown))
    page = Page(browser, tmp_path / "page.html")
    fields, name = bool(task.fields), "trail" if shown == "trail" else f"field {shown}"
    words = {
        "half": "below half of the strongest in view",
        "strongest": "below the strongest in view",
        "strongest_under_carriers": "below the strongest in view, also under ants with food",
    }
    met = set()
    for loaded, said, levels, letters, fills in page.read(MEANINGS):
        view = with_food if loaded else without
        sees = [k for k in range(3) if levels[k] >= 1 and letters[k] != "O"]
        hidden = [k for k in sees if view is None or letters[k] == "E"]
        assert all(fills[k] in ("var(--empty)", "var(--food-floor)", "var(--queen-floor)")
                   for k in hidden)  # fmt: skip
        _, _, told = said.partition("; ")
        if not hidden:
            assert told == ""
        elif view:
            assert told == f"where the {name} is {words[view]}, the ant sees E"
        else:
            assert told == f"ants {'with' if loaded else 'without'} food do not see the {name}"
        cue = ("field home" if fields else task.homing_cue) if loaded else task.outbound_cue
        assert ("nearer to the queen" in said) == ("S" in letters and cue == "compass")
        assert (f"T {cue}" in said) == ("T" in letters)
        met.add((loaded, bool(hidden)))
    assert {(False, False), (True, False)} <= met
    assert any(hidden for _, hidden in met)
    page.close()


@pytest.mark.parametrize("name", ["misreading", "deneubourg", "an own rule"])
def test_nothing_hides_trails_from_ants_that_know_more_than_letters(browser, tmp_path, name):
    save_page(tmp_path / "page.html", record_colony(begun(name), 20))
    page = Page(browser, tmp_path / "page.html")
    assert not any(";" in said for _, said, *_ in page.read(MEANINGS))
    page.close()


def test_levels_above_the_scale_are_told_without_it(browser, tmp_path):
    """With deposits that add up, a trail can be stronger than the darkest colour shows."""
    task = Task(pheromone=Pheromone(deposit="add", level=1, cap=10_000))
    world = World((6, 6, 6), (0, 0, 0), foods=[(5, 0, 0)], trails=[((2, 0, 0), 108)])
    colony = Colony(world, task, learning("sarsa"), 1)
    colony.begin_episode()
    save_page(tmp_path / "page.html", record_colony(colony))
    page = Page(browser, tmp_path / "page.html")
    page.read("cell => viewer.chooseCell(cell)", int(world.grid.index((2, 0, 0))))
    assert "trail 108 (darkest from 10)" in page.text("#cell")
    page.close()


def test_an_ant_that_may_take_one_of_several_foods_is_told_at_each(browser, tmp_path):
    world = World((6, 6, 6), (0, 5, 5), foods=[(3, 0, 0), (3, 1, 0)], ants=[((2, 0, 0), 0)])
    colony = Colony(world, Task(), learning("sarsa"), 1, sharing="frozen",
                    q_values=trail_follower())  # fmt: skip
    colony.begin_episode()
    save_page(tmp_path / "page.html", record_colony(colony, 1))
    page = Page(browser, tmp_path / "page.html")
    for food in ((3, 0, 0), (3, 1, 0)):
        page.read("cell => viewer.chooseCell(cell)", int(world.grid.index(food)))
        assert "ant 0 (pick up, here or next to it)" in page.text("#cell")
    page.close()
