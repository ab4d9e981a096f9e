"""Rules of users: what they may contain, how tasks name them, and refusals in one sentence."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from taichi_ants import (
    AntsError,
    Colony,
    Field,
    Interventions,
    Pheromone,
    Task,
    TrainingConfig,
    rules,
    runtime,
    train,
    worlds,
)
from taichi_ants.engines import own_rules as own_rules_of_kernels
from taichi_ants.interventions import SetTask
from taichi_ants.reference import own_observations
from taichi_ants.rules import exp, log, pick, power, registry
from taichi_ants.rules.inputs import KINDS
from taichi_ants.task import Choice, Observation, observations
from taichi_ants.task.observations import registry as seen
from taichi_ants.testing import check_observation, check_rule


@pytest.fixture
def clean(monkeypatch):
    """Forget the rules that a test registers."""
    monkeypatch.setattr(registry.RULES, "yours", dict(registry.RULES.yours))


def test_a_task_names_rules_and_their_parameters():
    task = Task(choice="weber", pheromone=Pheromone("power_law", deposit="weaker"))
    assert list(task.rules) == ["weber", "weaker", "power_law"]
    assert task.rules["weber"].k == 20.0
    other = task.replace(rules={"weber": {"k": 3}})
    assert (other.rules["weber"].k, other.rules["weber"].exponent) == (3.0, 1.5)
    assert other != task
    assert Task.from_dict(other.as_dict()) == other == pickle.loads(pickle.dumps(other))
    greedy = other.replace(
        choice="greedy"
    )  # parameters of a rule that is no longer used are dropped
    assert list(greedy.rules) == ["weaker", "power_law"]
    assert greedy.replace(choice="weber").rules["weber"].k == 20.0
    assert task.pheromone.dense
    assert not task.choice.needs_table
    assert Choice("restless").needs_table


def test_functions_of_rules_equal_the_real_ones():
    for x in (1e-6, 0.3, 1.0, 2.5, 40.0):
        assert exp(x) == pytest.approx(np.exp(x), rel=1e-12)
        assert log(x) == pytest.approx(np.log(x), rel=1e-12, abs=1e-15)
        assert power(x, 1.7) == pytest.approx(x**1.7, rel=1e-12)


INF, NAN, LAST = float("inf"), float("nan"), 1 - 2**-32  # LAST is the largest input `random`
PICKS = [  # weights, random number, index
    ((1, 1, 2), 0, 0),
    ((1, 1, 2), 0.2499, 0),
    ((1, 1, 2), 0.25, 1),
    ((1, 1, 2), 0.5, 2),
    ((1, 1, 2), LAST, 2),
    ((0, 1, 0), 0, 1),  # closed cells on both sides
    ((0, 1, 0), LAST, 1),
    ((1, 0, 1), 0.5, 2),  # the closed cell lies between
    ((1, 0, 0), LAST, 0),
    ((1, 0, 0), 1, 0),  # as after rounding
    ((1, 1, 0), 1, 1),
    ((0, 1, 1), -1, 1),
    ((0.1, 0.2, 0), 1 - 2**-53, 1),
    ((1e16, 1, 0), LAST, 0),
    ((0, 0, 0), 0.3, -1),
    ((-5, NAN, 0), 0.3, -1),
    ((-5, 2, NAN), LAST, 1),
    ((1e-301, 1e-300, 0), 0, 1),
    ((1, INF, 1), 0.3, 1),
    ((INF, 0, INF), 0.5, 2),
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
    rows = np.array([[*weights, random] for weights, random, _ in PICKS], np.float64)
    in_kernels = own_rules_of_kernels._results(rules.get("picks"), rows, [3, 0]) - 1
    assert in_kernels.tolist() == [index for *_, index in PICKS]
    rng = np.random.default_rng(0)
    drawn = np.bincount([pick((1, 0, 3), one) for one in rng.random(10_000)], minlength=3)
    assert drawn[1] == 0
    assert abs(drawn[2] - 7500) < 5 * np.sqrt(10_000 * 0.75 * 0.25)


def births(level):
    return max(level, 4)


def test_rules_of_evaporation_leave_rocks_and_the_outside_alone(clean):
    rules.register("evaporation")(births)
    check = check_rule("births", 10)
    assert (check.difference, check.ticks) == ("", 360)


def homeward(nearer, codes, carries, random):
    action = pick([1, 1, 1], random)
    if carries:
        action = 1 if nearer[1] else 2 * pick([1, 1], random)
    for k in range(3):
        if codes[k] == 3:
            action = 3 + carries
    return action


@pytest.mark.parametrize("traffic", ["blocking", "following"])
def test_a_cell_with_an_ant_is_as_near_as_without_it(traffic, clean):
    rules.register("choice")(homeward)
    world = worlds.open_world(1, ranges=(7, 7, 7))
    task = Task(choice="homeward", traffic=traffic).replace(life={"regrowth": 0})
    colony = Colony(world, task, None, 0, 50, sharing="frozen")
    colony.begin_episode()
    far, occupied = colony.grid.distances((0, 0, 0)), 0  # from the queen, by cell
    for _ in range(60):
        cells, headings = colony.cells[0].copy(), colony.headings[0].copy()
        carries = colony.carrying[0].copy()
        colony.tick()
        for ant in np.flatnonzero(carries & (colony.actions[0] < 3)):
            ahead = cells[ant] + colony.grid.offsets[headings[ant]]
            if ahead in cells:
                occupied += 1
                assert (colony.actions[0, ant] == 1) == (far[ahead] < far[cells[ant]])
    assert occupied > 30


def straight(is_open, codes, carries, random):
    action = 1 if is_open[1] else 2 * pick([1, 1], random)
    for k in range(3):
        if codes[k] == 3:
            action = 3 + carries
    return action


@pytest.mark.parametrize("cue", ["compass", "trail"])
@pytest.mark.parametrize(
    "traffic",
    ["right_of_way", *(pytest.param(t, marks=pytest.mark.slow) for t in ("blocking", "following"))],
)
def test_a_cell_with_an_ant_is_open_by_traffic_with_and_without_a_compass(traffic, cue, clean):
    rules.register("choice")(straight)
    world = worlds.open_world(1, ranges=(7, 7, 7))
    task = Task(choice="straight", traffic=traffic, homing_cue=cue).replace(life={"regrowth": 0})
    colony, seen = Colony(world, task, None, 0, 50, sharing="frozen"), {False: 0, True: 0}
    colony.begin_episode()
    for _ in range(60):
        cells, carries = colony.cells[0].copy(), colony.carrying[0].copy()
        ahead = cells + colony.grid.offsets[colony.headings[0]]
        colony.tick()
        for ant in np.flatnonzero(np.isin(ahead, cells) & (colony.actions[0] < 3)):
            seen[bool(carries[ant])] += 1
            enters = traffic == "following" or (traffic == "right_of_way" and carries[ant])
            assert (colony.actions[0, ant] == 1) == enters
    assert min(seen.values()) > 5


def test_nothing_is_nearer_without_a_compass(clean):
    rules.register("choice")(homeward)
    world = worlds.open_world(1, ranges=(7, 7, 7))
    task = Task(choice="homeward", homing_cue="trail").replace(life={"regrowth": 0})
    colony, moves = Colony(world, task, None, 0, 50, sharing="frozen"), 0
    colony.begin_episode()
    for _ in range(60):
        carries = colony.carrying[0].copy()
        colony.tick()
        moves += np.count_nonzero(carries & (colony.actions[0] < 3))
        assert not (carries & (colony.actions[0] == 1)).any()
    assert moves > 30


def no_return(level):
    level = level + 1


def two_returns(level):
    if level > 1:
        return level
    return 0


def forever(level):
    while level >= 0:
        level = level + 1
    return level


def endless(level):
    for _ in range(10**9):
        level = level + 1
    return level


def many_loops(level):
    for _i in range(64):
        for _j in range(64):
            level = level + 0
    return level


def not_a_number(level):
    return level * 1e308 * 1e308 * 0


def too_large(level):
    return level + 2e9


def negative(level):
    return level - 300


def unknown_input(levl):
    return levl


def calls(level):
    return round(level)


def imports(level):
    import math

    return math.floor(level)


def writes(level):
    level[0] = 3
    return level


def text(level):
    return "level" if level else 0


def divides(level):
    return 1 / (level - level)


def roots(level):
    return power(0 - level, 0.5)


def undefined(level):
    return level + nowhere  # noqa: F821


def bits(level):
    return level & 3


def both(level, least=2.0):
    return level and least


def negated(level):
    return 1 - (not level)


def whole_vector(levels):
    return levels


def outside(levels):
    return levels[3]


def far_entry(levels, random):
    return levels[3 + random] * 0


def tuples(level):
    level, other = 1, 2
    return level + other


def starred(*level):
    return 0


def bad_default(level, amount: float = -1.0, word: str = "x"):
    return level


def after_loop(level):
    for i in range(3):
        level = level + i
    return i


def square(level):
    return level**2


def half(random):
    return random * 4


def picks_a_number(level):
    return pick(level, 0.5)


def filtered(level):
    return 1 + pick([k for k in range(3) if k], level)


def lengthens(level):
    weights = [level, 1]
    weights = [level, 1, 2]
    return 1 + pick(weights, 0.5)


def changes(random):
    weights = [1, 1, 1]
    weights[1] = 0
    return pick(weights, random)


def replaces_an_input(levels, random):
    levels = [1, 1, 1]
    return pick(levels, random)


def any_entry(random):
    weights = [1, 1, 1]
    return weights[random * 3 // 1]


def long_list(random):
    return min(pick([1 for _i in range(257)], random), 4)


def nothing_open(is_open, random):
    return pick(is_open, random)


WRONG = [
    ("evaporation", no_return, "its last line, and no other, must be a return"),
    ("evaporation", two_returns, "its last line, and no other, must be a return"),
    ("evaporation", forever, "line 2 of it, `while level >= 0:"),
    ("evaporation", endless, "must have literal whole numbers"),
    ("evaporation", many_loops, "repeats 4096 times; at most 256 are allowed"),
    ("evaporation", not_a_number, "it returns nan"),
    ("evaporation", too_large, "but must return the level of a cell after the tick"),
    ("evaporation", negative, "a number from 0 to 1000000000"),
    ("evaporation", unknown_input, "has the argument 'levl', which is not an input"),
    ("evaporation", calls, "calls another function than exp, log, power, pick, min, max, abs"),
    ("evaporation", imports, "`import math`, is not allowed"),
    ("evaporation", writes, "assign to one name at a time"),
    ("evaporation", text, "`'level'`, is not a number"),
    ("evaporation", divides, "ZeroDivisionError: float division by zero, for level="),
    ("deposit", roots, "x must be above 0"),
    ("evaporation", undefined, "`nowhere`, is not defined"),
    ("evaporation", bits, "`level & 3`, is not allowed"),
    ("evaporation", both, "`level and least`, is not a number; use it as a condition, as in"),
    ("evaporation", negated, "`not level`, is not a number; use it as a condition, as in"),
    ("choice", whole_vector, "is a vector; use its entries"),
    ("choice", outside, "must have an index from 0 to 2"),
    ("choice", far_entry, "IndexError: there is no entry 3"),
    ("evaporation", square, r"`level ** 2`, is not allowed; write power(x, y), of"),
    ("choice", half, "an action, a whole number from 0 to 4"),
    ("deposit", picks_a_number, "`level`, is not a vector, for example `[0.2 * k for"),
    ("deposit", filtered, "if k]`, is not a vector"),
    ("deposit", lengthens, "`weights = [level, 1, 2]`, must have 2 entries, as before"),
    ("choice", changes, "`weights[1]`, is not allowed; assign to one name at a time"),
    ("choice", replaces_an_input, "`levels`, cannot be assigned; choose another name"),
    ("choice", any_entry, "must have a literal number or the name of a loop as index"),
    ("choice", long_list, "repeats 257 times; at most 256 are allowed"),
    ("choice", nothing_open, "it returns -1 for is_open=(0.0, 0.0, 0.0), random="),
    ("evaporation", tuples, "assign to one name at a time"),
    ("deposit", starred, "use plain arguments"),
    ("deposit", bad_default, "declare a whole number (int) or a number (float)"),
    ("evaporation", after_loop, "is used outside its loop"),
    ("evaporation", lambda level: level, "it must be a function defined with def"),
]


@pytest.mark.parametrize(("kind", "function", "says"), WRONG, ids=[f.__name__ for _, f, _ in WRONG])
def test_wrong_rules_are_refused_in_one_sentence(kind, function, says, clean):
    with pytest.raises(AntsError) as caught:
        rules.register(kind)(function)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert function.__name__ not in rules.names()


def same(level):
    return level


def test_names_are_checked(clean):
    for arguments, says in (
        ({"kind": "deposits"}, "the kind of the rule is 'deposits'"),
        ({"kind": "deposit", "name": "set"}, "is the name of a built-in rule"),
        ({"kind": "deposit", "name": "a b"}, "must be a word"),
        ({"kind": "deposit", "name": "weber"}, "is the name of a rule of the kind 'choice'"),
        ({"kind": "deposit", "reference": shaped_twin}, "it must have the same arguments"),
    ):
        with pytest.raises(AntsError) as caught:
            rules.register(**arguments)(same)
        assert says in str(caught.value)


def shaped_twin(level, more):
    return level


REFUSED = [
    (lambda: Task(choice="webber"), "weber"),
    (lambda: Task(pheromone=Pheromone(deposit="lost")), "`task.pheromone.deposit` is 'lost'"),
    (lambda: Task(rules={"weber": {"k": 2}}), "a rule that the task does not use"),
    (lambda: Task(rules={"nothing": {}}), "there is no rule 'nothing'"),
    (lambda: Task(choice="weber", rules={"weber": {"k": 31}}), "`task.rules.weber.k` is 31"),
    (lambda: Task(choice="weber", rules={"weber": {"q": 1}}), "`task.rules.weber.q` is not"),
    (lambda: Task("ants", choice="weber", noise={"misread": 0.1}), "`task.noise` is"),
    (
        lambda: train(worlds.paper(), own_config(), 0, 1, task=Task(reward="shaped")),
        "`task.reward` is 'shaped', which a run of one ant does not support",
    ),
]


def own_config():
    return TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)


@pytest.mark.parametrize(("make", "says"), REFUSED, ids=[says[:30] for _, says in REFUSED])
def test_refusals_name_the_rule(make, says):
    with pytest.raises(AntsError) as caught:
        make()
    assert says in str(caught.value)


def reads_a_field(levels_home):
    return 0 * levels_home[0]


def test_a_rule_that_reads_a_field_needs_it(clean):
    rules.register("choice")(reads_a_field)
    with pytest.raises(
        AntsError, match=r"'reads_a_field' reads is 'home'; it must be one of trail"
    ):
        Task(choice="reads_a_field")
    Task(choice="reads_a_field", fields={"home": Field()})


def test_parameters_change_without_other_kernels_and_in_an_episode(clean):
    """Ticks after a change are those of a colony with the new parameter."""
    task = Task(choice="weber", pheromone=Pheromone(deposit="weaker"))
    world = worlds.open_world(1, ranges=(8, 8, 8))
    colony = Colony(world, task, None, 0, 8, sharing="frozen")
    other = task.replace(rules={"weaker": {"amount": 7}})
    assert task.compiled(learning=False) == other.compiled(learning=False)
    colony.begin_episode()
    SetTask((("rules.weaker.amount", 7.0),)).apply(Interventions(colony))
    assert colony.task == other
    plain = Colony(world, other, None, 0, 8, sharing="frozen")
    plain.begin_episode()
    colony.tick(200)
    plain.tick(200)
    assert colony.deliveries == plain.deliveries
    assert np.array_equal(colony.snapshot().trail, plain.snapshot().trail)
    assert colony.deliveries[0] > 0


def test_a_colony_file_keeps_the_rule(tmp_path, clean):
    colony = Colony(worlds.paper(), Task(choice="weber"), None, 0, 3, sharing="frozen")
    colony.begin_episode()
    colony.save(tmp_path / "colony.npz")
    assert Colony.load(tmp_path / "colony.npz") == colony
    del registry.RULES.yours["weber"]
    with pytest.raises(AntsError, match="weber"):
        Colony.load(tmp_path / "colony.npz")


def wrong_twin(level):
    return level / 2


def test_a_rule_that_differs_from_its_twin_is_refused(clean):
    rules.register("evaporation", reference=wrong_twin)(same)
    check = check_rule("same", inputs=50)
    assert "but its Python function" in check.difference
    assert str(check).startswith("same: 50 drawn inputs and 0 ticks")


def fails_at_large(level):
    if level > 5e8:
        raise KeyError("a twin")
    return level


def differs_in_places(level):
    return level if not 1e6 < level < 2e6 else 0


def test_twins_are_asked_for_all_levels_that_occur_and_named_if_they_fail(clean):
    rules.register("evaporation", reference=fails_at_large)(same)
    says = "its Python function fails (KeyError: 'a twin') for level="
    assert check_rule("same").difference.startswith(says)
    registry.RULES.yours["same"] = replace(rules.get("same"), reference=differs_in_places)
    assert "but its Python function 0.0" in check_rule("same").difference


def test_rules_that_read_labour_or_fields_need_them(clean):
    message = r"^the rule 'hungry' reads `threshold`; set `task\.labour\.rule` to 'thresholds'\.$"
    with pytest.raises(AntsError, match=message):
        Task(choice="hungry")
    castes, labour = {"one": {"threshold": 1.0}}, "thresholds"
    assert Task().replace(choice="hungry", castes=castes, labour=labour).choice.own_rule
    with pytest.raises(AntsError, match=r"^a field that the rule 'alarm' reads is 'B'; it must"):
        Task(pheromone=Pheromone(deposit="alarm"))
    with pytest.raises(AntsError, match=r"'levels_B', which is not an input .* level_FIELD, or"):
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


def test_an_observation_is_compared_with_the_reference(monkeypatch):
    monkeypatch.setattr(seen.OBSERVATIONS, "yours", dict(seen.OBSERVATIONS.yours))
    observations.register(Observation("homely", 256, homely, reads=("B", "trail")))
    check = check_observation("homely")
    assert str(check) == "homely (reads the fields B and trail): 360 ticks of 6 colonies: equal"
    monkeypatch.setattr(own_observations, "codes_seen", lambda *_: [0, 0, 0])
    check = check_observation("homely")
    assert check.ticks < 360
    assert check.difference.startswith("seed 0, tick ")


LONG = pytest.mark.long


@pytest.mark.parametrize(
    "name", ["alarm", *(pytest.param(n, marks=LONG) for n in ("hungry", "demanded"))]
)
def test_rules_that_read_other_fields_and_labour_equal_the_reference(name):
    assert check_rule(name, 100).difference == ""


def test_every_input_is_used_by_the_rules_of_the_tests():
    used = {kind: set() for kind in KINDS}
    for name in rules.names():
        used[rules.get(name).kind] |= set(rules.get(name).inputs)
    for kind, known in KINDS.items():
        assert known.inputs.keys() <= used[kind], kind
