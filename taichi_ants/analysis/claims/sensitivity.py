"""The claims of sections 3.3 and 3.4 and of the conclusions.

They speak of hyperparameters and of learners in general, so they use all 16 configurations: a
factor's effect is the mean difference over the 8 pairs of configurations that differ in it alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from taichi_ants.analysis.claims.contrasts import (
    FLUCTUATION_MARGIN,
    Q_OVER_DYNA_OVER_SARSA,
    REWARD,
    REWARD_MARGIN,
    SHARE,
    STEPS,
    STEPS_MARGIN,
    differences,
    each,
)
from taichi_ants.analysis.claims.model import Above, Claim, Contrast, Within
from taichi_ants.analysis.claims.slice import Slice
from taichi_ants.analysis.paper.comparison import Variant
from taichi_ants.analysis.paper.published import (
    DYNA_P3,
    DYNA_P5,
    FACTORS,
    Q_LEARNING,
    SARSA,
    TABLE_2,
    VARIANTS,
)

_DYNAS = (DYNA_P3, DYNA_P5)
_OTHERS = (Q_LEARNING, *_DYNAS)
_LATE_FLUCTUATION = "return_fluctuation_last50"


def _effect(part: Slice, measure: str, variant: Variant, factor: str) -> np.ndarray:
    return part.pairs(measure, variant, factor).mean(axis=0)


def _factor(
    measure: str, variants: Iterable[Variant], factor: str, sign: float = 1.0
) -> tuple[Contrast, ...]:
    """A factor's effect on each learner: its upper minus its lower value, times the sign."""
    lower, upper = FACTORS[factor][:: int(sign)]

    def contrast(variant: Variant) -> Contrast:
        return Contrast(
            f"{variant.label}, {upper:g} minus {lower:g}",
            lambda part: sign * _effect(part, measure, variant, factor),
        )

    return tuple(contrast(variant) for variant in variants)


def _more_destabilised(first: Variant, second: Variant) -> Contrast:
    """How much more the larger learning rate adds to the first learner's fluctuation."""
    return Contrast(
        f"{first.label} minus {second.label}",
        lambda part: (
            _effect(part, _LATE_FLUCTUATION, first, "learning_rate")
            - _effect(part, _LATE_FLUCTUATION, second, "learning_rate")
        ),
    )


def _learning_rate_against(factor: str) -> Contrast:
    """Strength of the learning rate minus that of another factor, mean over learners."""
    return Contrast(
        f"learning rate minus {factor.replace('_', ' ')}",
        lambda part: np.stack(
            [
                _effect(part, "return_last50", variant, name)
                for name in ("learning_rate", factor)
                for variant in VARIANTS
            ]
        ),
        lambda centres: _first_minus_second(np.abs(centres), np.mean),
    )


def _more_dependent(first: Variant, second: Variant) -> Contrast:
    """How much more the discount's effect varies over configurations for the first learner."""
    return Contrast(
        f"{first.label} minus {second.label}",
        lambda part: np.concatenate(
            [part.pairs("return_last50", variant, "discount") for variant in (first, second)]
        ),
        lambda centres: _first_minus_second(centres, partial(np.std, ddof=1)),
    )


def _first_minus_second(centres: np.ndarray, statistic: Callable[..., Any]) -> np.ndarray:
    """A statistic of the first half of the rows minus that of the second."""
    first, second = np.split(centres, 2)
    return statistic(first, axis=0) - statistic(second, axis=0)


def _moderate_exploration_against(epsilon: int, decay: int) -> Contrast:
    """Q-learning at epsilon 0.3 and decay 0.99 minus other values of the two, mean over 4."""
    values = FACTORS["epsilon"][epsilon], FACTORS["epsilon_decay"][decay]

    def effect(part: Slice) -> np.ndarray:
        grid = part.grid("return_last50", Q_LEARNING)
        return (grid[:, :, 0, 0] - grid[:, :, epsilon, decay]).mean(axis=(0, 1))

    return Contrast("0.3 / 0.99 minus {:g} / {:g}".format(*values), effect)


def _improvement(variant: Variant) -> Contrast:
    """How much more a learner returns in the last 50 episodes than in the first 50."""
    return Contrast(
        variant.label,
        lambda part: part.mean("return_last50", variant) - part.mean("return_first50", variant),
    )


def _high_epsilon_at_best_p5(part: Slice) -> np.ndarray:
    best = TABLE_2[DYNA_P5].hyperparameters
    high, low = (
        part.at("return_last50", DYNA_P5, best._replace(epsilon=epsilon)) for epsilon in (0.5, 0.3)
    )
    return high - low


LEARNING_RATE_CLAIMS = (
    Claim(
        "rate-strongest",
        "3.3.1",
        "The learning rate has the strongest impact of all hyperparameters.",
        "absolute effect on return (last 50 episodes), mean over the four learners, of the "
        "learning rate minus that of each other factor",
        REWARD,
        Above(REWARD_MARGIN),
        tuple(_learning_rate_against(factor) for factor in list(FACTORS)[1:]),
    ),
    Claim(
        "rate-q-small-best",
        "3.3.1",
        "Q-learning performs best with the small learning rate.",
        "return (last 50 episodes) of Q-learning, 8 pairs of configurations",
        REWARD,
        Above(REWARD_MARGIN),
        _factor("return_last50", [Q_LEARNING], "learning_rate", sign=-1),
    ),
    Claim(
        "rate-destabilises",
        "3.3.1",
        "The large learning rate destabilises Q-learning and Dyna-Q.",
        "fluctuation of the return from episode to episode (last 50), 8 pairs of configurations",
        REWARD,
        Above(FLUCTUATION_MARGIN),
        _factor(_LATE_FLUCTUATION, _OTHERS, "learning_rate"),
    ),
    Claim(
        "rate-destabilises-dyna-most",
        "3.3.1",
        "The large learning rate destabilises Dyna-Q more than Q-learning.",
        "what learning rate 0.01 adds to the fluctuation of the return (last 50 episodes) over "
        "0.001, Dyna-Q minus Q-learning, 8 pairs of configurations each",
        REWARD,
        Above(FLUCTUATION_MARGIN),
        tuple(_more_destabilised(dyna, Q_LEARNING) for dyna in _DYNAS),
    ),
    Claim(
        "rate-sarsa-reliable",
        "3.3.1",
        "SARSA handles the large learning rate more reliably than the others.",
        "what learning rate 0.01 adds to the fluctuation of the return (last 50 episodes) over "
        "0.001, each learner minus SARSA, 8 pairs of configurations each",
        REWARD,
        Above(FLUCTUATION_MARGIN),
        tuple(_more_destabilised(other, SARSA) for other in _OTHERS),
    ),
)

EXPLORATION_CLAIMS = (
    Claim(
        "epsilon-q-moderate",
        "3.3.1",
        "Q-learning favours moderate exploration: epsilon 0.3 with fast decay.",
        "return (last 50 episodes) of Q-learning at epsilon 0.3 and decay 0.99 minus each other "
        "combination of the two, mean over 4 matched configurations",
        REWARD,
        Above(REWARD_MARGIN),
        tuple(_moderate_exploration_against(*other) for other in ((0, 1), (1, 0), (1, 1))),
    ),
    Claim(
        "epsilon-dyna-return",
        "3.3.1",
        "Dyna-Q can benefit from epsilon 0.5.",
        "return (last 50 episodes) of Dyna-Q (p5) at epsilon 0.5 minus 0.3, at its configuration "
        "in table 2, the one with epsilon 0.5",
        REWARD,
        Above(REWARD_MARGIN),
        (Contrast(f"{DYNA_P5.label}, 0.5 minus 0.3", _high_epsilon_at_best_p5),),
    ),
    Claim(
        "epsilon-dyna-length",
        "3.3.1",
        "Epsilon 0.5 costs Dyna-Q longer episodes.",
        "length (all episodes) of Dyna-Q, 8 pairs of configurations for each depth",
        STEPS,
        Above(STEPS_MARGIN),
        _factor("steps_all", _DYNAS, "epsilon"),
    ),
    Claim(
        "epsilon-sarsa-robust",
        "3.3.1",
        "SARSA is robust to the exploration schedule.",
        "return (last 50 episodes) of SARSA, effects of epsilon and of its decay, 8 pairs of "
        "configurations each; 'robust' is within 2.5 reward, about a twentieth",
        REWARD,
        Within(-2.5, 2.5),
        _factor("return_last50", [SARSA], "epsilon")
        + _factor("return_last50", [SARSA], "epsilon_decay"),
    ),
)

DISCOUNT_CLAIMS = (
    Claim(
        "discount-q",
        "3.3.1",
        "Discount 0.99 raises Q-learning's return.",
        "return (last 50 episodes) of Q-learning, 8 pairs of configurations",
        REWARD,
        Above(REWARD_MARGIN),
        _factor("return_last50", [Q_LEARNING], "discount"),
    ),
    Claim(
        "discount-depends",
        "3.3.1",
        "The discount's effect depends more on the configuration for SARSA and Dyna-Q than for "
        "Q-learning.",
        "standard deviation over 8 pairs of configurations of the discount's mean effect on "
        "return (last 50 episodes), SARSA and Dyna-Q minus Q-learning (jackknife over seeds)",
        REWARD,
        Above(REWARD_MARGIN),
        tuple(_more_dependent(other, Q_LEARNING) for other in (SARSA, *_DYNAS)),
    ),
)

PLANNING_CLAIMS = (
    Claim(
        "depth-stability",
        "3.3.1",
        "Dyna-Q is more stable with 3 planning steps than with 5.",
        "fluctuation of the return from episode to episode (last 50) of Dyna-Q (p5) minus "
        "Dyna-Q (p3), mean over 16 matched configurations",
        REWARD,
        Above(FLUCTUATION_MARGIN),
        differences(Slice.mean, _LATE_FLUCTUATION, [(DYNA_P5, DYNA_P3)]),
    ),
    Claim(
        "planning-no-gain-return",
        "3.3.2",
        "Planning brings no clear gain in sample efficiency: early returns.",
        "return (first 50 episodes) of Dyna-Q minus Q-learning, mean over 16 matched "
        "configurations; more than 1 would be a clear gain",
        REWARD,
        Within(-np.inf, REWARD_MARGIN),
        differences(Slice.mean, "return_first50", [(dyna, Q_LEARNING) for dyna in _DYNAS]),
    ),
    Claim(
        "planning-no-gain-length",
        "3.3.2",
        "Planning brings no clear gain in sample efficiency: early episode lengths.",
        "length (first 50 episodes) of Q-learning minus Dyna-Q, mean over 16 matched "
        "configurations; more than 2 would be a clear gain",
        STEPS,
        Within(-np.inf, STEPS_MARGIN),
        differences(Slice.mean, "steps_first50", [(Q_LEARNING, dyna) for dyna in _DYNAS]),
    ),
)

GENERAL_CLAIMS = (
    Claim(
        "overall-q-return",
        "3.4",
        "Q-learning excels in return.",
        "return (last 50 episodes) of Q-learning minus each other learner, mean over 16 matched "
        "configurations",
        REWARD,
        Above(REWARD_MARGIN),
        differences(Slice.mean, "return_last50", [(Q_LEARNING, v) for v in (SARSA, *_DYNAS)]),
    ),
    Claim(
        "overall-sarsa-length",
        "3.4",
        "SARSA is the most step-efficient.",
        "length (all episodes) of each other learner minus SARSA, mean over 16 matched "
        "configurations",
        STEPS,
        Above(STEPS_MARGIN),
        differences(Slice.mean, "steps_all", [(other, SARSA) for other in _OTHERS]),
    ),
    Claim(
        "overall-dyna-return",
        "3.4",
        "Dyna-Q offers intermediate performance: returns between SARSA's and Q-learning's.",
        "return (last 50 episodes), Q-learning minus Dyna-Q and Dyna-Q minus SARSA, mean over 16 "
        "matched configurations",
        REWARD,
        Above(REWARD_MARGIN),
        differences(Slice.mean, "return_last50", Q_OVER_DYNA_OVER_SARSA),
    ),
    Claim(
        "overall-dyna-length",
        "3.4",
        "Dyna-Q offers intermediate performance: lengths between SARSA's and Q-learning's.",
        "length (all episodes), Q-learning minus Dyna-Q and Dyna-Q minus SARSA, mean over 16 "
        "matched configurations",
        STEPS,
        Above(STEPS_MARGIN),
        differences(Slice.mean, "steps_all", Q_OVER_DYNA_OVER_SARSA),
    ),
    Claim(
        "overall-improvement",
        "4",
        "All learners improve over the 500 episodes.",
        "return of the last 50 minus the first 50 episodes, mean over 16 configurations",
        REWARD,
        Above(REWARD_MARGIN),
        tuple(_improvement(variant) for variant in VARIANTS),
    ),
    Claim(
        "overall-improvement-reliable",
        "4",
        "The improvement is reliable.",
        "share of runs whose last 50 episodes return more than their first 50, over 16 "
        "configurations; 'reliable' is 95 % or more",
        "share of runs",
        Within(0.95, np.inf),
        each(Slice.mean, "improved", VARIANTS),
        SHARE,
    ),
)
