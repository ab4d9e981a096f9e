"""ODD descriptions: tables of all settings that have an effect in a study, and of no others."""

import json
import re
from contextlib import suppress

import numpy as np
import pytest
from command_lines import ROOT

from taichi_ants import AntsError, TrainingConfig, files, worlds
from taichi_ants.protocol import At, Every
from taichi_ants.report.odd import Model, described
from taichi_ants.settings import all_of, declared, flat, nested
from taichi_ants.studies.points import ColonyPoint, FixedPolicy, RunPoint, settings_of
from taichi_ants.studies.sweep import plan, sweep_of
from taichi_ants.task import Field, Food, Task, foraging

SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99)
ROW = re.compile(r"^\| `([\w.]+)` \| ([^|]*) \| ([^|]*) \| ([^|]*) \|$", re.M)
_WORDS = {"True": "yes", "False": "no", "None": "off"}


def of_facts(facts, sweep=None):
    return described(Model(json.loads(files.to_json(facts)), sweep or {}), "taichi-ants sweep x")


def of_sweep(sweep, file):
    return of_facts(settings_of(sweep.study.points, sweep.study.seeds) | sweep.facts(), file)


def text_of(*points):
    return of_facts(settings_of(points, (3, 4)))


def values_in(text):
    """The values of the parameters and events in the tables, by name."""
    return {name: value for name, value, *_ in ROW.findall(text)}


def of_task(task, **more):
    without = {} if task.needs_table else {"episodes": 0}
    return text_of(ColonyPoint(worlds.paper(), task, SARSA, **{"ants": 4, **without, **more}))


def drawn(one, rng):
    """A value of a setting other than its default."""
    words, rule = one.allowed_words, one.rule
    if one.kind is bool:
        return not one.default
    if words:
        return str(rng.choice([word for word in words if word != one.default]))
    low = rule.least if rule.least is not None else rule.above or 0
    high = min(rule.most or 500, low + 500)
    if one.kind is int:
        return int(rng.integers(low, high, endpoint=True))
    return round(float(low + (high - low) * rng.uniform(0.1, 0.9)), 3)


def random_task(rng):
    """A task with a field and kinds of food, and several changes that fit together."""
    task = Task().replace(fields={"home": {"deposited_when": "always"}}, foods={"seed": {}})
    scalars = [one for one in all_of(Task) if one.kind in (bool, int, float) or one.allowed_words]
    scalars = [one for one in scalars if len(one.allowed_words) != 1]
    for number in rng.permutation(len(scalars))[:8]:
        one = scalars[number]
        with suppress(AntsError):
            change = {one.path.removeprefix("task."): drawn(one, rng)}
            task = task.replace(**nested(change))
    return task


def differing(task):
    """The settings of a task that differ from their defaults, by full name."""
    usual = flat({"task": Task().as_dict()})
    for name, entries in (("fields", Field()), ("foods", Food())):
        for entry in getattr(task, name):
            for one in declared(type(entries)):
                usual[f"task.{name}.{entry}.{one.name}"] = getattr(entries, one.name)
    own = flat({"task": task.as_dict()})
    return {name: value for name, value in own.items() if name not in usual or value != usual[name]}


@pytest.mark.parametrize("seed", range(40))
def test_every_setting_that_differs_has_its_value(seed):
    task = random_task(np.random.default_rng(seed))
    found, wanted = values_in(of_task(task)), differing(task)
    cues = {"pheromone" if one == "trail" else one for one in (task.outbound_cue, task.homing_cue)}
    learns = task.needs_table
    for name, value in wanted.items():
        *_, group, own = name.split(".")
        is_used = own != "view" or group in cues
        is_used &= learns or own not in ("delivery", "evaporation_in_training")
        is_used &= not (task.foods and name in ("task.rewards.pick_up", "task.rewards.deliver"))
        text = _WORDS.get(str(value), str(value).removesuffix(".0"))
        assert found.get(name) == (text if is_used else None), name


def test_parameters_have_the_unit_and_the_meaning_of_their_declaration():
    fades = {"evaporation": "exponential", "half_life": 7.5}
    task = foraging().replace(pheromone=fades, fields={"home": {}}, homing_cue="home")
    rows = {name: (unit, words) for name, _, unit, words in ROW.findall(of_task(task))}
    known = {one.path: one for one in (*all_of(Task), *declared(TrainingConfig))}
    known |= {f"task.fields.home.{one.name}": one for one in declared(Field)}
    shared = rows.keys() & known.keys()
    assert {
        "task.pheromone.half_life",
        "task.fields.home.deposited_when",
        "training.epsilon",
    } <= shared
    for name in shared:
        assert rows[name] == (known[name].rule.unit, known[name].rule.help)
    assert rows["task.pheromone.half_life"][0] == rows["ticks"][0] == "ticks"


MINIMAL = """
kind = "colony"
measures = ["deliveries", "entropy.a"]
seeds = 2
ants = 2
episodes = 0
rollouts = 1
ticks = 100
policy = "trail_follower"
[world]
preset = "open"
ranges = [12, 12, 12]
[task]
preset = "foraging"
outbound_cue = "a"
[task.fields.a]
deposited_when = "with_food"
[task.castes.alpha]
outbound_cue = "trail"
nest = 0
[task.castes.beta]
homing_cue = "a"
[vary]
task.fields.a.level = [100, 200]
"""


def test_a_study_without_learning_has_no_parameters_of_learning():
    file = files.tomllib.loads(MINIMAL)
    text = of_sweep(sweep_of(file), file)
    found = values_in(text)
    assert not [name for name in found if name.startswith("training.")]
    assert found.keys().isdisjoint({"sharing", "task.delivery", "task.evaporation_in_training"})
    assert found["task.castes.alpha.nest"] == "0"
    assert found["task.castes.alpha.outbound_cue"] == "trail"
    assert found["task.castes.beta.homing_cue"] == "a"
    assert found["task.fields.a.level"] == "100, 200"
    assert (found["evaluation_epsilon"], found["policy.name"]) == ("0", "trail_follower")
    assert (found["world.preset"], found["world.ranges"]) == ("open", "[12, 12, 12]")
    # Nothing sets these.
    unused = ("task.life.lifespan", "task.labour.demand", "task.castes.beta.threshold.value")
    assert found.keys().isdisjoint({*unused, "task.castes.beta.nest", "task.fields.a.slope"})
    # What referees found in earlier descriptions.
    assert "Ants do not learn. They follow the policy trail_follower." in text
    assert "The rewards are" not in text
    assert (
        "*Caste `alpha`.* Only nest 0 has it. Without food, its ants see cells as T by `trail`."
        in (text)
    )
    assert "With food, its ants see cells as S by `a`." in text
    assert "Ants without food see cells as T by the levels of `a`." in text
    assert "A deposit sets the level of a cell: `c = 100, 200`." in text
    assert "| castes of ants | 2: alpha, beta |" in text
    assert "| cell | level of `a` | at least 0 | level |" in text
    assert "| `entropy.a` | entropy of each pheromone field" in text


def test_points_that_differ_have_all_values_of_those_that_use_a_setting():
    tasks = [Task(), Task().replace(pheromone={"deposit": "fading", "slope": 3})]
    points = [ColonyPoint(worlds.paper(), task, SARSA, ants=n) for task in tasks for n in (2, 9)]
    found = values_in(text_of(*points))
    assert (found["ants"], found["task.pheromone.slope"]) == ("2, 9", "3")
    assert found["task.pheromone.deposit"] == "set, fading"
    assert found["evaluation_epsilon"] == "0.01"
    configs = [TrainingConfig("dyna_q", 0.1, 0.9, 0.3, 0.99, planning_steps=7), SARSA]
    points = [RunPoint(worlds.paper(), Task(), one, 30, 100) for one in configs]
    found = values_in(text_of(*points))
    assert found["training.hyperparameters.planning_steps"] == "7"
    assert (found["training.learner"], found["max_steps"]) == ("dyna_q, sarsa", "100")
    assert not [name for name in found if name.startswith(("task.traffic", "task.life"))]


def test_events_have_their_values_over_all_points():
    policy = FixedPolicy.named("random", Task())
    points = [
        ColonyPoint(
            *(worlds.paper(), Task(), SARSA),
            **{"ants": 4, "episodes": 0, "policy": policy, "evaluation_epsilon": 0.25},
            protocol=(
                At(tick=tick, remove_ants=0.5),
                At(tick=20, trail={"level": level}),
                Every(ticks=50, stop=stop, task={"pheromone.level": 9}),
            ),
        )
        for tick in (100, 200)
        for level in (0, 5)
        for stop in (None, 100)
    ]
    text = text_of(*points)
    assert values_in(text.split("## 6")[1].split("## 7")[0]) == {
        **{"at.1.remove_ants.share": "0.5", "at.1.tick": "100, 200"},
        **{"at.2.trail.level": "0, 5", "at.2.tick": "20"},
        **{"every.1.task.pheromone.level": "9", "every.1.ticks": "50"},
        **{"every.1.start": "50", "every.1.stop": "off, 100"},
    }
    assert values_in(text)["evaluation_epsilon"] == "0.25"
    assert "| `at.1.tick` | 100, 200 | ticks of the episode | time of the event |" in text


def test_each_sentence_is_said_where_its_settings_hold():
    """Every sentence of a task names settings of its group; some points have some of them."""
    task = foraging().replace(
        castes={"a": {"share": 0.25, "threshold": 4, "nest": 0}, "b": {"lays": "none"}},
        labour="thresholds",
        noise={"slip": 0.25},
        life={"births": True, "lifespan": 90},
    )
    text = of_task(task, capacity=50)
    for said in (
        "With probability 0.25, an ant executes any of the five actions",
        "An ant dies at the age of 90 ticks",
        "rises by 1 per tick, and falls by 10 with each delivery",
        "The threshold of its ants is 4.",
        "Its ants lay these pheromones: none.",
        "An ant with food that wins a cell changes places",
        "ants are born and die",
    ):
        assert said in text
    assert "| ant | age | at least 0 | ticks |" in text
    assert "food grows back" not in text
    text = text_of(
        *(
            RunPoint(worlds.paper(), Task().replace(noise={"slip": p}), SARSA, 9, 9)
            for p in (0, 0.5)
        )
    )
    assert "In some of the points: With probability 0.5, an ant executes" in text
    assert "ants are born" not in text
    assert "*Traffic.*" not in text


def test_the_guide_shows_a_part_of_a_real_description():
    path = ROOT / "experiments/sweeps/trails.toml"
    text = of_sweep(plan({"file": path}), files.tomllib.loads(path.read_text()))
    guide = (ROOT / "docs/how-to/clusters.md").read_text("utf-8")
    shown = guide.split("```markdown\n")[1].split("```")[0]
    assert len(shown) > 400
    assert shown.strip() in text
