"""The features of the model; see `taichi_ants.features.feature`."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from taichi_ants.features.castes import CASTES
from taichi_ants.features.castes import numbers_of_castes as numbers_of_castes
from taichi_ants.features.choice import CHOICE
from taichi_ants.features.feature import Array, Feature, Task
from taichi_ants.features.fields import FIELDS
from taichi_ants.features.foods import FOODS, HELD, PAID
from taichi_ants.features.labour import LABOUR
from taichi_ants.features.life import AGE
from taichi_ants.features.noise import MISREAD, SLIP
from taichi_ants.features.points import POINTS
from taichi_ants.kernel_functions import KernelFunction

if TYPE_CHECKING:
    import numpy as np

# In the order of their hooks, which is the order of random draws.
FEATURES: tuple[Feature, ...] = (
    *(HELD, FOODS, PAID, CASTES, CHOICE, FIELDS, LABOUR, SLIP, MISREAD, AGE),
)
# The places of numbers of castes in the numbers of the task, which ants without castes have.
NUMBERS = {
    name: (f"{feature.group}_numbers", feature.numbers.index(name))
    for feature in FEATURES
    for name in feature.of_castes
    if name in feature.numbers
}
INPUTS = {name: read for feature in FEATURES for name, read in feature.inputs.items()}


def used_by(task: Task) -> tuple[Feature, ...]:
    """Return the features that a task uses."""
    return tuple(feature for feature in FEATURES if feature.is_used(task))


def hooks_at(features: Collection[Feature]) -> dict[str, list[KernelFunction]]:
    """Return the hooks of features at each point, in their order."""
    return {
        point: [feature.hooks[point] for feature in features if point in feature.hooks]
        for point in POINTS
    }


def probabilities(task: Task) -> dict[str, np.uint64]:
    """Return the probabilities of features as kernels read them: bounds of a random 32-bit word."""
    import numpy as np

    return {
        f"{name}_below": np.uint64(getattr(feature.of(task), name) * 4294967296.0)
        for feature in FEATURES
        for name in feature.probabilities
    }


def numbers(task: Task) -> dict[str, np.ndarray]:
    """Return the numbers of features that a task uses, as kernels read them, f64; None is 0."""
    import numpy as np

    return {
        f"{feature.group}_numbers": np.array(
            [getattr(feature.of(task), name) or 0.0 for name in feature.numbers], np.float64
        )
        for feature in used_by(task)
        if feature.numbers
    }


def arrays(per: str = "") -> Iterator[tuple[Feature, Array]]:
    """Yield the arrays of all features, or those with an entry for each ant or nest."""
    for feature in FEATURES:
        for array in feature.arrays:
            if per in ("", array.per):
                yield feature, array


def without_files(task: Task) -> Task:
    """Return a task whose colonies have equal arrays, but read no files when they are made."""
    for feature in FEATURES:
        task = feature.without_files(task)
    return task
