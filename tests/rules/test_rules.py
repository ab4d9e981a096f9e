"""Rules of users: what they may contain, how tasks name them, and refusals in one sentence."""

import pickle
import runpy
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from taichi_ants import (
    AntsError,
    Colony,
    Interventions,
    Pheromone,
    Task,
    TrainingConfig,
    rules,
    runtime,
    testing,
    train,
    worlds,
)
from taichi_ants.engines import own_rules as own_rules_of_kernels
from taichi_ants.features.rule import RULES, words
from taichi_ants.interventions import SetTask
from taichi_ants.reference import observations as twins
from taichi_ants.rules import pick
from taichi_ants.rules.inputs import KINDS
from taichi_ants.task import Choice, Observation, observations
from taichi_ants.task.model import Model
from taichi_ants.task.observations import observation as seen
from taichi_ants.testing import check_observation, check_rule


@pytest.fixture
def clean(monkeypatch):
    """Forget the rules that a test registers."""
    monkeypatch.setattr(RULES, "yours", dict(RULES.yours))


def test_a_task_names_rules_and_their_parameters():
    task = Task(choice="weber", pheromone=Pheromone("power_law", deposit="weaker"))
    assert list(task.rules) == ["weber", "weaker", "power_law"]
    assert task.rules["weber"].k == 20.0
    other = task.replace(rules={"weber": {"k": 3}})
    assert (other.rules["weber"].k, other.rules["weber"].exponent) == (3.0, 1.5)
    assert other != task
    assert Task.from_dict(other.as_dict()) == other == pickle.loads(pickle.dumps(other))
    greedy = other.replace(choice="greedy")  # parameters of an unused rule are dropped
    assert list(greedy.rules) == ["weaker", "power_law"]
    assert greedy.replace(choice="weber").rules["weber"].k == 20.0
    assert task.pheromone.dense
    assert not task.needs_table
    assert Choice("restless").needs_table


INF, NAN, LAST = float("inf"), float("nan"), 1 - 2**-32  # LAST is the largest input `random`
PICKS = [  # weights, random number, index
    ((1, 1, 2), 0, 0),
    ((1, 1, 2), 0.25, 1),
    ((1, 1, 2), 0.5, 2),
    ((0, 1, 0), 0, 1),  # closed cells on both sides
    ((0, 1, 0), LAST, 1),
    ((1, 0, 1), 0.5, 2),  # the closed cell lies between
    ((1, 0, 0), 1, 0),  # as after rounding
    ((1, 1, 0), 1, 1),
    ((0.1, 0.2, 0), 1 - 2**-53, 1),
    ((1e16, 1, 0), LAST, 0),
    ((0, 0, 0), 0.3, -1),
    ((-5, NAN, 0), 0.3, -1),
    ((1, INF, 1), 0.3, 1),
    ((1e308, 1e308, 1e308), 0.4, 1),
    ((1, 1, 1), NAN, 0),
]


def picks(levels, random):
    return pick(levels, random) + 1


def test_pick_draws_by_weights_and_never_what_is_closed(clean):
    for weights, random, index in PICKS:
        assert pick(weights, random) == index, (weights, random)
    runtime.start()
    rules.register("choice")(picks)
    inputs = [{"levels": weights, "random": random} for weights, random, _ in PICKS]
    in_kernels = own_rules_of_kernels._results(rules.get("picks"), inputs) - 1
    assert in_kernels.tolist() == [index for *_, index in PICKS]
    rng = np.random.default_rng(0)
    drawn = np.bincount([pick((1, 0, 3), one) for one in rng.random(10_000)], minlength=3)
    assert drawn[1] == 0
    assert abs(drawn[2] - 7500) < 5 * np.sqrt(10_000 * 0.75 * 0.25)


# The kind and the inputs of a rule, its lines, with "|" between them, and words of the message.
WRONG = """
evaporation(level): level = level + 1 => its last line, and no other, must be a return
evaporation(level): while level >= 0:|    level = 1|return 0 => line 2 of it, `while level >= 0:
evaporation(level): for _ in range(10**9):|    level = 1|return 0 => must have literal whole numbers
evaporation(level): return level * 1e308 * 1e308 * 0 => it returns nan
evaporation(level): return level - 300 => a number from 0 to 1000000000
evaporation(levl): return levl => has the argument `levl`, which is not an input
evaporation(level): return "level" if level else 0 => `'level'`, is not a number
evaporation(level): return 1 / (level - level) => ZeroDivisionError: float division by zero for lev
evaporation(level): return level + nowhere => `nowhere`, is not defined
evaporation(level): return 1 - (not level) => `not level`, is not a number; use it as a condition, a
choice(levels): return levels => is a vector; use its entries
choice(levels): return levels[3] => must have an index from 0 to 2
evaporation(level): return level**2 => `level ** 2`, is not allowed; write power(x, y), of
choice(random): return random * 4 => an action, a whole number from 0 to 4
deposit(level): return pick(level, 0.5) => `level`, is not a vector, for example `[0.2 * k for
deposit(level): a = [level, 1]|a = [1, 1, 2]|return pick(a, 0.5) => must have 2 entries, as before
choice(random): a = [1, 1]|a[1] = 0|return 1 => `a[1]`, is not allowed; assign to one name at a time
choice(random): return pick([1 for _i in range(257)], random) => 257 times; at most 256 are allowed
choice(is_open, random): return pick(is_open, random) => returns -1 for is_open=(0.0, 0.0, 0.0), ra
deposit(*level): return 0 => has the argument `*level`, which is not an input
deposit(level, word: str = 'x'): return level => `word: str = 'x'`, which is not an input of
evaporation(level): for i in range(3):|    level = level + i|return i => is used outside its loop
""".strip().splitlines()


@pytest.mark.parametrize("case", WRONG)
def test_wrong_rules_are_refused_in_one_sentence(case, clean, tmp_path):
    rule, says = case.split(" => ")
    kind, rest = rule.split("(", 1)
    source = f"def wrong({rest}".replace("): ", "):|", 1).replace("|", "\n    ")
    path = tmp_path / "wrong.py"
    path.write_text(f"from taichi_ants.rules import pick\n\n\n{source}\n")
    function = runpy.run_path(str(path))["wrong"]
    refused(says, rules.register(kind), function)
    assert "wrong" not in rules.names()


def same(level):
    return level


def test_names_are_checked(clean):
    for arguments, says in (
        ({"kind": "deposits"}, "the kind of the rule is 'deposits'"),
        ({"kind": "deposit", "name": "weber"}, "is the name of a rule of the kind 'choice'"),
    ):
        refused(says, lambda given=arguments: rules.register(**given)(same))


REFUSED = [
    (lambda: Task(choice="webber"), "weber"),
    (lambda: Task(pheromone=Pheromone(deposit="lost")), "`task.pheromone.deposit` is 'lost'"),
    (lambda: Task(rules={"weber": {"k": 2}}), "a rule that the task does not use"),
    (lambda: Task(rules={"nothing": {}}), "there is no rule 'nothing'"),
    (lambda: Task(choice="weber", rules={"weber": {"k": 31}}), "`task.rules.weber.k` is 31"),
    (lambda: Task(choice="weber", rules={"weber": {"q": 1}}), "`task.rules.weber.q` is not"),
    (lambda: Task("ants", choice="weber", noise={"misread": 0.1}), "`task.observation` is"),
    (
        lambda: train(worlds.paper(), own_config(), 0, 1, task=Task(reward="shaped")),
        "`task.reward` is 'shaped', which a run of one ant does not support",
    ),
]


def own_config():
    return TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)


@pytest.mark.parametrize(("make", "says"), REFUSED, ids=[says[:30] for _, says in REFUSED])
def test_refusals_name_the_rule(make, says):
    refused(says, make)


def test_parameters_change_without_other_kernels_and_in_an_episode(clean):
    """Ticks after a change are those of a colony with the new parameter."""
    task = Task(choice="weber", pheromone=Pheromone(deposit="weaker"))
    world = worlds.open_world(1, ranges=(8, 8, 8))
    colony = Colony(world, task, None, 0, 8, sharing="frozen")
    other = task.replace(rules={"weaker": {"amount": 7}})
    assert Model(task, learns=False) == Model(other, learns=False)
    colony.begin_episode()
    Interventions(colony).apply(SetTask((("rules.weaker.amount", 7.0),)))
    assert colony.task == other
    plain = Colony(world, other, None, 0, 8, sharing="frozen")
    plain.begin_episode()
    colony.tick(200)
    plain.tick(200)
    assert colony.deliveries == plain.deliveries
    assert np.array_equal(colony.snapshot().trail, plain.snapshot().trail)
    assert colony.deliveries[0] > 0


def test_a_built_in_function_is_listed_before_yours_and_stays(clean, monkeypatch):
    rules.register("evaporation")(same)
    monkeypatch.setattr(RULES, "built_in", {"same": RULES.yours.pop("same")})
    assert words("evaporation") == ("linear", "exponential", "none", "same", "power_law")
    assert Task(pheromone=Pheromone("same")).pheromone.own_evaporation is rules.get("same")
    with pytest.raises(AntsError, match=r"^'same' is the name of a built-in rule"):
        rules.register("evaporation")(same)


def wrong_twin(level):
    return level / 2


def test_a_rule_that_differs_from_its_twin_is_refused(clean):
    rules.register("evaporation")(same)
    RULES.yours["same"] = replace(rules.get("same"), function=wrong_twin)
    check = check_rule("same", inputs=50)
    assert "but its Python function" in check.difference
    assert str(check).startswith("same: 50 drawn inputs and 0 ticks")


def test_rules_that_read_labour_or_fields_need_them(clean):
    message = r"^the rule 'hungry' reads `threshold`; set `task\.labour`, for example to 'thresh"
    with pytest.raises(AntsError, match=message):
        Task(choice="hungry")
    castes, labour = {"one": {"threshold": 1.0}}, "thresholds"
    assert Task().replace(choice="hungry", castes=castes, labour=labour).choice.own_rule
    with pytest.raises(AntsError, match=r"^a field that the rule 'alarm' reads is 'B'; it must"):
        Task(pheromone=Pheromone(deposit="alarm"))
    with pytest.raises(AntsError, match=r"`levels_B`, which is not an input .* level_FIELD, or"):
        rules.register("deposit")(reads_ahead)


def reads_ahead(level, levels_B):  # noqa: N803
    return level


def homely(view):
    index = 2 * view.paper_state
    if view.own_B >= 1:
        index += 1
    if view.trail[0] > view.own_level:
        index = view.other_nest_ants[2] + 2 * view.ants[0]
    return index


@pytest.mark.slow
def test_an_observation_is_compared_with_the_reference(monkeypatch):
    monkeypatch.setattr(seen.OBSERVATIONS, "yours", dict(seen.OBSERVATIONS.yours))
    monkeypatch.setattr(testing, "SEEDS", 2)  # each with a kernel of its own
    observations.register(Observation("homely", 256, homely, reads=("B", "trail")))
    check = check_observation("homely")
    assert str(check) == "homely (reads the fields B and trail): 120 ticks of 2 colonies: equal"
    monkeypatch.setattr(twins, "more_cells", lambda *_: 0)
    check = check_observation("homely")
    assert check.ticks < 120
    assert check.difference.startswith("seed 0, tick ")


def test_every_input_is_used_by_the_rules_of_the_tests():
    used = {kind: set() for kind in KINDS}
    for name in rules.names():
        used[rules.get(name).kind] |= set(rules.get(name).inputs)
    for kind, known in KINDS.items():
        assert known.inputs.keys() <= used[kind], kind
