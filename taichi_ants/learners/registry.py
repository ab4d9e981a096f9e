"""The one place where learners are registered.

To add one, write a file beside this one and add its name to `BUILT_IN`; or call `register` from a
file of your own.
"""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from importlib import import_module

from taichi_ants.errors import AntsError, check_new_name, expect, shown, unusable
from taichi_ants.learners.config import Hyperparameters, TrainingConfig
from taichi_ants.learners.learner import Learner, Memory, check_arguments, check_td_error
from taichi_ants.settings import declared, not_a_setting

# The package's own, and what readers know them as: NAME in the file `name.py`, imported when it is
# asked for, since that starts to import Taichi.
BUILT_IN = {
    "q_learning": "Q-learning",
    "sarsa": "SARSA",
    "expected_sarsa": "Expected SARSA",
    "dyna_q": "Dyna-Q",
    "double_q": "Double Q-learning",
    "sarsa_lambda": "SARSA(lambda)",
    "n_step_sarsa": "n-step SARSA",
    "prioritized_sweeping": "Prioritized sweeping",
}
_LEARNERS: dict[str, Learner] = {}


def register(learner: Learner) -> Learner:
    """Make a learner known by its name; it replaces your own learner of the same name.

    Results, colonies and kernels that exist keep theirs. AntsError if the name is that of a learner
    of the package or not an identifier, or a field is not as `Learner` says. The functions are
    tried when the learner is first used.
    """
    expect("what is registered", learner, Learner)
    name = learner.name
    check_new_name("learner", name, BUILT_IN)
    parts = ["memory", "at", "step", "rates", "random_state"]
    check_arguments(f"the function learn of {name!r}", learner.learn, parts)
    if learner.begin is not None:
        check_arguments(f"the function begin of {name!r}", learner.begin, parts[:2])
    if learner.td_error is not None:
        drawn = learner.draws_next_action and not learner.plans
        check_td_error(name, learner.td_error, drawn)
    _try_sizes(learner)
    taken = {one.name for one in declared(TrainingConfig)}
    for clash in taken & {one.name for one in declared(learner.hyperparameters)}:
        raise AntsError(
            f"{clash!r} is a setting of all learners; call this hyperparameter of {name!r} "
            "something else."
        )
    _LEARNERS[name] = learner
    return learner


def _try_sizes(learner: Learner) -> None:
    """Compute, with the usual hyperparameters, what engines need before the first step."""
    part = "hyperparameters"
    try:
        settings = learner.hyperparameters()
        expect(part, settings, Hyperparameters)
        part = "memory"
        expect("what it gives", learner.memory(settings, 128), Memory)
        part = "cost"
        if not 0 < learner.cost(settings) < math.inf:
            raise ValueError(f"it gives {learner.cost(settings)}, but it must be above 0")
    except Exception as error:
        raise unusable(learner, f"{part} fails ({error})") from error


def get(name: str) -> Learner:
    """The learner of that name; AntsError, which lists those that exist, if there is none."""
    expect("the learner", name, str)
    if name in BUILT_IN:
        return getattr(import_module(f"taichi_ants.learners.{name}"), name.upper())
    if name not in _LEARNERS:
        raise AntsError(
            f"there is no learner {shown(name)}; choose one of {', '.join(names())}, or add a "
            "--plugin."
        )
    return _LEARNERS[name]


def label(name: str) -> str:
    """The learner's name for readers, such as "Dyna-Q"; one of a plugin by its own name."""
    expect("name", name, str)
    return BUILT_IN.get(name, name)


def settle(config: TrainingConfig) -> TrainingConfig:
    """The configuration with all hyperparameters of its learner.

    AntsError if there is no such learner or hyperparameter, or a value is outside its range.
    """
    expect("the configuration", config, TrainingConfig)
    kind = get(config.learner).hyperparameters
    own_names = [one.name for one in declared(kind)]
    for name, _ in config.hyperparameters:
        if name not in own_names:
            known = [*own_names, *(one.name for one in declared(TrainingConfig))]
            raise AntsError(f"`training.{name}` {not_a_setting(name, known, config.learner)}")
    own = kind(**dict(config.hyperparameters))
    return replace(config, hyperparameters=tuple(asdict(own).items()))


def names() -> tuple[str, ...]:
    """The names of all registered learners, in the order of registration."""
    return (*BUILT_IN, *_LEARNERS)
