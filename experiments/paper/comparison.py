"""The data of a comparison, and the numbers that the paper reports.

Seeds are the unit of all statistics. A seed gives all configurations the same random numbers, so
differences of rows are paired by seed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS
from taichi_ants.learners import TrainingConfig
from taichi_ants.learners.registry import label
from taichi_ants.task import Task

NAMES = tuple(name.replace(" ", "_") for name in BEHAVIOURS)  # in columns and file names
# For reports. Of an episode without a delivery, the second half counts.
DEFINITIONS = (
    "the episode ends with a delivery",
    "without food, at least every fourth step leads onto a trail",
    "with food, at least every fourth step leads nearer to the queen",
    "none of these",
)
PAPER_WORLD = "the paper's"  # its numbers and claims apply to this world only


class Variant(NamedTuple):
    """A learner with values of its hyperparameters; the paper calls this an algorithm."""

    learner: str
    hyperparameters: str = ""  # for example "planning_steps=3"; several are separated by spaces

    @property
    def short(self) -> list[str]:
        """Its hyperparameters by initials, for example "p3", or in full if two initials agree."""
        pairs = self.hyperparameters.split()
        short = {pair[0]: pair[0] + pair.partition("=")[2] for pair in pairs}
        return list(short.values()) if len(short) == len(pairs) else pairs

    @property
    def label(self) -> str:
        """Its name for readers, for example "Dyna-Q (p3)"."""
        name = label(self.learner)
        return f"{name} ({', '.join(self.short)})" if self.short else name


class GridPoint(NamedTuple):
    """A point of the paper's grid of four hyperparameters."""

    learning_rate: float
    discount: float
    epsilon: float
    epsilon_decay: float

    @property
    def label(self) -> str:
        """Its name as in the paper's table 2, for example "0.01 / 0.9 / 0.3 / 0.995"."""
        return " / ".join(f"{value:g}" for value in self)


class Row(NamedTuple):
    """One configuration of a comparison."""

    delivery: str
    variant: Variant
    point: GridPoint

    @classmethod
    def of(cls, task: Task, config: TrainingConfig) -> Row:
        """Return the row of a task and a training configuration."""
        own = " ".join(f"{name}={value:g}" for name, value in config.hyperparameters)
        numbers = (getattr(config, name) for name in GridPoint._fields)
        return cls(task.delivery, Variant(config.learner, own), GridPoint(*numbers))

    def columns(self) -> dict:
        """Return the columns of a table that identify the configuration."""
        return {**self.variant._asdict(), **self.point._asdict(), "delivery": self.delivery}


@dataclass(frozen=True, eq=False, kw_only=True)
class Comparison:
    """The results of all configurations, each trained and evaluated with all seeds.

    Attributes:
        measures: `LONE` of each run by name, float64 (rows, seeds).
        behaviours: Behaviours of the final policies, indices into `BEHAVIOURS`, int (rows, seeds).
        policy_returns: Returns of the episodes that show the behaviours, integer (rows, seeds).
        episodes, rollouts, max_steps: Those of a `RunPoint`.
        curves: Learning curves of the learners, see `figures.curves_of`.
        task: The rules of all rows, except the delivery.
    """

    rows: tuple[Row, ...]
    seeds: tuple[int, ...]
    measures: Mapping[str, np.ndarray]
    behaviours: np.ndarray
    policy_returns: np.ndarray
    episodes: int
    rollouts: int
    max_steps: int
    curves: Mapping[str, np.ndarray] = field(default_factory=dict)
    task: Task = field(default_factory=Task)
    world: str = PAPER_WORLD

    @property
    def in_paper_world(self) -> bool:
        """Whether the world is the paper's."""
        return self.world == PAPER_WORLD

    @property
    def delivery_settings(self) -> tuple[str, ...]:
        """The delivery settings, in order of appearance."""
        return tuple(dict.fromkeys(row.delivery for row in self.rows))

    @property
    def variants(self) -> tuple[Variant, ...]:
        """The learners with their hyperparameters, in order of appearance."""
        return tuple(dict.fromkeys(row.variant for row in self.rows))

    @property
    def learners(self) -> list[tuple[str, Variant]]:
        """All pairs of a delivery setting and a learner that have rows."""
        pairs = product(self.delivery_settings, self.variants)
        return [pair for pair in pairs if self.positions(*pair)]

    def position(self, delivery: str, variant: Variant, point: GridPoint) -> int | None:
        """Return the index of a configuration's row, None if it is not in the comparison."""
        row = Row(delivery, variant, point)
        return self.rows.index(row) if row in self.rows else None

    def positions(self, delivery: str, variant: Variant) -> list[int]:
        """Return the indices of all rows of a learner in one delivery setting, in their order."""
        return [n for n, row in enumerate(self.rows) if row[:2] == (delivery, variant)]


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


def counts(behaviours: np.ndarray) -> dict[int, int]:
    """Return the number of runs by behaviour, in the order of `BEHAVIOURS`, without zeros."""
    number_of = np.bincount(np.ravel(behaviours), minlength=len(BEHAVIOURS)).tolist()
    return {code: number for code, number in enumerate(number_of) if number}
