"""Castes, thresholds and idle ants: what always holds, distributions, files, and refusals."""

import numpy as np
import pytest
from scipy.stats import kstest, lognorm, truncnorm, uniform

from taichi_ants import AntsError, Colony, Task, TrainingConfig, task, worlds
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.features.castes import chances_in, numbers_in
from taichi_ants.interventions import SetTask
from taichi_ants.learners.policies import random_policy, save_policy, trail_follower
from taichi_ants.task import Labour, Threshold

TRAINING = TrainingConfig("q_learning", 0.5, 0.9, 0.1, 1.0)
WORLD = worlds.open_world(seed=3, ranges=(50, 50, 50))
LABOUR = Labour("thresholds", demand=6.0, relief=0.0, stop_probability=0.0)


def follows(rules: Task, world=WORLD, seeds=0, **options) -> Colony:
    """A colony in which all ants follow a hand-written rule, in its first episode."""
    given = {"sharing": "frozen", "q_values": trail_follower(rules.observation), **options}
    colony = Colony(world, rules, TRAINING, seeds, **given)
    colony.begin_episode()
    return colony


@pytest.mark.parametrize(
    ("castes", "n", "numbers", "chances"),
    [
        ({"a": {"share": 0.5}, "b": {"share": 0.3}, "c": {"share": 0.2}}, 7, [4, 2, 1], None),
        ({"a": {"share": 0.5}, "b": {"share": 0.5}}, 3, [2, 1], [0.5, 0.5]),
        ({"a": {}, "b": {}, "c": {}}, 5, [2, 2, 1], [1 / 3] * 3),
        ({"a": {"ants": 2}, "b": {"share": 0.75}, "c": {}}, 10, [2, 6, 2], [0.2, 0.6, 0.2]),
        ({"a": {"nest": 1}, "b": {"nest": 0}}, 4, [0, 4], [0.0, 1.0]),
        ({"a": {"ants": 3}}, 3, [3], [1.0]),
    ],
)
def test_ants_of_a_nest_are_divided_by_shares(castes, n, numbers, chances):
    given = Task(castes=castes).castes
    assert numbers_in(given, 0, n) == numbers
    found = chances_in(given, 0, n)
    assert found == pytest.approx(chances or [one["share"] for one in castes.values()])


@pytest.mark.parametrize(
    ("threshold", "law"),
    [
        (Threshold("uniform", 5, 2), uniform(3, 4).cdf),
        (Threshold("normal", 1, 2), truncnorm(-0.5, np.inf, 1, 2).cdf),
        (Threshold("lognormal", 4, 0.7), lognorm(0.7, scale=4).cdf),
    ],
    ids=["uniform", "normal", "lognormal"],
)
def test_thresholds_have_their_distribution(threshold, law):
    """They last through episodes, and do not depend on the other worlds."""
    rules = Task(castes={"worker": {"threshold": threshold}}, labour=LABOUR)
    colony = follows(rules, seeds=[4, 5], ants=2000)
    drawn = colony.thresholds
    assert kstest(drawn[0], law).pvalue > 0.001
    assert drawn.dtype == np.float32
    assert not (drawn[0] == drawn[1]).any()
    colony.end_episode()
    colony.begin_episode()
    assert (colony.thresholds == drawn).all()
    assert (follows(rules, seeds=5, ants=2000).thresholds[0] == drawn[1]).all()


def test_exploration_rates_differ_between_the_ants_of_a_caste():
    """Ants that explore at random turn; each ant has the same rate in all episodes."""
    castes = {"one": {"epsilon": 0.5, "epsilon_spread": 0.5}}
    straight = np.zeros((128, 5), np.float32)
    straight[:, 3] = 1.0  # without food in view, this action does nothing
    rule, rates = TrainingConfig("q_learning", 1.0, 1.0, 0.0, 1.0), []
    colony = Colony(WORLD, Task(castes=castes), rule, 7, 300, sharing="frozen", q_values=straight)
    for _ in range(2):
        colony.begin_episode()
        others = np.zeros(300)
        for _ in range(200):
            colony.tick()
            others += colony.actions[0] != 3
        rates.append(others / 200 / 0.8)  # a fifth of random actions is the best one
        colony.end_episode()
    assert kstest(rates[0].clip(0, 1), uniform(0, 1).cdf).pvalue > 0.001
    assert np.corrcoef(*rates)[0, 1] > 0.95


@pytest.mark.parametrize("exponent", [1.0, 2.0, 2.5])
def test_idle_ants_respond_to_the_stimulus(exponent):
    """After s^n / (s^n + t^n), with s = 6 in the second tick and t = 4."""
    rules = Task(castes={"worker": {"threshold": 4}}, labour=Labour("thresholds", 6, 0, exponent))
    colony = follows(rules, ants=4000, start="spread")
    colony.tick()
    assert colony.idle.all()  # the stimulus was 0
    colony.tick()
    chance = 6**exponent / (6**exponent + 4**exponent)
    error = np.sqrt(chance * (1 - chance) / 4000)
    quits = (~colony.idle).mean()  # some foragers at the nest may have become idle again
    assert chance - 4 * error - 0.002 < quits < chance + 4 * error
    assert colony.stimuli.tolist() == [[12.0]]


def test_ants_that_stop_foraging_are_without_food_next_to_their_queen():
    castes = {"worker": {"threshold": Threshold("lognormal", 5, 1)}}
    rules = task.foraging().replace(
        castes=castes, labour=Labour("thresholds", 1, 1, stop_probability=0.5)
    )
    colony, stopped = follows(rules, ants=60), 0
    near = WORLD.distances() == 1
    for _ in range(200):
        foraged = ~colony.idle
        colony.tick()
        stops = foraged & colony.idle
        assert near[colony.cells[stops]].all()
        assert not colony.carrying[stops].any()
        stopped += np.count_nonzero(stops)
    assert stopped > 20


def test_a_file_of_a_colony_needs_no_policy_file(tmp_path):
    policy = tmp_path / "policy.npz"
    save_policy(policy, random_policy(), {})
    colony = follows(Task(castes={"lost": {"policy": str(policy)}}), ants=5, q_values=None)
    colony.tick(3)
    colony.save(tmp_path / "colony.npz")
    policy.unlink()
    again = Colony.load(tmp_path / "colony.npz")
    assert again == colony
    with pytest.raises(AntsError, match=r"policy\.npz"):
        follows(colony.task, ants=5)


def test_numbers_of_castes_change_in_an_episode():
    castes = {"a": {"share": 0.5, "threshold": 3.0}, "b": {"threshold": 9.0}}
    colony = follows(Task(castes=castes, labour=LABOUR), ants=5)
    interventions = Interventions(colony)
    interventions.apply(SetTask((("castes.a.lifespan", None), ("castes.a.epsilon", 1.0))))
    assert colony.arrays["castes"][0].tolist() == [1.0, -1.0]
    interventions.apply(SetTask((("labour.demand", 2.0),)))
    assert colony.arrays["labour_numbers"][0] == 2.0
    for name, fixed in (("share", 0.25), ("policy", "random"), ("threshold", Threshold())):
        with pytest.raises(AntsError, match=f"cannot change castes.a.{name}"):
            interventions.apply(SetTask(((f"castes.a.{name}", fixed),)))
