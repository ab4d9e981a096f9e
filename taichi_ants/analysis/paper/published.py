"""The numbers that the paper reports."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

from taichi_ants.analysis.paper.comparison import GridPoint, Variant

Q_LEARNING = Variant("q_learning")
SARSA = Variant("sarsa")
DYNA_P3 = Variant("dyna_q", "planning_steps=3")
DYNA_P5 = Variant("dyna_q", "planning_steps=5")
VARIANTS: tuple[Variant, ...] = (Q_LEARNING, SARSA, DYNA_P3, DYNA_P5)


class PaperRow(NamedTuple):
    """A row of the paper's table 2, with the numbers of one run."""

    point: GridPoint
    reward: float  # mean of the last 50 episodes
    # The column is headed "train avg steps", but section 3.1 says "the last 50 episodes". Our
    # means of all episodes are close to these numbers; those of the last 50 are not.
    steps: float
    deliveries: float  # per episode

    def figure(self, measure: str) -> float:
        """Return the paper's number for a measure, the same for "return_last50" as for "return"."""
        return getattr(self, measure.partition("_")[0].replace("return", "reward"))


TABLE_2: dict[Variant, PaperRow] = {
    Q_LEARNING: PaperRow(GridPoint(0.001, 0.99, 0.3, 0.99), 56.9, 100.9, 1.0),
    DYNA_P5: PaperRow(GridPoint(0.01, 0.99, 0.5, 0.995), 49.0, 137.9, 0.99),
    DYNA_P3: PaperRow(GridPoint(0.01, 0.9, 0.3, 0.995), 47.6, 81.0, 1.0),
    SARSA: PaperRow(GridPoint(0.01, 0.9, 0.3, 0.995), 47.3, 73.0, 1.0),
}

# The paper's figure 1 shows all learners with "shared hyperparameters" that it does not name. Only
# this configuration occurs twice in its table 2.
FIGURE_1 = GridPoint(0.01, 0.9, 0.3, 0.995)

GREEDY_RETURN = 45
GREEDY_STEPS = (34, 36)

# The paper's grid: each hyperparameter with its two values, in the order of `GridPoint`.
FACTORS: dict[str, tuple[float, float]] = {
    "learning_rate": (0.001, 0.01),
    "discount": (0.9, 0.99),
    "epsilon": (0.3, 0.5),
    "epsilon_decay": (0.99, 0.995),
}
GRID: tuple[GridPoint, ...] = tuple(GridPoint(*values) for values in product(*FACTORS.values()))
