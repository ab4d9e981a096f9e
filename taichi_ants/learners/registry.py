"""The registry of learners.

To add one to the package, write a file in this folder and add its name to `BUILT_IN`. To add your
own learner, call `register` from a plugin file.
"""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from importlib import import_module

from taichi_ants.errors import AntsError, check_new_name, expect, shown, unusable
from taichi_ants.learners.config import Hyperparameters, TrainingConfig
from taichi_ants.learners.learner import Learner, Memory, check_arguments, check_td_error
from taichi_ants.settings import declared, not_a_setting

# The built-in learners and their labels. Learner NAME is in the file `name.py`, which imports
# Taichi and is therefore imported on first use.
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
    """Return a learner after registering it; it replaces your own learner of the same name.

    Existing results, colonies and kernels do not change. `taichi-ants check FILE` tries the
    functions of your learners. Raises AntsError if the name is not an identifier or belongs to a
    built-in learner, or a field does not have the form that `Learner` describes.
    """
    expect("learner", learner, Learner)
    name = learner.name
    check_new_name("learner", name, BUILT_IN)
    parts = ["memory", "at", "step", "rates", "random_state"]
    check_arguments(f"the function learn of {name!r}", learner.learn, parts)
    if learner.begin is not None:
        check_arguments(f"the function begin of {name!r}", learner.begin, parts[:2])
    if learner.td_error is not None:
        check_td_error(name, learner.td_error)
    _try_sizes(learner)
    taken = {one.name for one in declared(TrainingConfig)}
    for clash in taken & {one.name for one in declared(learner.hyperparameters)}:
        raise AntsError(
            f"{clash!r} is a setting of all learners; choose another name for this hyperparameter "
            f"of {name!r}."
        )
    _LEARNERS[name] = learner
    return learner


def _try_sizes(learner: Learner) -> None:
    """Compute hyperparameters, memory and cost with default values, to find errors early."""
    part = "hyperparameters"
    try:
        settings = learner.hyperparameters()
        expect(part, settings, Hyperparameters)
        part = "memory"
        expect("its result", learner.memory(settings, 128), Memory)
        part = "cost"
        if not 0 < learner.cost(settings) < math.inf:
            raise ValueError(f"it returns {learner.cost(settings)}, which must be above 0")
    except Exception as error:
        raise unusable(learner, f"{part} fails ({error})") from error


def get(name: str) -> Learner:
    """Return the learner of this name; AntsError, with a list of all names, if there is none."""
    expect("the learner", name, str)
    if name in BUILT_IN:
        return getattr(import_module(f"taichi_ants.learners.{name}"), name.upper())
    if name not in _LEARNERS:
        raise AntsError(
            f"there is no learner {shown(name)}; choose one of {', '.join(names())}, or give the "
            "file that registers it with --plugin."
        )
    return _LEARNERS[name]


def label(name: str) -> str:
    """Return the label for readers, for example "Dyna-Q"; for learners of plugins, the name."""
    expect("name", name, str)
    return BUILT_IN.get(name, name)


def with_hyperparameters(config: TrainingConfig) -> TrainingConfig:
    """Return the configuration with all hyperparameters of its learner.

    Raises AntsError if the learner or a hyperparameter does not exist, or a value is not allowed.
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
    """Return the names of all registered learners, in the order of registration."""
    return (*BUILT_IN, *_LEARNERS)
