"""The engine of independent runs equals the plain reference: every step, every bit."""

from itertools import cycle

import numpy as np
import plain_runs
import pytest
from plain_runs import train_with_tables
from random_choices import NO_NOISE, NOISE, random_choice, random_noise
from random_colonies import random_task
from random_rewards import random_rewards
from random_worlds import random_world

from taichi_ants import TrainingConfig, evaluate, learners, rollout, runtime, trace_training, train
from taichi_ants.engines.runs import engine, kernels
from taichi_ants.settings import declared
from taichi_ants.task import Task, observations
from taichi_ants.task.constants import Event
from taichi_ants.worlds import paper

# Each entry is a kernel of its own, so that there are few: learner, observation, deposit.
KERNELS = [
    *zip(
        learners.registry.BUILT_IN,
        cycle(("trail_levels", "five_cells", "ants_seen", "paper", "six_cells", "ants", "queues")),
        cycle(("set", "add", "none", "fading")),
        strict=False,
    ),
    *((name, "paper", "set") for name in ("q_learning", "sarsa", "expected_sarsa")),
]
# Those of the first deposits, and the paper's, are compared at once; the others later.
LATER = KERNELS[4:-3]
MARKED = [pytest.param(*one, marks=[pytest.mark.slow] * (one in LATER)) for one in KERNELS]
# The same with a rule of choice and noise.
NOISY = [
    ("sarsa", "ants", "set", "softmax", NOISE),
    pytest.param("q_learning", "paper", "fading", "softmax", NO_NOISE, marks=pytest.mark.long),
    pytest.param("expected_sarsa", "paper", "add", "greedy", NOISE, marks=pytest.mark.slow),
    pytest.param("sarsa_lambda", "trail_levels", "set", "greedy", "slip", marks=pytest.mark.long),
    pytest.param(
        *("dyna_q", "six_cells", "set", "softmax", "misread"), marks=pytest.mark.optimised
    ),
]


def random_config(seed: int, learner: str) -> TrainingConfig:
    """A configuration with values far from each other and from round ones."""
    rng = np.random.default_rng([seed, 1])
    hyperparameters = {}
    for one in declared(learners.get(learner).hyperparameters):
        if one.kind is int:
            hyperparameters[one.name] = int(rng.choice([1, 2, 3, 5]))
        else:
            hyperparameters[one.name] = float(rng.choice([0.0, 0.1, 0.9, 1.0]))
    return TrainingConfig(
        learner=learner,
        learning_rate=float(rng.choice([0.001, 0.01, 0.37, 1.0])),
        discount=float(rng.choice([0.0, 0.9, 0.99, 1.0])),
        epsilon=float(rng.choice([0.0, 0.05, 0.3, 1.0])),
        epsilon_decay=float(rng.choice([0.3, 0.99, 1.0])),
        min_epsilon=float(rng.choice([0.0, 0.01, 0.2])),
        hyperparameters=hyperparameters,
        learning_rate_decay=float(rng.choice([0.5, 0.9, 1.0])),
        min_learning_rate=float(rng.choice([0.0, 0.1])),
        initial_q=float(rng.choice([0.0, 1.7, -3.0])),
    )


def drawn_task(
    seed: int,
    observation: str = "paper",
    deposit: str = "set",
    choice: str = "greedy",
    noise: str = NO_NOISE,
) -> Task:
    rules = {"choice": random_choice(seed, choice), "noise": random_noise(seed, noise)}
    rng = np.random.default_rng([seed, 2])
    return random_task(rng, deposit, random_rewards(seed), observation=observation, **rules)


def assert_equal_steps(world, config, seed, episodes, max_steps, task):
    """Compare each step of a training run: what happened, the TD error, the whole Q-table."""
    ours = trace_training(world, config, seed, episodes, max_steps, task)
    plain, tables = train_with_tables(world, config, seed, episodes, max_steps, task)
    assert len(ours) == len(plain.trace) > 0
    for k, step in enumerate(plain.trace):
        assert (ours.episodes[k], ours.steps[k]) == (step.episode, step.step)
        assert_equal_step(ours, k, step)
        assert ours.terminated[k] == step.terminated
        assert ours.td_errors[k] == step.td_error
        assert np.array_equal(ours.tables[k], tables[k])
    return plain


def assert_equal_step(ours, k, step):
    assert (tuple(ours.cells[k]), ours.headings[k]) == (step.cell, step.heading)
    assert (ours.states[k], ours.actions[k]) == (step.state, step.action)
    assert ours.executed[k] == step.executed
    assert (ours.rewards[k], ours.next_states[k]) == (step.reward, step.next_state)
    assert ours.delivered[k] == (step.event is Event.DELIVERED)


@pytest.mark.parametrize(("learner", "observation", "deposit"), MARKED)
def test_every_step_in_random_worlds(learner, observation, deposit):
    """Several foods, rocks, trails of all strengths; deliveries and choices among foods occur."""
    delivered = 0
    n_states = observations.get(observation).n_states
    for seed in range(8 if n_states < 1000 else 6):
        task = drawn_task(seed, observation, deposit)
        config, world = random_config(seed, learner), random_world(seed)
        plain = assert_equal_steps(world, config, seed - 7, 4, 25, task)
        delivered += sum(plain.deliveries)
    assert delivered > 3


@pytest.mark.parametrize(("learner", "observation", "deposit", "choice", "noise"), NOISY)
def test_every_step_with_rules_of_choice_and_noise(learner, observation, deposit, choice, noise):
    """Actions that slip, and cells that are misread, in training and in rollouts."""
    slipped = misread = 0
    for seed in range(10 if observations.get(observation).n_states < 1000 else 6):
        task = drawn_task(seed, observation, deposit, choice, noise)
        config, world = random_config(seed, learner), random_world(seed)
        plain = assert_equal_steps(world, config, seed - 7, 4, 25, task)
        slipped += sum(step.action != step.executed for step in plain.trace)
        table = np.random.default_rng(seed).integers(0, 3, (task.n_states, 5)).astype(np.float32)
        ours = rollout(world, table, seed, 1, 40, task, 0.1)
        rolled = plain_runs.rollout(world, table, seed, 1, 40, task, 0.1)
        for k, step in enumerate(rolled.trace):
            assert_equal_step(ours, k, step)
        misread += int((ours.paper_states != ours.states).sum())
        outcome = evaluate(world, table, 2, seed, 40, task, epsilon=0.1)
        assert outcome.returns[1] == rolled.returns[0]
    assert (slipped > 10) == ("slip" in noise)
    if observation == "paper":
        assert (misread > 10) == ("misread" in noise)


def test_whole_trainings_of_a_mixed_sweep():
    """The kernel that trains equals the reference too, and runs do not disturb each other."""
    names = list(learners.registry.BUILT_IN)
    for number, world in enumerate((paper(), random_world(13, 8))):
        task = drawn_task(number)
        configs = [random_config(number * len(names) + k, name) for k, name in enumerate(names)]
        # Only this one learns from an episode that is cut off.
        configs.append(TrainingConfig("n_step_sarsa", 0.37, 0.9, 0.3, 0.99, n_steps=3))
        result = train(world, configs, seeds=(-1, 2**63 + 5), episodes=4, max_steps=60, task=task)
        for c, config in enumerate(configs):
            for s, seed in enumerate(result.seeds):
                plain = plain_runs.train(world, config, seed, 4, 60, task)
                assert result.returns[c, s].tolist() == plain.returns
                assert result.steps[c, s].tolist() == plain.steps
                assert result.deliveries[c, s].tolist() == plain.deliveries
                assert np.array_equal(result.q_values[c, s], plain.q_values)
                assert result.state.random_states[c, s] == plain.rng_state
                assert result.state.epsilon[c, s] == plain.epsilon
                if learners.get(config.learner).plans:
                    assert result.state.integers[c, s, 0] == len(plain.model)


@pytest.mark.parametrize(
    ("learner", "observation", "deposit", "choice", "noise"),
    [
        ("q_learning", "paper", "set", "greedy", NO_NOISE),
        ("sarsa", "paper", "fading", "greedy", NOISE),
    ],
)
def test_many_runs_equal_single_ones(learner, observation, deposit, choice, noise, monkeypatch):
    """A task takes many runs together, and more of them than it has lanes for."""
    monkeypatch.setattr(engine, "GATHERS", True)
    monkeypatch.setattr(engine, "_FEW_STEPS", 0)  # else the single ones could use the same kernel
    seeds = range(-3, 20 * runtime.start().threads)
    drawn = 0
    for number in range(4):
        world, task = random_world(number), drawn_task(number, observation, deposit, choice, noise)
        config = random_config(number, learner)
        together = train(world, config, seeds, 5, 40, task)
        tables = np.random.default_rng(number).integers(0, 4, together.q_values[0].shape)
        epsilon = (0.0, 0.1)[number % 2]
        rolled = evaluate(world, tables, 4, seeds, 40, task, epsilon)
        drawn += (rolled.returns != rolled.returns[:, :1]).any(axis=1).mean()
        for s in (0, 5, len(seeds) // 2, len(seeds) - 1):
            alone = train(world, config, seeds[s], 5, 40, task)
            for name in ("returns", "steps", "deliveries"):
                assert np.array_equal(getattr(together, name)[:, s], getattr(alone, name)[:, 0])
            for name, array in vars(alone.state).items():
                assert np.array_equal(getattr(together.state, name)[0, s], array[0, 0]), name
            once = evaluate(world, tables[s], 4, seeds[s], 40, task, epsilon)
            for name in ("returns", "steps", "deliveries"):
                assert np.array_equal(getattr(rolled, name)[s], getattr(once, name))
    assert 0 < drawn < 4  # with ties, rollouts of a table differ


@pytest.mark.parametrize(
    ("learner", "gathers", "together"),
    [("q_learning", True, True), ("q_learning", False, False), ("dyna_q", True, False)],
)
def test_runs_share_a_task_only_where_that_is_faster(learner, gathers, together, monkeypatch):
    lanes, make = set(), kernels.run_kernel
    monkeypatch.setattr(engine, "GATHERS", gathers)
    monkeypatch.setattr(kernels, "run_kernel", lambda *form: lanes.add(form[3]) or make(*form))
    train(paper(), random_config(0, learner), range(20 * runtime.start().threads), 1, 2)
    assert lanes == {kernels.LANES if together else 1}


@pytest.mark.parametrize(("observation", "deposit"), [("paper", "set"), ("five_cells", "add")])
def test_rollouts(observation, deposit):
    """Every step of rollouts, with ties, and the outcomes of `evaluate`."""
    rng = np.random.default_rng(0)
    for seed in range(10):
        world = random_world(seed + 1000) if seed else paper()
        task = drawn_task(seed, observation, deposit)
        table = rng.integers(0, 3, (task.n_states, 5)).astype(np.float32)
        outcome = evaluate(world, table, 4, seed, 40, task, epsilon=0.1)
        for number in range(4):
            plain = plain_runs.rollout(world, table, seed, number, 40, task, 0.1)
            ours = rollout(world, table, seed, number, 40, task, 0.1)
            assert outcome.returns[number] == plain.returns[0] == ours.rewards.sum()
            assert outcome.steps[number] == plain.steps[0] == len(ours)
            assert outcome.deliveries[number] == plain.deliveries[0] == ours.delivered.sum()
            for k, step in enumerate(plain.trace):
                assert_equal_step(ours, k, step)
                assert np.array_equal(ours.q_values[k], table[step.state])


def test_paper_states_are_the_papers_states_whatever_the_observation():
    table = np.zeros((observations.get("six_cells").n_states, 5), np.float32)
    for seed in range(20):
        world = random_world(seed + 1000)
        other = rollout(world, table, seed, task=Task("six_cells"), max_steps=60)
        papers = rollout(world, table[:128], seed, max_steps=60)
        assert np.array_equal(other.paper_states, papers.states)
        assert np.array_equal(other.next_paper_states, papers.next_states)
        assert not np.array_equal(other.states, papers.states)
