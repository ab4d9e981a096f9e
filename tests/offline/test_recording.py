"""What is recorded is what the reference does, with the probability of each action."""

import numpy as np
import pytest
from plain_runs import run_episode, train_with_tables
from random_worlds import random_world

from taichi_ants import (
    Colony,
    Life,
    Task,
    TrainingConfig,
    record,
    record_colony,
    rollout,
    worlds,
)
from taichi_ants.learners.policies import trail_follower
from taichi_ants.reference import ReferenceColony

FIELDS = ("step", "state", "action", "reward", "next_state", "terminated")


def chance(values, action, epsilon) -> float:
    """The probability of an action of an epsilon-greedy ant, plainly."""
    best = [a for a in range(5) if values[a] == max(values)]
    explores = int(epsilon * 2**32) / 2**32
    return explores / 5 + ((1 - explores) / len(best) if action in best else 0.0)


def rows(data, names=FIELDS) -> list[tuple]:
    return list(zip(*(getattr(data, name).tolist() for name in names), strict=True))


@pytest.mark.parametrize("learner", ["q_learning", "sarsa"])
def test_a_learner_while_it_learns(learner):
    """SARSA draws its next action by the table as it is before the update."""
    config, seeds = TrainingConfig(learner, 0.5, 0.9, 0.4, 0.7), (3, -1)
    for number in range(4):
        world, task = (
            random_world(number),
            Task(delivery="truncates" if number % 2 else "terminates"),
        )
        data = record(world, config, 5, seeds, 30, task)
        for run, seed in enumerate(seeds):
            plain, tables = train_with_tables(world, config, seed, 5, 30, task)
            one = data.of_run(run)
            assert rows(one) == [tuple(getattr(step, n) for n in FIELDS) for step in plain.trace]
            assert one.truncated.tolist() == [step.truncated for step in plain.trace]
            assert one.episode.tolist() == [step.episode for step in plain.trace]
            before = [np.zeros_like(tables[0]), *tables]
            for k, step in enumerate(plain.trace):
                drawn_early = learner == "sarsa" and step.step > 0
                values = before[k - drawn_early][step.state]
                epsilon = 0.4
                for _ in range(step.episode):
                    epsilon = config.next_epsilon(epsilon)
                assert one.behaviour_probability[k] == chance(values, step.action, epsilon)


def test_tables_do_what_they_do_in_rollouts():
    """Ties share what is not explored."""
    rng = np.random.default_rng(0)
    tables = rng.integers(0, 2, (2, 128, 5)).astype(np.float32)
    world, seeds = worlds.paper(), (4, 9)
    data = record(world, tables, 3, seeds, 50, epsilon=0.25)
    assert set(data.agent) == {0}
    for run, seed in enumerate(seeds):
        traces = [rollout(world, tables[run], seed, k, 50, epsilon=0.25) for k in range(3)]
        states = np.concatenate([trace.states for trace in traces])
        actions = np.concatenate([trace.actions for trace in traces])
        one = data.of_run(run)
        assert np.array_equal(one.state, states)
        assert np.array_equal(one.action, actions)
        plain = [chance(tables[run, s], a, 0.25) for s, a in zip(states, actions, strict=True)]
        assert one.behaviour_probability.tolist() == plain
    assert np.array_equal(record(world, None, 1, 4, 20).behaviour_probability, np.full(20, 0.2))


COLONIES = [
    ("sarsa", "shared", "terminates", Life(births=True, lifespan=9, regrowth=0)),
    ("q_learning", "shared", "truncates", Life(births=True, lifespan=9, regrowth=0)),
]


@pytest.mark.parametrize(("learner", "sharing", "delivery", "life"), COLONIES)
def test_ants_of_a_colony_that_appear_and_die(learner, sharing, delivery, life):
    config = TrainingConfig(learner, 0.3, 0.9, 0.3, 0.5)
    task, world = Task(delivery=delivery, life=life), worlds.open_world(5, (6, 6, 6))
    follower = trail_follower()
    colony = Colony(world, task, config, 7, 6, sharing=sharing, q_values=follower)
    plain = ReferenceColony(world, task, config, 7, 6, sharing=sharing, q_values=follower)
    data = record_colony(colony, 2, 40)
    lives: dict[tuple[int, int], list] = {}
    for episode in range(2):
        tables, epsilon = plain.q_values, plain.epsilon
        before = tables
        for steps in run_episode(plain, 40):
            for step in steps:
                ant = lives.setdefault((episode, step.number), [])
                early = learner == "sarsa" and bool(ant)
                values = (before if early else tables)[step.state]
                ant.append((step, chance(values, step.action, epsilon)))
            before, tables = tables, plain.q_values
    assert np.array_equal(colony.q_values[0], plain.q_values)
    spans = []  # an ant's life, cut after each terminal step, with where it belongs
    for (episode, number), life in lives.items():
        ends = [k + 1 for k, (step, _) in enumerate(life) if step.terminated or k + 1 == len(life)]
        for first, end in zip([0, *ends], ends, strict=False):
            spans.append((episode, life[first][0].step, number, life[first:end]))
    spans.sort(key=lambda span: span[:3])
    steps = [step for *_, span in spans for step, _ in span]
    assert rows(data) == [tuple(getattr(step, name) for name in FIELDS) for step in steps]
    assert data.agent.tolist() == [step.number for step in steps]
    assert data.behaviour_probability.tolist() == [c for *_, span in spans for _, c in span]
    assert np.diff(data.begins).tolist() == [len(span) for *_, span in spans]
    assert data.step[data.begins[:-1]].max() > 0  # some appear while others live
    assert data.terminated.any() == (delivery == "terminates")
    assert len(lives) > 20
