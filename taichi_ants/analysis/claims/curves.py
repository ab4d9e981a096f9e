"""The claims of section 3.2 that rest on the paper's figure 1 and on its greedy evaluation.

Figure 1 shows all learners at one shared configuration. The paper does not say how many planning
steps its Dyna-Q takes there, so both depths must fulfil what it says of Dyna-Q.
"""

from __future__ import annotations

import numpy as np

from taichi_ants.analysis.claims.contrasts import (
    DELIVERIES,
    DIFFERENCE,
    FLUCTUATION_MARGIN,
    REWARD,
    REWARD_MARGIN,
    SHARE,
    STEPS,
    STEPS_MARGIN,
    differences,
    each,
)
from taichi_ants.analysis.claims.model import Above, Claim, Within
from taichi_ants.analysis.claims.slice import Slice
from taichi_ants.analysis.paper.published import (
    DYNA_P3,
    DYNA_P5,
    FIGURE_1,
    GREEDY_RETURN,
    GREEDY_STEPS,
    Q_LEARNING,
    SARSA,
    VARIANTS,
)

_AT_FIGURE_1 = f"at the shared configuration {FIGURE_1.label} (our choice, the paper names none)"
_AT_TABLE_2 = "at the configurations in table 2"
_OTHERS_AGAINST_SARSA = tuple((other, SARSA) for other in (Q_LEARNING, DYNA_P3, DYNA_P5))
# Different algorithms only: the two planning depths are not compared with each other.
_ALGORITHMS = (*_OTHERS_AGAINST_SARSA, (DYNA_P3, Q_LEARNING), (DYNA_P5, Q_LEARNING))
_DYNA_AGAINST_OTHERS = tuple(
    (dyna, other) for dyna in (DYNA_P3, DYNA_P5) for other in (Q_LEARNING, SARSA)
)

FIGURE_1_CLAIMS = (
    Claim(
        "curves-close-returns",
        "3.2, figure 1",
        "All learners converge to returns close to each other.",
        f"differences of return (last 50 episodes) between learners {_AT_FIGURE_1}; 'close' is "
        "5 reward, about a tenth",
        REWARD,
        Within(-5.0, 5.0),
        differences(Slice.figure1, "return_last50", _ALGORITHMS),
    ),
    Claim(
        "curves-early-variance",
        "3.2, figure 1",
        "Q-learning and Dyna-Q vary more than SARSA early in training.",
        "fluctuation of the return from episode to episode (first 50), each learner minus SARSA "
        f"{_AT_FIGURE_1}",
        REWARD,
        Above(FLUCTUATION_MARGIN),
        differences(Slice.figure1, "return_fluctuation_first50", _OTHERS_AGAINST_SARSA),
    ),
    Claim(
        "curves-sarsa-stable",
        "3.2, figure 1",
        "SARSA remains the more stable one over training.",
        "fluctuation of the return from episode to episode (all), each learner minus SARSA "
        f"{_AT_FIGURE_1}",
        REWARD,
        Above(FLUCTUATION_MARGIN),
        differences(Slice.figure1, "return_fluctuation_all", _OTHERS_AGAINST_SARSA),
    ),
    Claim(
        "curves-sarsa-falls-fastest",
        "3.2, figure 1",
        "SARSA's episode lengths fall fastest.",
        f"length (first 50 episodes), each learner minus SARSA {_AT_FIGURE_1}; all start from the "
        "same random behaviour, so a lower early mean is a faster fall",
        STEPS,
        Above(STEPS_MARGIN),
        differences(Slice.figure1, "steps_first50", _OTHERS_AGAINST_SARSA),
    ),
    Claim(
        "curves-dyna-fluctuates-return",
        "3.2, figure 1",
        "Dyna-Q's returns fluctuate more than the others'.",
        "fluctuation of the return from episode to episode (all), Dyna-Q minus Q-learning and "
        f"SARSA {_AT_FIGURE_1}",
        REWARD,
        Above(FLUCTUATION_MARGIN),
        differences(Slice.figure1, "return_fluctuation_all", _DYNA_AGAINST_OTHERS),
    ),
    Claim(
        "curves-dyna-fluctuates-length",
        "3.2, figure 1",
        "Dyna-Q's episode lengths fluctuate more than the others'.",
        "fluctuation of the length from episode to episode (all), Dyna-Q minus Q-learning and "
        f"SARSA {_AT_FIGURE_1}",
        STEPS,
        Above(STEPS_MARGIN),
        differences(Slice.figure1, "steps_fluctuation_all", _DYNA_AGAINST_OTHERS),
    ),
    Claim(
        "curves-deliveries-quick",
        "3.2, figure 1",
        "All learners quickly reach one delivery in every episode.",
        f"deliveries in episodes 51 to 100 {_AT_FIGURE_1}; 'every' is 95 % or more, as "
        "exploration is still at a fifth of all actions",
        DELIVERIES,
        Within(0.95, np.inf),
        each(Slice.figure1, "deliveries_second50", VARIANTS),
        SHARE,
    ),
    Claim(
        "curves-equal-success",
        "3.2, figure 1",
        "The learners do not differ in final success.",
        f"differences of deliveries (last 50 episodes) between learners {_AT_FIGURE_1}; up to "
        "0.02 counts as equal",
        DELIVERIES,
        Within(-0.02, 0.02),
        differences(Slice.figure1, "deliveries_last50", _ALGORITHMS),
        DIFFERENCE,
    ),
)

GREEDY_CLAIMS = (
    Claim(
        "greedy-return",
        "3.2, greedy evaluation",
        "Greedy policies of all learners return about 45.",
        f"mean return of the greedy rollouts {_AT_TABLE_2}; 'about' is 1 either way",
        REWARD,
        Within(GREEDY_RETURN - REWARD_MARGIN, GREEDY_RETURN + REWARD_MARGIN),
        each(Slice.table2, "greedy_return", VARIANTS),
    ),
    Claim(
        "greedy-steps",
        "3.2, greedy evaluation",
        "Greedy policies of all learners need 34 to 36 steps.",
        f"mean length of the greedy rollouts {_AT_TABLE_2}, rounded to whole steps",
        STEPS,
        Within(GREEDY_STEPS[0] - 0.5, GREEDY_STEPS[1] + 0.5),
        each(Slice.table2, "greedy_steps", VARIANTS),
    ),
    Claim(
        "greedy-success",
        "3.2, greedy evaluation",
        "Greedy policies of all learners deliver consistently.",
        f"deliveries of the greedy rollouts {_AT_TABLE_2}; 'consistently' is 98 % or more",
        DELIVERIES,
        Within(0.98, np.inf),
        each(Slice.table2, "greedy_deliveries", VARIANTS),
        SHARE,
    ),
    Claim(
        "greedy-deterministic",
        "3.2, greedy evaluation",
        "Greedy policies are deterministic.",
        f"share of runs whose greedy rollouts are all equal in return and length {_AT_TABLE_2}; "
        "95 % or more",
        "share of runs",
        Within(0.95, np.inf),
        each(Slice.table2, "greedy_repeats", VARIANTS),
        SHARE,
    ),
    Claim(
        "greedy-alike-return",
        "3.2, greedy evaluation",
        "Greedy policies of all learners are alike in return.",
        f"differences of greedy return between learners {_AT_TABLE_2}; up to 1 counts as alike",
        REWARD,
        Within(-REWARD_MARGIN, REWARD_MARGIN),
        differences(Slice.table2, "greedy_return", _ALGORITHMS),
    ),
    Claim(
        "greedy-alike-length",
        "3.2, greedy evaluation",
        "Greedy policies of all learners are alike in length.",
        f"differences of greedy length between learners {_AT_TABLE_2}; up to 2 counts as alike",
        STEPS,
        Within(-STEPS_MARGIN, STEPS_MARGIN),
        differences(Slice.table2, "greedy_steps", _ALGORITHMS),
    ),
)
