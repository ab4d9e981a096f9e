"""The registry of learners.

To add one to the package, write a file in this folder and add its name to `BUILT_IN`. To add your
own learner, call `register` from a plugin file.
"""

from collections.abc import Mapping
from dataclasses import asdict, replace
from importlib import import_module
from typing import Any

from taichi_ants.errors import AntsError, expect, unusable
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.learner import Learner, Memory
from taichi_ants.registry import Registry
from taichi_ants.settings import declared, not_a_setting

# The built-in learners and their labels.
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


def _load(name: str) -> Learner:
    """Import the file `name.py` of a built-in learner on first use, because it imports Taichi."""
    return getattr(import_module(f"taichi_ants.learners.{name}"), name.upper())


LEARNERS = Registry("learner", "taichi_ants.learners.register", BUILT_IN, _load)
get, names = LEARNERS.get, LEARNERS.names


def register(learner: Learner) -> Learner:
    """Return a learner after registering it; it replaces your own learner of the same name.

    Existing results, colonies and kernels do not change. `taichi-ants check FILE` tries the
    functions of your learners. Raises AntsError if the name is not an identifier or belongs to a
    built-in learner, or a field does not have the form that `Learner` describes.

    >>> learners.register(replace(learners.get("sarsa"), name="my_sarsa")).name
    'my_sarsa'
    """
    expect("learner", learner, Learner)
    name = learner.name
    try:  # finds errors early
        settings = learner.hyperparameters()
        expect("the result of memory", learner.memory(settings, 128), Memory)
        learner.cost(settings)
    except Exception as error:
        raise unusable(learner, error) from error
    for setting in declared(learner.hyperparameters):
        if setting.name in {common.name for common in declared(TrainingConfig)}:
            raise AntsError(
                f"{setting.name!r} is a setting of all learners; choose another name for this "
                f"hyperparameter of {name!r}."
            )
    return LEARNERS.add(name, learner)


def label(name: str) -> str:
    """Return the label for readers, for example "Dyna-Q"; for learners of plugins, the name."""
    expect("name", name, str)
    return BUILT_IN.get(name, name)


def with_hyperparameters(config: TrainingConfig) -> TrainingConfig:
    """Return the configuration with all hyperparameters of its learner.

    Raises AntsError if the learner or a hyperparameter does not exist, or a value is not allowed.
    """
    expect("the configuration", config, TrainingConfig)
    learner = get(config.learner)
    config = replace(config)  # checks hyperparameters of a learner that was registered later
    return replace(config, hyperparameters=tuple(asdict(learner.settings(config)).items()))


def _checked(learner: Any, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return hyperparameters as numbers of Python, checked if the learner is registered."""
    plain = {n: v.item() if getattr(v, "size", 0) == 1 else v for n, v in given.items()}
    if plain and isinstance(learner, str) and learner in names():
        kind = get(learner).hyperparameters
        known = [setting.name for setting in (*declared(kind), *declared(TrainingConfig))]
        for name in plain:
            if name not in known[: len(declared(kind))]:
                raise AntsError(f"`training.{name}` {not_a_setting(name, known, learner)}")
        kind(**plain)
    return plain


TrainingConfig._checked = staticmethod(_checked)
