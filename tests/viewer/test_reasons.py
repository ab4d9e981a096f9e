"""The page gives a true reason for what each ant does, or none, under every rule of choice."""

import pytest
from browser import Page

from taichi_ants import Colony, Task, TrainingConfig, rules, worlds
from taichi_ants.features.rule import RULES
from taichi_ants.learners.policies import trail_follower
from taichi_ants.task import Caste, Choice, Life, Noise, foraging
from taichi_ants.task.constants import ACTION_NAMES
from taichi_ants.viewer import record_colony, save_page

pytestmark = pytest.mark.browser

LASTING = Life(regrowth=0)
GUIDED = Task(castes={"guide": Caste(policy="trail_follower"), "worker": Caste()}, life=LASTING)


def straight(codes, random):
    """Return the action of an ant that needs no action values."""
    return 1 if codes[1] != 1 and random < 0.9 else random * 5 // 1


# By name: the task, the learner (None: no table), the sharing, and the policy.
COLONIES = {
    "Q-learning": (Task(life=LASTING), "q_learning", "shared", None),
    "SARSA": (foraging().replace(delivery="truncates", life=LASTING), "sarsa", "shared", None),
    "a hand-written policy": (Task(), "sarsa", "frozen", trail_follower()),
    "castes": (GUIDED, "sarsa", "shared", None),
    "slipping": (Task(noise=Noise(slip=0.3, misread=0.3), life=LASTING), "sarsa", "shared", None),
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
    del RULES.yours["straight"]


def begun(name: str) -> Colony:
    """Return a colony that has learned for a while, in the middle of an episode."""
    task, learner, sharing, policy = COLONIES[name]
    task = task() if callable(task) else task
    config = learner and TrainingConfig(learner, 0.1, 0.9, 0.0, 1.0, min_epsilon=0.0)
    world = worlds.open_world(3, (9, 9, 9))
    colony = Colony(world, task, config, 1, ants=12, sharing=sharing, q_values=policy)
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
    assert whys <= ({"best", "tie", ""} if rule == "greedy" else {"rule"})
    assert whys & {"best", "tie", "rule"}
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
