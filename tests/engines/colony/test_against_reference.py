"""The colony equals the plain reference: every tick, every ant, every cell, every bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_rewards import random_rewards
from random_worlds import random_world

from taichi_ants import Colony, TrainingConfig
from taichi_ants.engines.colony import arrays as names
from taichi_ants.learners.policies import random_policy
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import Life, Pheromone, Task
from taichi_ants.task.constants import EMPTY
from taichi_ants.worlds.starts import STARTS

# Each entry is a kernel of its own, so that there are few; all options occur in each.
KERNELS = [
    ("q_learning", 0, "shared", False),
    ("q_learning", 0, "shared", True),
    ("sarsa", 0, "shared", False),
    ("sarsa", 0, "shared", True),
    ("expected_sarsa", 0, "shared", False),
    ("expected_sarsa", 0, "shared", True),
    ("dyna_q", 2, "shared", False),
    ("dyna_q", 2, "shared", True),
    ("q_learning", 0, "own", False),
    ("sarsa", 0, "own", False),
    ("dyna_q", 2, "own", False),
    ("q_learning", 0, "fixed", False),
    ("q_learning", 0, "fixed", True),
]


def random_colony(seed: int, dense: bool):
    """A crowded micro-world with random options; some food always moves or grows back."""
    rng = np.random.default_rng([seed, 99])
    world = random_world(seed, int(rng.integers(2, 6)))
    free = int((world.ground() == EMPTY).sum())
    ants = int(min(free, rng.choice([1, 2, 3, 5, 8, 13, 20, 30])))
    births, lifespan = bool(rng.random() < 0.5), rng.choice([0, 0, 3, 9, 25])
    evaporations = ["exponential", "linear", "none"] if dense else ["linear", "none"]
    evaporation, deposit = str(rng.choice(evaporations)), str(rng.choice(["set", "add", "none"]))
    half_life, cap = float(rng.choice([0.7, 3.0, 40.0])), int(rng.choice([200, 600]))
    capacity = ants + int(rng.integers(0, 6)) if births else None
    pheromone = Pheromone(
        evaporation=evaporation,
        half_life=half_life if evaporation == "exponential" else None,
        diffusion=float(rng.choice([0.05, 0.5, 1.0])) if dense else 0.0,
        deposit=deposit,
        level=int(rng.choice([3, 250])),
        cap=cap if deposit == "add" else None,
    )
    life = Life(
        births=births,
        lifespan=int(lifespan) or None,
        regrowth=[None, 0, 1, 4][rng.integers(4)],
        wander=int(rng.choice([1, 2, 5, 1000])),
    )
    task = Task(
        rewards=random_rewards(seed),
        pheromone=pheromone,
        evaporation_in_training=True,
        life=life,
    )
    return world, task, {"ants": ants, "capacity": capacity, "start": str(rng.choice(STARTS))}


def random_training(seed: int, learner: str, planning_steps: int) -> tuple[TrainingConfig, str]:
    """Settings, and what a delivery is."""
    rng = np.random.default_rng([seed, 98])
    config = TrainingConfig(
        learner,
        float(rng.choice([0.01, 0.3, 1.0])),
        float(rng.choice([0.0, 0.9, 0.99])),
        float(rng.choice([0.1, 0.5, 1.0])),
        0.9,
        hyperparameters={"planning_steps": planning_steps} if planning_steps else {},
    )
    return config, str(rng.choice(["absorbing", "continuing"]))


def assert_equal(colony: Colony, plain: ReferenceColony) -> None:
    """Compare all that both hold between two ticks."""
    ours, theirs = colony.snapshot(), plain.snapshot()
    grid, arrays = ours.grid, colony.arrays
    ants = arrays["ants"]
    (slots,) = np.nonzero(ants[names.LIFE] == names.LIVING)
    assert slots.tolist() == list(theirs.ants)
    cells = grid.cells(ants[names.CELL, slots]).tolist()
    for slot, cell in zip(slots.tolist(), cells, strict=True):
        ant = theirs.ants[slot]
        mine = ants[:, slot]
        assert tuple(cell) == ant.cell
        assert (mine[names.HEADING], mine[names.CARRIES]) == (ant.heading, ant.carries)
        assert (mine[names.NUMBER], mine[names.AGE]) == (ant.number, ant.age)
        assert (mine[names.STATE], int(arrays["streams"][slot])) == (ant.state, ant.stream.state)
        assert ant.action < 0 or arrays["rewards"][mine[names.EVENT]] == ant.reward
    existing = np.array(list(theirs.ground), dtype=np.int64).reshape(-1, 3)
    places = grid.index(existing)
    assert ours.ground[places].tolist() == list(theirs.ground.values())
    levels = np.array([theirs.levels[tuple(cell)] for cell in existing.tolist()])
    assert np.array_equal(ours.trail[places], levels.astype(ours.trail.dtype))
    assert np.array_equal(colony.q_values[0], theirs.q_values)
    assert int(arrays["queen_streams"][0]) == theirs.queen_rng_state
    assert_equal_records(colony, theirs)


def assert_equal_records(colony: Colony, theirs) -> None:
    """Compare the counters of the episode, the store, the places of food, the size of the model."""
    outcome, record, row = colony.outcome(), theirs.record, colony.arrays["worlds"][:, 0]
    assert outcome.returns[0, 0] == record.episode_return
    for name in ("ticks", "deliveries", "first_delivery", "moves", "blocked", "births", "deaths"):
        assert getattr(outcome, name)[0, 0] == getattr(record, name), name
    assert outcome.regrown[0, 0] == record.regrown
    assert row[names.STORE] == theirs.store
    homes = colony.arrays["homes"][:, : row[names.HOMES]]
    assert homes[names.HOME_TAKEN].tolist() == [
        -1 if since is None else since for _, since in theirs.homes
    ]
    cells = colony.snapshot().grid.cells(homes[names.HOME_CELL]).tolist()
    assert cells == [list(cell) for cell, _ in theirs.homes]
    if colony.sharing == "shared":
        assert row[names.MODEL_SIZE] == len(theirs.models[0])


@pytest.mark.parametrize(("learner", "planning_steps", "sharing", "dense"), KERNELS)
def test_every_tick_in_crowded_micro_worlds(learner, planning_steps, sharing, dense):
    """More than 1000 micro-worlds in all, two episodes each: something goes on between them."""
    happened = np.zeros(5, dtype=int)
    for seed in range(86):
        world, task, population = random_colony(seed, dense)
        training, delivery = random_training(seed, learner, planning_steps)
        task = replace(task, delivery=delivery)
        table = random_policy() if sharing == "fixed" else None
        rules = {**population, "sharing": sharing}
        colony = Colony(world, task, training, seed - 3, **rules, q_values=table)
        plain = ReferenceColony(world, task, training, seed - 3, **rules)
        for ticks in (12, 9):
            colony.begin_episode()
            plain.begin_episode()
            assert_equal(colony, plain)
            for _ in range(ticks):
                colony.tick()
                plain.tick()
                assert_equal(colony, plain)
            colony.end_episode()
            plain.end_episode()
            record = plain.records[-1]
            happened += [
                record.births > 0,
                record.deaths > 0,
                record.regrown > 0,
                record.deliveries > 0,
                record.blocked > 0,
            ]
    assert (happened >= [1, 20, 10, 3, 50]).all(), happened
