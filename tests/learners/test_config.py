"""The settings of a learner: their bounds, and what they are stored as."""

import json
import pickle
from dataclasses import asdict, replace
from fractions import Fraction

import numpy as np
import pytest
from refusals import refused

from taichi_ants import TrainingConfig, learners

GOOD = {
    **{"learner": "dyna_q", "learning_rate": 0.1, "discount": 0.9, "epsilon": 0.3},
    **{"epsilon_decay": 0.99, "min_epsilon": 0.05, "planning_steps": 3},
}

FALLING = {"learning_rate_decay": 0.25, "min_learning_rate": 0.02}


def test_rates_fall_by_their_factors_down_to_their_least():
    config = TrainingConfig("sarsa", 0.4, 0.9, 0.8, 0.5, 0.3, **FALLING)
    rates, epsilons = [config.learning_rate], [config.epsilon]
    for _ in range(3):
        rates.append(config.next_learning_rate(rates[-1]))
        epsilons.append(config.next_epsilon(epsilons[-1]))
    assert rates == [0.4, 0.1, 0.025, 0.02]
    assert epsilons == [0.8, 0.4, 0.3, 0.3]


@pytest.mark.parametrize(
    ("learner", "name", "value", "says"),
    [
        ("q_learning", "planning_steps", 3, "is not a setting of q_learning"),
        ("dyna_q", "planning_steps", 2.0, "`training.planning_steps` is 2.0; it must be a whole"),
        ("dyna_q", "planning_steps", "3", "`training.planning_steps` is '3'; it must be a whole"),
        ("dyna_q", "planning_steps", True, "`training.planning_steps` is True; it must be a whole"),
        ("dyna_q", "trace_decay", 0.5, "is not a setting of dyna_q; choose one of"),
        ("q_learning", "learning_rat", 0.5, "choose one of learning_rate, "),
    ],
)
def test_hyperparameters_are_those_of_the_learner(learner, name, value, says):
    refused(says, TrainingConfig, learner, 0.1, 0.9, 0.3, 0.99, hyperparameters={name: value})
    refused(says, TrainingConfig, learner, **{name: value})  # not what else is missing


def test_hyperparameters_of_a_learner_that_is_registered_later_are_checked_in_use(monkeypatch):
    monkeypatch.setattr(learners.registry.LEARNERS, "yours", {})
    config = TrainingConfig("later", 0.1, 0.9, 0.3, 0.99, n_steps=3)
    complete = learners.registry.with_hyperparameters
    refused("there is no learner 'later'; choose one of q_learning, ", complete, config)
    learners.register(replace(learners.get("sarsa"), name="later"))
    refused("`training.n_steps` is not a setting of later", complete, config)


def test_numbers_of_any_kind_are_stored_as_plain_ones():
    plain = TrainingConfig(**{**GOOD, "discount": 0.5, "epsilon": 1})
    numbers = {"discount": Fraction(1, 2), "epsilon": np.float32(1), "planning_steps": np.int8(3)}
    other = TrainingConfig(**{**GOOD, **numbers})
    assert plain == other
    assert hash(plain) == hash(other)
    assert asdict(plain) == asdict(other)
    assert [type(value) for value in asdict(other).values()] == [str, *[float] * 8, tuple]
    assert type(dict(other.hyperparameters)["planning_steps"]) is int
    assert TrainingConfig(**json.loads(json.dumps(other.as_dict()))) == plain
    assert pickle.loads(pickle.dumps(other)) == plain
