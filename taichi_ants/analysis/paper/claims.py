"""All empirical claims of the paper, in its order, as one table.

One is left out: that all methods have a similar cost per step, Dyna-Q's planning apart (3.3.2), as
a comparison records no run times; benchmarks/throughput.py measures them. How far a word such as
"about", "close" or "consistently" goes is the criterion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_ants.analysis.findings import Criterion, above
from taichi_ants.analysis.paper.published import (
    DYNA_P3,
    DYNA_P5,
    GREEDY_RETURN,
    GREEDY_STEPS,
    Q_LEARNING,
    SARSA,
    VARIANTS,
)
from taichi_ants.analysis.paper.quantities import (
    AT_FIGURE_1,
    AT_TABLE_2,
    BEST,
    EPSILON_AT_TABLE_2,
    LEAST_OF_ALL,
    MEAN_OF_ALL,
    Quantity,
    effect_of,
    growth,
    less_exploration,
    minus,
    more_dependent,
    of,
    of_each,
    rank_correlation,
    share_above,
    stronger,
)


@dataclass(frozen=True, eq=False)
class Claim:
    """An empirical claim of the paper, made precise.

    Attributes:
        id, section, statement: A unique name, the paper's section, its claim in our words.
        criterion: What every effect of the quantity must fulfil.
        quantity: What is computed.
        why: Why this criterion or quantity, where it is not plain.
    """

    id: str
    section: str
    statement: str
    criterion: Criterion
    quantity: Quantity
    why: str = ""

    @property
    def tested_on(self) -> str:
        """What is computed, and why so."""
        text = f"{self.quantity.words}: {'; '.join(self.quantity.effects)}"
        return f"{text}; {self.why}" if self.why else text

    @property
    def estimator(self) -> str:
        """What of the seeds must fulfil the criterion."""
        return "interquartile mean" if self.quantity.uses_iqm else "mean"


# What is too small to matter. An episode along the shortest path returns 45 reward in 34 steps:
# one reward is one step on a trail, and two steps is the spread that the paper itself calls alike
# ("34-36 steps").
REWARD, STEPS = 1.0, 2.0
FLUCTUATION = 0.5  # reward
# "Substantially", "much" in steps: a tenth of the paper's 101 steps of Q-learning.
MANY_STEPS = 10.0

RETURN, EARLY_RETURN = "return_last50", "return_first50"
ALL_STEPS, LATE_STEPS, EARLY_STEPS = "steps_all", "steps_last50", "steps_first50"
LATE_FLUCTUATION, ALL_FLUCTUATION = "return_fluctuation_last50", "return_fluctuation_all"

DYNAS = (DYNA_P3, DYNA_P5)
Q_MINUS_OTHERS = tuple((Q_LEARNING, other) for other in (SARSA, *DYNAS))
OTHERS_MINUS_SARSA = tuple((other, SARSA) for other in (Q_LEARNING, *DYNAS))
Q_MINUS_DYNAS = tuple((Q_LEARNING, dyna) for dyna in DYNAS)
DYNAS_MINUS_Q = tuple((dyna, Q_LEARNING) for dyna in DYNAS)
DYNAS_MINUS_OTHERS = tuple((dyna, other) for dyna in DYNAS for other in (Q_LEARNING, SARSA))
# What must be positive for Dyna-Q to lie between the two others.
Q_OVER_DYNA_OVER_SARSA = tuple(
    pair for dyna in DYNAS for pair in ((Q_LEARNING, dyna), (dyna, SARSA))
)
# Different algorithms only: the two planning depths are not compared with each other. The paper
# does not say how many planning steps its Dyna-Q takes in figure 1, so both must fulfil it.
ALGORITHMS = (*OTHERS_MINUS_SARSA, *DYNAS_MINUS_Q)
LESS_EXPLORATION = tuple(less_exploration(*places) for places in ((0, 1), (1, 0), (1, 1)))

_TABLE_2 = "the configurations differ in more than the learner"
_DEPTH = "the configurations differ in more than the depth"
_MUCH = f"'substantially', 'much' is more than {MANY_STEPS:g} steps"
_GREEDY = "3.2, greedy evaluation"

# One claim after the other: name, section, statement; criterion, quantity; why.
# fmt: off
CLAIMS: tuple[Claim, ...] = (
    Claim("q-return-highest", "3.2", "Q-learning reaches the highest return of all learners.",
          above(REWARD), minus(AT_TABLE_2, RETURN, *Q_MINUS_OTHERS)),
    Claim("q-high-return-long-episodes", "3.2",
          "Q-learning's high returns go with longer episodes.",
          above(0.1), rank_correlation(RETURN, LATE_STEPS, Q_LEARNING)),
    Claim("sarsa-return-slightly-lower", "3.2",
          "SARSA's best return is slightly below Q-learning's.",
          above(REWARD, most=10.0), minus(AT_TABLE_2, RETURN, (Q_LEARNING, SARSA)),
          "'slightly' is up to 10, as the paper's own gap is 9.6"),
    Claim("sarsa-much-shorter", "3.2",
          "SARSA's episodes are substantially shorter than Q-learning's.",
          above(STEPS, least=MANY_STEPS), minus(AT_TABLE_2, ALL_STEPS, (Q_LEARNING, SARSA)),
          f"{_TABLE_2}; {_MUCH}"),
    Claim("sarsa-consistently-direct", "3.2",
          "SARSA's routes are consistently more direct than Q-learning's.",
          Criterion(0.75), share_above(LATE_STEPS, SARSA, Q_LEARNING, below=True)),
    Claim("sarsa-shortest-episode", "3.2", "The shortest SARSA episode takes about 55 steps.",
          Criterion(50.0, 60.0), of(LEAST_OF_ALL, "shortest_episode", SARSA)),
    Claim("sarsa-shortest-mean", "3.2",
          "The shortest SARSA episodes take about 55 steps, read as a mean over training.",
          Criterion(50.0, 60.0), of(LEAST_OF_ALL, ALL_STEPS, SARSA)),
    Claim("sarsa-more-stable", "3.2", "SARSA is more stable than Q-learning.",
          above(FLUCTUATION), minus(MEAN_OF_ALL, LATE_FLUCTUATION, (Q_LEARNING, SARSA))),
    Claim("dyna-depth-return-best", "3.2",
          "Deeper planning can raise Dyna-Q's return: the best with 5 steps returns more than the "
          "best with 3.",
          above(REWARD), minus(AT_TABLE_2, RETURN, (DYNA_P5, DYNA_P3)),
          _DEPTH),
    Claim("dyna-depth-return-some", "3.2, 3.3.1",
          "Deeper planning raises Dyna-Q's return in some cases only.",
          Criterion(1 / 16, 0.5), share_above(RETURN, DYNA_P5, DYNA_P3),
          "'some' is at least one, at most half"),
    Claim("dyna-depth-length-best", "3.2",
          "Dyna-Q's best configuration with 5 planning steps has much longer episodes than the one "
          "with 3.",
          above(STEPS, least=MANY_STEPS), minus(AT_TABLE_2, ALL_STEPS, (DYNA_P5, DYNA_P3)),
          f"{_DEPTH}; {_MUCH}"),
    Claim("dyna-depth-length", "3.2, 3.3.1",
          "Deeper planning generally lengthens Dyna-Q's episodes.",
          above(STEPS), minus(MEAN_OF_ALL, ALL_STEPS, (DYNA_P5, DYNA_P3))),
    Claim("dyna-depth-length-often", "3.2, 3.3.1",
          "Deeper planning lengthens Dyna-Q's episodes in most configurations.",
          Criterion(0.5), share_above(ALL_STEPS, DYNA_P5, DYNA_P3)),
    Claim("dyna-below-q-peak", "3.2", "Dyna-Q does not surpass Q-learning's peak return.",
          Criterion(-REWARD), minus(BEST, RETURN, *Q_MINUS_DYNAS)),
    Claim("dyna-between-return", "3.2", "Dyna-Q's return lies between SARSA's and Q-learning's.",
          above(REWARD), minus(AT_TABLE_2, RETURN, *Q_OVER_DYNA_OVER_SARSA)),
    Claim("dyna-between-length", "3.2",
          "Dyna-Q's episode length lies between SARSA's and Q-learning's.",
          above(STEPS), minus(AT_TABLE_2, ALL_STEPS, *Q_OVER_DYNA_OVER_SARSA)),
    Claim("deliveries-about-one", "3.2",
          "Nearly every late episode ends with a delivery, for all learners.",
          Criterion(0.98), of(AT_TABLE_2, "deliveries_last50", *VARIANTS),
          "'nearly every' is 98 % or more, as the paper reports 0.99 to 1.0"),
    Claim("curves-close-returns", "3.2, figure 1",
          "All learners converge to returns close to each other.",
          Criterion(-5.0, 5.0), minus(AT_FIGURE_1, RETURN, *ALGORITHMS)),
    Claim("curves-early-variance", "3.2, figure 1",
          "Q-learning and Dyna-Q vary more than SARSA early in training.",
          above(FLUCTUATION),
          minus(AT_FIGURE_1, "return_fluctuation_first50", *OTHERS_MINUS_SARSA)),
    Claim("curves-sarsa-stable", "3.2, figure 1",
          "SARSA remains the more stable one over training.",
          above(FLUCTUATION), minus(AT_FIGURE_1, ALL_FLUCTUATION, *OTHERS_MINUS_SARSA)),
    Claim("curves-sarsa-falls-fastest", "3.2, figure 1", "SARSA's episode lengths fall fastest.",
          above(STEPS), minus(AT_FIGURE_1, EARLY_STEPS, *OTHERS_MINUS_SARSA),
          "all start from the same random behaviour, so a lower early mean is a faster fall"),
    Claim("curves-dyna-fluctuates-return", "3.2, figure 1",
          "Dyna-Q's returns fluctuate more than the others'.",
          above(FLUCTUATION), minus(AT_FIGURE_1, ALL_FLUCTUATION, *DYNAS_MINUS_OTHERS)),
    Claim("curves-dyna-fluctuates-length", "3.2, figure 1",
          "Dyna-Q's episode lengths fluctuate more than the others'.",
          above(STEPS), minus(AT_FIGURE_1, "steps_fluctuation_all", *DYNAS_MINUS_OTHERS)),
    Claim("curves-deliveries-quick", "3.2, figure 1",
          "All learners quickly reach one delivery in every episode.",
          Criterion(0.95), of(AT_FIGURE_1, "deliveries_second50", *VARIANTS),
          "'every' is 95 % or more, as exploration is still at a fifth of all actions"),
    Claim("curves-equal-success", "3.2, figure 1", "The learners do not differ in final success.",
          Criterion(-0.02, 0.02), minus(AT_FIGURE_1, "deliveries_last50", *ALGORITHMS)),
    Claim("greedy-return", _GREEDY, "Greedy policies of all learners return about 45.",
          Criterion(GREEDY_RETURN - REWARD, GREEDY_RETURN + REWARD),
          of(AT_TABLE_2, "greedy_return", *VARIANTS)),
    Claim("greedy-steps", _GREEDY, "Greedy policies of all learners need 34 to 36 steps.",
          Criterion(GREEDY_STEPS[0] - 0.5, GREEDY_STEPS[1] + 0.5),
          of(AT_TABLE_2, "greedy_steps", *VARIANTS),
          "rounded to whole steps"),
    Claim("greedy-success", _GREEDY, "Greedy policies of all learners deliver consistently.",
          Criterion(0.98), of(AT_TABLE_2, "greedy_deliveries", *VARIANTS)),
    Claim("greedy-deterministic", _GREEDY, "Greedy policies are deterministic.",
          Criterion(0.95), of(AT_TABLE_2, "greedy_repeats", *VARIANTS)),
    Claim("greedy-alike-return", _GREEDY, "Greedy policies of all learners are alike in return.",
          Criterion(-REWARD, REWARD), minus(AT_TABLE_2, "greedy_return", *ALGORITHMS)),
    Claim("greedy-alike-length", _GREEDY, "Greedy policies of all learners are alike in length.",
          Criterion(-STEPS, STEPS), minus(AT_TABLE_2, "greedy_steps", *ALGORITHMS)),
    Claim("rate-strongest", "3.3.1",
          "The learning rate has the strongest impact of all hyperparameters.",
          above(REWARD), stronger(RETURN, "learning_rate")),
    Claim("rate-q-small-best", "3.3.1", "Q-learning performs best with the small learning rate.",
          above(REWARD), of(effect_of("learning_rate", sign=-1), RETURN, Q_LEARNING)),
    Claim("rate-destabilises", "3.3.1",
          "The large learning rate destabilises Q-learning and Dyna-Q.",
          above(FLUCTUATION), of(effect_of("learning_rate"), LATE_FLUCTUATION, Q_LEARNING, *DYNAS)),
    Claim("rate-destabilises-dyna-most", "3.3.1",
          "The large learning rate destabilises Dyna-Q more than Q-learning.",
          above(FLUCTUATION), minus(effect_of("learning_rate"), LATE_FLUCTUATION, *DYNAS_MINUS_Q)),
    Claim("rate-sarsa-reliable", "3.3.1",
          "SARSA handles the large learning rate more reliably than the others.",
          above(FLUCTUATION),
          minus(effect_of("learning_rate"), LATE_FLUCTUATION, *OTHERS_MINUS_SARSA)),
    Claim("epsilon-q-moderate", "3.3.1",
          "Q-learning favours moderate exploration: epsilon 0.3 with fast decay.",
          above(REWARD), of_each(RETURN, Q_LEARNING, *LESS_EXPLORATION)),
    Claim("epsilon-dyna-return", "3.3.1", "Dyna-Q can benefit from epsilon 0.5.",
          above(REWARD), of(EPSILON_AT_TABLE_2, RETURN, DYNA_P5),
          "the paper's configuration is the one with epsilon 0.5"),
    Claim("epsilon-dyna-length", "3.3.1", "Epsilon 0.5 costs Dyna-Q longer episodes.",
          above(STEPS), of(effect_of("epsilon"), ALL_STEPS, *DYNAS)),
    Claim("epsilon-sarsa-robust", "3.3.1", "SARSA is robust to the exploration schedule.",
          Criterion(-2.5, 2.5),
          of_each(RETURN, SARSA, effect_of("epsilon"), effect_of("epsilon_decay"))),
    Claim("discount-q", "3.3.1", "Discount 0.99 raises Q-learning's return.",
          above(REWARD), of(effect_of("discount"), RETURN, Q_LEARNING)),
    Claim("discount-depends", "3.3.1",
          "The discount's effect depends more on the configuration for SARSA and Dyna-Q than for "
          "Q-learning.",
          above(REWARD), more_dependent(RETURN, "discount", (SARSA, Q_LEARNING), *DYNAS_MINUS_Q)),
    Claim("depth-stability", "3.3.1", "Dyna-Q is more stable with 3 planning steps than with 5.",
          above(FLUCTUATION), minus(MEAN_OF_ALL, LATE_FLUCTUATION, (DYNA_P5, DYNA_P3))),
    Claim("planning-no-gain-return", "3.3.2",
          "Planning brings no clear gain in sample efficiency: early returns.",
          Criterion(-np.inf, REWARD), minus(MEAN_OF_ALL, EARLY_RETURN, *DYNAS_MINUS_Q)),
    Claim("planning-no-gain-length", "3.3.2",
          "Planning brings no clear gain in sample efficiency: early episode lengths.",
          Criterion(-np.inf, STEPS), minus(MEAN_OF_ALL, EARLY_STEPS, *Q_MINUS_DYNAS)),
    Claim("overall-q-return", "3.4", "Q-learning excels in return.",
          above(REWARD), minus(MEAN_OF_ALL, RETURN, *Q_MINUS_OTHERS)),
    Claim("overall-sarsa-length", "3.4", "SARSA is the most step-efficient.",
          above(STEPS), minus(MEAN_OF_ALL, ALL_STEPS, *OTHERS_MINUS_SARSA)),
    Claim("overall-dyna-return", "3.4",
          "Dyna-Q offers intermediate performance: returns between SARSA's and Q-learning's.",
          above(REWARD), minus(MEAN_OF_ALL, RETURN, *Q_OVER_DYNA_OVER_SARSA)),
    Claim("overall-dyna-length", "3.4",
          "Dyna-Q offers intermediate performance: lengths between SARSA's and Q-learning's.",
          above(STEPS), minus(MEAN_OF_ALL, ALL_STEPS, *Q_OVER_DYNA_OVER_SARSA)),
    Claim("overall-improvement", "4", "All learners improve over the 500 episodes.",
          above(REWARD), growth(RETURN, EARLY_RETURN, *VARIANTS)),
    Claim("overall-improvement-reliable", "4", "The improvement is reliable.",
          Criterion(0.95), of(MEAN_OF_ALL, "improved", *VARIANTS)),
)
# fmt: on
