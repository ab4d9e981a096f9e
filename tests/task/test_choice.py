"""Rules of choice and noise: frequencies of choices, closed forms, and what is refused."""

import numpy as np
import pytest
from scipy.stats import chisquare

from taichi_ants import Colony, Task, TrainingConfig, World, worlds
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.learners.policies import action_probabilities
from taichi_ants.task import Choice, Field, Noise, Pheromone
from taichi_ants.task.constants import N_ACTIONS

N, GRID = 6_000, AxialGrid((10, 10, 2))
PLAIN = TrainingConfig("q_learning", 0.5, 0.9, 0.0, 1.0)
GREEDY_VALUES = np.tile(np.float32([0.0, 3.0, 1.0, 2.0, -1.0]), (128, 1))


def lone_ant(trails=(), carries_home=False) -> World:
    """A world in which an ant at (5, 5, 0), which faces away from the queen, can move freely."""
    queen = (5, 8, 0) if carries_home else (0, 9, 0)
    return World((10, 10, 2), queen, foods=[(9, 0, 0)], trails=trails, ants=[((5, 5, 0), 0)])


def first_actions(rules: Task, world: World, n: int = N, **options) -> tuple[np.ndarray, ...]:
    """Return the chosen and executed actions of n ants, each alone in its world, in a tick."""
    colony = Colony(world, rules, seeds=range(n), sharing="frozen", **options)
    colony.begin_episode()
    colony.tick()
    return colony.actions[:, 0].copy(), colony.executed[:, 0].copy(), colony.states[:, 0].copy()


def assert_counts(values: np.ndarray, shares: np.ndarray) -> None:
    counts = np.bincount(values, minlength=len(shares))
    shares = np.asarray(shares, float) / np.sum(shares, dtype=float)
    assert not counts[shares == 0].any()
    possible = shares > 0
    assert chisquare(counts[possible], shares[possible] * len(values)).pvalue > 0.001, counts


@pytest.mark.parametrize("epsilon", [0.0, 0.3])
def test_softmax_frequencies(epsilon):
    """Also with exploration, whose actions are uniform."""
    training = TrainingConfig("q_learning", 0.5, 0.9, epsilon, 1.0)
    rules = Task(choice=Choice("softmax", temperature=1.5))
    chosen, *_ = first_actions(rules, lone_ant(), training=training, q_values=GREEDY_VALUES)
    weights = np.exp(GREEDY_VALUES[0].astype(float) / 1.5)
    shares = epsilon / N_ACTIONS + (1 - epsilon) * weights / weights.sum()
    assert_counts(chosen, shares)
    known = action_probabilities(GREEDY_VALUES[0], epsilon, rules.choice)
    np.testing.assert_allclose(known, shares, atol=1e-9)


@pytest.mark.parametrize(("k", "exponent"), [(20.0, 2.0), (20.0, 1.5), (1.0, 0.0)])
def test_frequencies_of_deneubourgs_rule(k, exponent):
    """Levels 0, 20 and 60 left, forward and right of an ant without food."""
    around = GRID.index((5, 5, 0)) + GRID.offsets[[0, 1]]
    forward, right = (tuple(cell) for cell in GRID.cells(around).tolist())
    world = lone_ant([(forward, 20), (right, 60)])
    rules = Task(choice=Choice("deneubourg", k=k, exponent=exponent))
    chosen, *_ = first_actions(rules, world, training=None)
    weights = (k + np.array([0, 20, 60])) ** exponent
    assert_counts(chosen, weights / weights.sum())


@pytest.mark.parametrize(("followed", "levels"), [(None, [0, 20, 60]), ("calm", [0, 0, 0])])
def test_ants_with_food_follow_another_pheromone(followed, levels):
    """An ant picks up food, turns around, and sees the trail, or a field that no ant lays."""
    here = GRID.index((5, 5, 0))
    forward, *rooms = (tuple(c) for c in GRID.cells(here + GRID.offsets[[0, 2, 3, 4]]).tolist())
    (queen,) = GRID.cells([here + 2 * GRID.offsets[0]]).tolist()
    trails = [(rooms[1], 20), (rooms[2], 60)]
    world = World((10, 10, 2), queen, [forward], trails=trails, ants=[((5, 5, 0), 0)])
    rules = Task(
        pheromone=Pheromone(evaporation="none"),
        fields={"calm": Field(deposited_when="never")},
        choice=Choice("deneubourg", k=20, exponent=2, carriers_follow=followed),
    )
    colony = Colony(world, rules, None, range(N), sharing="frozen")
    colony.begin_episode()
    colony.tick(2)
    assert colony.carrying.all()
    weights = (20.0 + np.array(levels)) ** 2
    assert_counts(colony.actions[:, 0], weights / weights.sum())


def test_slips():
    rules = Task(noise=Noise(slip=0.4))
    chosen, executed, _ = first_actions(rules, lone_ant(), training=PLAIN, q_values=GREEDY_VALUES)
    assert (chosen == 1).all()
    assert_counts(executed, [0.08, 0.68, 0.08, 0.08, 0.08])


def test_misread_cells():
    """An ant sees a rock ahead of it as each other code equally often, and cells independently."""
    rules = Task(noise=Noise(misread=0.3))
    colony = Colony(lone_ant(), rules, PLAIN, range(N), sharing="frozen", q_values=GREEDY_VALUES)
    colony.begin_episode()
    states, paper_states = colony.states[:, 0], colony.paper_states[:, 0]
    assert (paper_states == 0).all()
    codes = np.stack([states >> 4 & 3, states >> 2 & 3, states & 3])
    for seen in codes:
        assert_counts(seen, [0.7, 0.1, 0.1, 0.1])
    assert_counts((codes > 0).sum(axis=0), [0.343, 0.441, 0.189, 0.027])


def test_worlds_that_begin_again_do_not_misread_twice():
    """A world that has begun but not ticked keeps what its ants see while others begin."""
    rules = Task(noise=Noise(misread=0.5))
    colony = Colony(worlds.paper(), rules, PLAIN, (1, 2), 9)
    colony.begin_episode()
    seen, streams = colony.states[1].copy(), colony.streams[1].copy()
    colony.reset_worlds(np.array([True, False]))
    assert (colony.states[1] == seen).all()
    assert (colony.streams[1] == streams).all()
