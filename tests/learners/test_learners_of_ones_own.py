"""What may stand in a TD error that a user writes, and how the rest is refused."""

import runpy
import subprocess
import sys
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import pytest
import taichi as ti
from command_lines import ROOT, environment
from refusals import refused

from taichi_ants import AntsError, Colony, TrainingConfig, continue_training, trace_training, train
from taichi_ants.learners import (
    Hyperparameters,
    Learner,
    Memory,
    Setting,
    register,
    registry,
    td_learner,
)
from taichi_ants.worlds import paper


@pytest.fixture(autouse=True)
def _no_learner_stays(monkeypatch):
    monkeypatch.setattr(registry.LEARNERS, "yours", dict(registry.LEARNERS.yours))


def config(name="mine"):
    return TrainingConfig(name, 0.1, 0.9, 0.3, 0.97)


def in_runs(name="mine"):
    return train(paper(), config(name), range(3), 20, 200).q_values


def in_a_colony(name="mine", sharing="shared"):
    colony = Colony(paper(), None, config(name), ants=5, sharing=sharing)
    colony.run(2, 100)
    return colony.q_values


# What costs a kernel each is tried in one engine, and among the slow tests in the other.
ONE_ENGINE = (in_runs, pytest.param(in_a_colony, marks=pytest.mark.slow))


def natural_q_learning(value, reward, discount, next_values, next_action, epsilon):
    return reward + discount * next_values.max() - value


def natural_sarsa(value, reward, discount, next_values, next_action, epsilon):
    return reward + discount * next_values[next_action] - value


def natural_expected_sarsa(value, reward, discount, next_values, next_action, epsilon):
    mean = next_values.sum() * ti.f32(1 / len(next_values))
    best = next_values.max()
    return reward + discount * (best + epsilon * (mean - best)) - value


NATURAL = {
    "q_learning": natural_q_learning,
    "sarsa": natural_sarsa,
    "expected_sarsa": natural_expected_sarsa,
}


@pytest.mark.parametrize("engine", ONE_ENGINE)
@pytest.mark.parametrize(
    ("like", "td_error"),
    [
        pytest.param(*one, marks=[pytest.mark.slow] * (one[0] != "expected_sarsa"))
        for one in NATURAL.items()
    ],
)
def test_what_is_natural_works(like, td_error, engine):
    """To the bit what the package's own learners do, which equal the reference."""
    model = registry.get(like)
    register(td_learner("mine", td_error, model.draws_next_action))
    values = engine()
    assert np.abs(values).max() > 0.5
    assert np.array_equal(values, engine(like))


def test_a_learner_of_ones_own_is_replaced():
    """As in a cell of a notebook that is run again; the next training uses the new one."""
    tables = []
    for td_error in (natural_q_learning, of_reward):
        register(td_learner("mine", td_error))
        tables.append(in_runs())
    assert not np.array_equal(*tables)
    assert registry.names().count("mine") == 1


def of_reward(value, reward, discount, next_values, next_action, epsilon):
    return reward - value


def of_a_vector(value, reward, discount, next_values, next_action, epsilon):
    return reward + discount * next_values - value


def of_nothing(value, reward, discount, next_values, next_action, epsilon):
    reward + value


def of_an_action_too_far(value, reward, discount, next_values, next_action, epsilon):
    return next_values[next_action + 1]


def of_a_large_next_value(value, reward, discount, next_values, next_action, epsilon):
    return reward + next_values[max(0, int(next_values.max() * 0.001))] - value


@ti.func
def of_itself(value, reward, discount, next_values, next_action, epsilon):
    return of_itself(value, reward, discount, next_values, 0, epsilon)


def of_a_lost_name(value, reward, discount, next_values, next_action, epsilon):
    return lost  # noqa: F821


@pytest.mark.parametrize(
    ("td_error", "says"),
    [
        (of_a_vector, "it returns a vector"),
        (of_nothing, "NoneType"),
        (of_itself, "recursion"),
        (of_a_lost_name, '"lost" is not defined'),
    ],
)
def test_what_taichi_cannot_compile_is_named_and_taichi_goes_on(td_error, says, capfd):
    register(td_learner("mine", td_error, draws_next_action=True))
    message = refused(says, in_runs)
    assert message.startswith("Taichi cannot compile a kernel with your code: ")
    assert message.endswith("; try it with `taichi-ants check FILE`.")
    assert capfd.readouterr() == ("", "")
    assert in_runs("q_learning").any()


@dataclass(frozen=True)
class Momentum(Hyperparameters):
    momentum: Annotated[float, Setting("share of the last error", least=0, most=1)] = 0.5


def begin(memory, at):
    memory.floats[at.floats] = 0.0


def learn(memory, at, step, rates, random_state):
    """SARSA by a TD error that is mixed with the one before, in this episode."""
    pair = step.state * 8 + step.action
    discount = rates.discount if step.terminated == 0 else ti.f32(0.0)
    next_value = memory.q[at.table + step.next_state * 8 + ti.max(step.next_action, 0)]
    error = step.reward + discount * next_value - memory.q[at.table + pair]
    error += rates.momentum * memory.floats[at.floats]
    memory.floats[at.floats] = error
    memory.integers[at.integers] += 1
    memory.q[at.table + pair] += rates.learning_rate * error
    return error, random_state


def with_memory(**changes):
    given = {
        "draws_next_action": True,
        "hyperparameters": Momentum,
        "memory": lambda settings, n_states: Memory(floats=1, integers=1),
    }
    return Learner("mine", learn, begin, **{**given, **changes})


def with_momentum(momentum):
    return TrainingConfig("mine", 0.1, 0.9, 0.3, 0.97, momentum=momentum)


def test_a_memory_lives_through_a_run_and_belongs_to_it():
    register(with_memory())
    result = train(paper(), [with_momentum(0.5), with_momentum(0.0)], range(3), 8, 200)
    assert result.state.floats[0, :, 0].all()
    assert np.array_equal(result.state.integers[:, :, 0], result.steps.sum(axis=2))
    for c, momentum in enumerate((0.5, 0.0)):
        for s in range(3):
            parts = train(paper(), with_momentum(momentum), s, 5, 200)
            alone = continue_training(parts, 3)
            assert np.array_equal(alone.q_values[0, 0], result.q_values[c, s])
    sarsa = train(paper(), config("sarsa"), range(3), 8, 200)
    assert np.array_equal(result.q_values[1], sarsa.q_values[0])
    assert not np.array_equal(result.q_values[0], sarsa.q_values[0])


def that_forgets_at(memory, at, step, rates, random_state):
    memory.q[step.state * 8 + step.action] += rates.learning_rate
    return ti.f32(1.0), random_state


def beyond_its_memory(memory, at, step, rates, random_state):
    memory.integers[at.integers + 1] += 1
    return ti.f32(1.0), random_state


def of_one_value(memory, at, step, rates, random_state):
    return ti.f32(1.0)


PLUGIN = """
import sys
from dataclasses import replace
sys.path[:0] = FOLDERS
import test_learners_of_ones_own as mine
from taichi_ants.learners import register, td_learner
register(td_learner("fine", mine.natural_sarsa, draws_next_action=True))
register(td_learner("undrawn", mine.natural_sarsa))
register(td_learner("too_far", mine.of_an_action_too_far, draws_next_action=True))
register(td_learner("large", mine.of_a_large_next_value))
for learn in (mine.that_forgets_at, mine.beyond_its_memory, mine.of_one_value):
    register(replace(mine.with_memory(), name=learn.__name__, learn=learn))
"""


@pytest.mark.slow
def test_the_command_tries_all_learners_of_a_file(kernels, tmp_path):
    folders = [str(ROOT / "tests" / name) for name in ("learners", "support")]
    (tmp_path / "plugin.py").write_text(PLUGIN.replace("FOLDERS", repr(folders)))
    command = [sys.executable, "-m", "taichi_ants", "check", "plugin.py"]
    how = {"cwd": tmp_path, "env": environment(kernels), "capture_output": True, "text": True}
    done = subprocess.run(command, **how)
    assert (done.returncode, done.stderr) == (1, "")
    expected = {
        "fine": "no fault",
        "undrawn": "its TD error uses next_action, but no next action is drawn; give draws_next_",
        "too_far": "it uses index 5 of a vector of length 5",
        "large": "of a vector of length 5",
        "that_forgets_at": "it writes outside the memory of its run",
        "beyond_its_memory": "it uses an index outside an array",
        "of_one_value": "Cannot unpack",
    }
    lines = done.stdout.splitlines()
    for line, (name, says) in zip(lines, expected.items(), strict=True):
        assert line.startswith(f"{name}: 2000 steps: ")
        assert says in line


@dataclass(frozen=True)
class Clashing(Hyperparameters):
    discount: Annotated[float, Setting(least=0, most=1)] = 0.5


@dataclass(frozen=True)
class OfText(Hyperparameters):
    kind: str = "a"


@dataclass(frozen=True)
class OutOfRange(Hyperparameters):
    depth: Annotated[int, Setting(least=1, most=2)] = 3


FAILS = "learner 'mine' cannot be used: "


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"learn": 5}, "learn of 'mine' is 5; it must be a function."),
        ({"hyperparameters": Clashing}, "'discount' is a setting of all learners"),
        ({"hyperparameters": OfText}, f"{FAILS}the field kind has the type "),
        ({"hyperparameters": OutOfRange}, f"{FAILS}`training.depth` is 3; it must be"),
        ({"memory": lambda settings, n: None}, f"{FAILS}the result of memory is None; it must be"),
        ({"cost": lambda settings: 1 / 0}, f"{FAILS}division by zero"),
    ],
)
def test_learners_that_are_refused_when_they_are_registered(changes, says):
    refused(says, lambda: register(replace(with_memory(), **changes)))
    assert "mine" not in registry.names()
    with pytest.raises(AntsError, match=r"^learner is .*; it must be a Learner\.$"):
        register(natural_sarsa)


def test_the_examples_memory_makes_the_difference(tmp_path):
    """That of docs/how-to/models.md."""
    blocks = (ROOT / "docs/how-to/models.md").read_text("utf-8").split("```python\n")
    (code,) = [block.partition("```")[0] for block in blocks if '"eligible"' in block]
    path = tmp_path / "eligible.py"
    path.write_text(code)
    runpy.run_path(str(path))
    configs = [
        TrainingConfig("eligible", 0.1, 0.9, 0.3, 0.97, trace_decay=decay) for decay in (0, 0.8)
    ]
    result = train(paper(), configs, range(3), 20, 200)
    plain = train(paper(), config("q_learning"), range(3), 20, 200)
    assert np.array_equal(result.q_values[0], plain.q_values[0])
    assert not np.array_equal(result.q_values[1], plain.q_values[0])


def of_a_logarithm(value, reward, discount, next_values, next_action, epsilon):
    return reward - ti.log(value - 0.5)


def test_values_that_are_not_finite_are_named():
    register(td_learner("mine", of_a_logarithm))
    named = (
        r"^learner 'mine' computed action values that are not finite, with .*rate=0\.1.* seed 0; "
    )
    with pytest.raises(AntsError, match=named):
        in_runs()
    with pytest.raises(AntsError, match=named):
        in_a_colony()
    actions = trace_training(paper(), config(), 0, 3).actions  # a trace shows what happens
    assert (actions.min(), actions.max()) == (0, 4)
