"""The data of a comparison: measures of each configuration and seed, and learning curves.

The seed is the unit of all statistics, and because one seed drives every configuration with the
same random numbers, differences of rows are taken seed by seed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np

from taichi_ants.learners import TrainingConfig, label
from taichi_ants.task import Task

PAPER_WORLD = "the paper's"  # in which alone its figures and claims mean something


class Variant(NamedTuple):
    """A learner with hyperparameters of its own: what the paper calls an algorithm."""

    learner: str
    hyperparameters: str = ""  # as "planning_steps=3"; several are separated by blanks

    @property
    def short(self) -> list[str]:
        """Its hyperparameters by their first letters, as "p3"; in full where these are alike."""
        pairs = self.hyperparameters.split()
        short = {pair[0]: pair[0] + pair.partition("=")[2] for pair in pairs}
        return list(short.values()) if len(short) == len(pairs) else pairs

    @property
    def label(self) -> str:
        """Its name for readers, for example "Dyna-Q (p3)"."""
        name = label(self.learner)
        return f"{name} ({', '.join(self.short)})" if self.short else name


class GridPoint(NamedTuple):
    """The four numbers of the paper's grid."""

    learning_rate: float
    discount: float
    epsilon: float
    epsilon_decay: float

    @property
    def label(self) -> str:
        """As in its table 2, for example "0.01 / 0.9 / 0.3 / 0.995"."""
        return " / ".join(f"{value:g}" for value in self)


class Row(NamedTuple):
    """One configuration of a comparison."""

    delivery: str
    variant: Variant
    point: GridPoint

    @classmethod
    def of(cls, task: Task, config: TrainingConfig) -> Row:
        """The row of a task and a training configuration."""
        own = " ".join(f"{name}={value:g}" for name, value in config.hyperparameters)
        numbers = (getattr(config, name) for name in GridPoint._fields)
        return cls(task.delivery, Variant(config.learner, own), GridPoint(*numbers))

    def columns(self) -> dict:
        """The columns of a table that name the configuration."""
        return {**self.variant._asdict(), **self.point._asdict(), "delivery": self.delivery}


@dataclass(frozen=True, eq=False, kw_only=True)
class Comparison:
    """Configurations times seeds, trained and evaluated.

    Attributes:
        measures: `MEASURES` of each run by name, float64 (rows, seeds).
        behaviours: What each final policy does, places in `BEHAVIOURS`, integer (rows, seeds).
        policy_returns: Returns of the episodes that told the behaviours, integer (rows, seeds).
        episodes, rollouts, max_steps: As of a `RunPoint`.
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
        """Each delivery setting with each learner in it."""
        pairs = product(self.delivery_settings, self.variants)
        return [pair for pair in pairs if self.positions(*pair)]

    def position(self, delivery: str, variant: Variant, point: GridPoint) -> int | None:
        """The number of a configuration's row, None where it is not in the comparison."""
        row = Row(delivery, variant, point)
        return self.rows.index(row) if row in self.rows else None

    def positions(self, delivery: str, variant: Variant) -> list[int]:
        """The numbers of all rows of a learner in one delivery setting, in their order."""
        pairs = [row[:2] for row in self.rows]
        return [number for number, pair in enumerate(pairs) if pair == (delivery, variant)]
