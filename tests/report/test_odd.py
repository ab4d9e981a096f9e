"""ODD descriptions: complete for any task, and true to the rules that a study uses."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from command_lines import ROOT

from taichi_ants import AntsError, TrainingConfig, files, learners, worlds
from taichi_ants.protocol import At, Every
from taichi_ants.report.odd import RULES, Model, described
from taichi_ants.settings import MISSING, all_of, declared, flat
from taichi_ants.studies.points import ColonyPoint, RunPoint
from taichi_ants.studies.runner import Study
from taichi_ants.studies.sweep import read_sweep
from taichi_ants.task import Field, Food, Pheromone, Task, foraging, queueing
from taichi_ants.task.choice import Choice
from taichi_ants.task.field import Field as FieldSettings

SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99)
HEADINGS = [
    *("Purpose and patterns", "Entities, state variables and scales"),
    *("Process overview and scheduling", "Design concepts", "Initialisation", "Input data"),
    "Submodels",
]
CONCEPTS = [
    *("Basic principles", "Emergence", "Adaptation", "Objectives", "Learning", "Prediction"),
    *("Sensing", "Interaction", "Stochasticity", "Collectives", "Observation"),
]


def text_of(*points, sweep=None, **more):
    settings = {**Study(points, (3, 4)).settings(), **more}
    asked = {"command": "sweep", "options": {}}
    plain = json.loads(files.to_json(settings))
    return described(Model(plain, asked, sweep or {}), "taichi-ants sweep my.toml")


_WORDS = {"True": "yes", "False": "no", "None": "off"}


def of_task(task, **more):
    without = {} if task.choice.needs_table else {"episodes": 0}
    return text_of(ColonyPoint(worlds.paper(), task, SARSA, ants=4, **without), **more)


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
    """A task with several changes that fit together, and further fields and kinds of food."""
    task = Task()
    if rng.random() < 0.5:
        laid = str(rng.choice(["without_food", "always", "never"]))
        home = {"laid": laid, "deposit": "fading", "slope": int(rng.integers(1, 9))}
        task = task.but(fields={"home": home}, homing_cue="home")
    if rng.random() < 0.3:
        task = task.but(foods={"seed": Food(loads=3)})
    scalars = [one for one in all_of(Task) if not one.is_group and one.default is not MISSING]
    scalars = [one for one in scalars if one.kind in (bool, int, float, str) and not one.is_text]
    scalars = [one for one in scalars if len(one.allowed_words) != 1]
    for one in rng.choice(np.array(scalars, object), 8, replace=False):
        setting = next(each for each in scalars if each.path == one[1])
        change = {setting.path.split(".")[-1]: drawn(setting, rng)}
        for part in reversed(setting.path.split(".")[1:-1]):
            change = {part: change}
        try:
            task = task.but(**change)
        except AntsError:
            continue
    return task


def differing(task):
    """The settings of a task that differ from their defaults, by full name."""
    usual = flat({"task": Task().as_dict()})
    for name, entries in (("fields", FieldSettings()), ("foods", Food())):
        for entry in getattr(task, name):
            for one in declared(type(entries)):
                usual[f"task.{name}.{entry}.{one.name}"] = getattr(entries, one.name)
    own = flat({"task": task.as_dict()})
    return {name: value for name, value in own.items() if value != usual[name]}


@pytest.mark.parametrize("seed", range(60))
def test_every_setting_that_differs_is_named_with_its_value(seed):
    task = random_task(np.random.default_rng(seed))
    text = of_task(task)
    rows = dict(re.findall(r"^\| `(task\.[\w.]+)` \| ([^|]*) \|", text, re.M))
    wanted = differing(task)
    assert rows.keys() == wanted.keys()
    for name, value in wanted.items():
        assert rows[name] == _WORDS.get(str(value), str(value).removesuffix(".0")), name
    assert "{" not in text.replace("`{", "")


def test_the_protocol_has_all_of_its_parts():
    text = of_task(Task())
    for number, heading in enumerate(HEADINGS, start=1):
        assert f"\n## {number}. {heading}\n" in text
    found = [text.index(f"\n**{concept}.** ") for concept in CONCEPTS]
    assert found == sorted(found)
    assert "Grimm, V. et al. (2020)" in text


def test_each_rule_of_the_package_has_a_text():
    words = {one.path: one.words for one in all_of(Task)}
    words |= {one.path: one.words for one in declared(Field)}
    for path, texts in {
        "task.pheromone.evaporation": RULES["evaporation"],
        "task.pheromone.deposit": RULES["deposit"],
        "task.pheromone.view": RULES["view"],
        "task.fields.NAME.laid": RULES["laid"],
        "task.choice.rule": RULES["choice"],
        "task.delivery": RULES["delivery"],
        "task.labour.rule": RULES["labour"],
    }.items():
        assert {*texts} >= {*words[path]}, path
    traffic = {one.name for one in all_of(Task) if one.path.startswith("task.traffic.")}
    assert {*RULES["traffic"]} == traffic
    assert {*RULES["learners"]} == {*learners.registry.BUILT_IN}
    assert {*RULES["worlds"]} == {*worlds.registry.BUILT_IN}


@pytest.mark.parametrize(
    ("task", "has", "lacks"),
    [
        (Task(), ["c = 250", "max(c - 1, 0)"], ["half-life", "diffus", "7.7", "slips"]),
        (foraging(), ["max(c, 500 - 10 · a)", "`swap`: An ant with food"], ["`follow`"]),
        (queueing(), ["`follow`: ", "`carriers_first`: ", "the ant turns round"], []),
        (
            Task(pheromone=Pheromone("exponential", half_life=7.5, diffusion=0.25)),
            ["the half-life h is 7.5", "the share 0.25 / 6"],
            ["max(c - 1, 0)"],
        ),
        (
            Task(choice=Choice("deneubourg", k=3, exponent=1.5)),
            ["k is 3, n is 1.5"],
            ["temperature"],
        ),
        (Task().but(noise={"slip": 0.125}), ["0.125"], []),
        (Task().but(life={"regrowth": 0}), ["grows back in its cell 0 ticks"], ["dies at age"]),
        (
            Task().but(castes={"old": {"threshold": 7}, "young": {}}, labour="thresholds"),
            ["2 castes: old and young (7.8)", "threshold.value 7", "rises by 1 per tick, and f"],
            ["All ants forage"],
        ),
        (Task().but(life={"lifespan": 70}), ["dies at age 70 ticks"], ["grows back in"]),
        (
            Task().but(fields={"home": {"laid": "dead_end"}}, homing_cue="home"),
            ["*Field `home`.* An ant without food that sees three", "S: by the levels of `home`"],
            ["nearer to the queen than"],
        ),
    ],
)
def test_submodels_are_those_of_the_task(task, has, lacks):
    text = of_task(task)
    for words in has:
        assert words in text, words
    for words in lacks:
        assert words not in text, words


def test_points_that_differ_are_described_together():
    tasks = [Task(), Task(pheromone=Pheromone(deposit="fading", slope=3))]
    points = [ColonyPoint(worlds.paper(), task, SARSA, ants=n) for task in tasks for n in (2, 9)]
    text = text_of(*points)
    assert 'With `task.pheromone.deposit` "set": A deposit sets the level of the cell: `c' in text
    assert "`c = max(c, 250 - 3 · a)`" in text
    assert "The number of ants at the start is 2 or 9." in text
    assert "| `task.pheromone.slope` | off or 3 | off |" in text


def test_one_ant_and_its_learner_are_described():
    config = TrainingConfig("dyna_q", 0.1, 0.9, 0.3, 0.99, planning_steps=7)
    text = text_of(RunPoint(worlds.paper(), Task(delivery="truncates"), config, 30, 100))
    assert "followed by 7 updates of pairs" in text
    assert "An episode has at most 100 ticks." in text
    assert "| `max_steps` | 100 | 600 |" in text
    assert "There is one ant, so there are no conflicts." in text
    assert "one ant on a hexagonal grid learns by reinforcement" in text


def test_events_and_fixed_policies_are_described():
    from taichi_ants.studies.points import FixedPolicy

    policy = FixedPolicy.named("random", Task())
    point = ColonyPoint(
        *(worlds.paper(), Task(), SARSA),
        ants=4,
        episodes=0,
        policy=policy,
        protocol=(At(tick=30, remove_ants=0.5),),
    )
    text = text_of(point, sweep={"world": {"preset": "my map.txt"}})
    assert "- *at*: remove_ants.share 0.5; tick 30" in text
    assert "| `protocol` | 1 event | none |" in text
    assert f"Ants follow the policy random, with SHA-256 `{policy.sha256}`" in text
    assert "**Learning.** None: ants follow a fixed rule or policy." in text
    assert "- `my map.txt`: a text map or a world of the plugin" in text
    assert "7.6 Learning" not in text
    alone = text_of(RunPoint(worlds.paper(), Task(), SARSA, 0, 100, policy=policy))
    assert "one ant on a hexagonal grid forages by a fixed rule" in alone
    assert "7.6 Learning" not in alone


def test_an_event_that_varies_is_described_once():
    points = [
        ColonyPoint(
            *(worlds.paper(), Task(), SARSA),
            ants=4,
            protocol=(
                At(tick=tick, remove_ants=0.5),
                At(tick=20, trail={"level": level, **field}),
                Every(ticks=50, stop=stop, task={"pheromone.level": 9}),
            ),
        )
        for tick in (100, 200)
        for level, field in ((0, {}), (5, {}), (9, {"field": "trail"}))
        for stop in (None, 100)
    ]
    events = re.findall(r"^- (\*(?:at|every|when)\*.*)$", text_of(*points), re.M)
    assert events == [
        "*at*: remove_ants.share 0.5; tick 100 or 200",
        "*at*: trail.level 0, 5 or 9; tick 20",
        "*every*: task.pheromone.level 9; ticks 50; start 50; stop off or 100",
    ]
    home = Task(fields={"home": {}})
    points = [
        ColonyPoint(worlds.paper(), home, SARSA, protocol=At(3, trail={"level": 1, "field": name}))
        for name in ("trail", "home")
    ]
    assert "- *at*: trail.level 1; tick 3; trail.field trail or home" in text_of(*points)


def test_what_a_search_chooses_for_an_event_is_described():
    point = ColonyPoint(worlds.paper(), Task(), SARSA, protocol=Every(ticks=50, trail=0))
    vary = {"every.1.stop": {"from": 60, "to": 90}, "every.1.trail.field": ["trail", "home"]}
    more = {"search.trials": 3, "search.prune_after": None, "search.held_out": [5]}
    text = text_of(point, sweep={"search": {"maximise": "deliveries", "vary": vary}}, **more)
    event = "every*: trail.level 0; ticks 50; start 50; stop 60 to 90; trail.field trail or home"
    assert event in text


def test_the_unit_of_a_level_is_that_of_its_evaporation():
    fades = {"evaporation": "exponential", "half_life": 7}
    task = Task().but(fields={"home": fades, "mark": {"evaporation": "none"}})
    text = of_task(task)
    assert "pheromone that ants lay | level; linear evaporation removes 1 per tick |" in text
    assert (
        "| `home` | level of a further pheromone | level; exponential evaporation halves it in 7 t"
        in text
    )
    assert "| `mark` | level of a further pheromone | level |" in text
    both = [Task(), Task().but(pheromone=fades)]
    text = text_of(*(ColonyPoint(worlds.paper(), one, SARSA) for one in both))
    assert "linear evaporation removes 1 per tick or exponential evaporation halves it in 7" in text


def test_sentences_are_short_and_tables_have_even_rows():
    text = of_task(queueing(), capacity=9)
    for block in text.split("\n\n"):
        if block.startswith("|"):
            assert len({re.sub(r"\\\|", "", line).count("|") for line in block.split("\n")}) == 1
        else:
            for sentence in re.split(r"(?<=[.:])\s", block.split("## References")[0]):
                assert len(sentence.split()) <= 45, sentence


def test_the_guide_shows_a_part_of_a_real_description():
    path = ROOT / "experiments/sweeps/trails.toml"
    facts = json.loads(files.to_json(read_sweep(path).facts()))
    asked = {"command": "sweep", "options": {}}
    text = described(Model(facts, asked, files.tomllib.loads(path.read_text())), "")
    guide = (ROOT / "docs/archives.md").read_text("utf-8")
    shown = guide.split("```markdown\n")[1].split("```")[0]
    assert len(shown) > 1000
    assert " ".join(shown.split()) in " ".join(text.split())
