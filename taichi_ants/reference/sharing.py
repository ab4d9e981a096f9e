"""Updates of a table that several ants share."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from taichi_ants.learners.config import update_weights
from taichi_ants.reference.ants import Pair, Transition
from taichi_ants.reference.learners import DynaQ, ReferenceLearner
from taichi_ants.reference.random_stream import RandomStream

_ONE = 1 << 32  # TD errors are summed in units of 2**-32


def learn_together(
    learner: ReferenceLearner,
    steps: Sequence[Transition],
    streams: Sequence[RandomStream],
    epsilon: float,
    most: int,
) -> None:
    """Learn from all transitions of a tick, and set the `td_error` of each.

    All TD errors of a tick, or of a round of planning, use the table from before it. The n errors
    of a pair are rounded to multiples of 2**-32, so that their sum is exact. They move the value by
    1 - (1 - alpha)**n of their mean, as n successive updates towards one target would. A single
    error is not rounded. `streams` are those of the ants, from which learners draw; `most` is the
    largest number of ants.
    """
    weights = update_weights(float(learner.learning_rate), most)
    for step, error in zip(steps, _update(learner, steps, epsilon, weights), strict=True):
        step.td_error = error
    if isinstance(learner, DynaQ):
        # If several ants have the same pair, the model keeps that of the highest number.
        for step in sorted(steps, key=lambda step: (step.pair, step.number)):
            learner.remember(step)
        for _ in range(int(learner.settings["planning_steps"])):
            _update(learner, [learner.draw_seen(stream) for stream in streams], epsilon, weights)


def _update(
    learner: ReferenceLearner, steps: Sequence[Transition], epsilon: float, weights: np.ndarray
) -> list[np.float32]:
    errors = [learner.error(step, epsilon) for step in steps]
    errors_of: dict[Pair, list[np.float32]] = defaultdict(list)
    for step, error in zip(steps, errors, strict=True):
        errors_of[step.pair].append(error)
    for pair, of_pair in errors_of.items():
        mean = of_pair[0] if len(of_pair) == 1 else mean_error(of_pair)
        learner.update(pair, weights[min(len(of_pair), len(weights) - 1)], mean)
    return errors


def mean_error(errors: Sequence[np.float32]) -> np.float32:
    """Return the mean of TD errors, each rounded to a multiple of 2**-32, rounded once at the end.

    The sum must fit into a signed 64-bit integer.
    """
    total = sum(int(np.floor(float(error) * _ONE + 0.5)) for error in errors)
    assert -(1 << 63) <= total < 1 << 63
    return np.float32(float(total) / (float(len(errors)) * _ONE))
