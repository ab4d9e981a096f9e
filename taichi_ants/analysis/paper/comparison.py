"""What a sweep hands to the analysis: for every configuration and seed, what each episode gave.

Rows are configurations, the second axis is the seed, the third the episode (or the rollout of the
greedy evaluation). The seed is the unit of all statistics, and because one seed drives every
configuration with the same random numbers, differences of rows are taken seed by seed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taichi_ants.analysis.paper.measures import MEASURES, WINDOW
from taichi_ants.errors import AntsError
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task

# The order in which the delivery settings are reported; others follow in order of appearance.
DELIVERY_ORDER: tuple[str, ...] = ("continuing", "absorbing")

_NAMES = {
    "q_learning": "Q-learning",
    "sarsa": "SARSA",
    "expected_sarsa": "Expected SARSA",
    "dyna_q": "Dyna-Q",
}
# The name of the world in which the paper's figures and claims mean something.
PAPER_WORLD = "the paper's"

_PER_EPISODE = ("returns", "steps", "deliveries")
_WAYS = ("without", "with")
_PER_RUN = ("behaviours", "policy_returns")
_PER_ROLLOUT = ("greedy_returns", "greedy_steps", "greedy_deliveries")


class Variant(NamedTuple):
    """A learner together with its planning depth: what the paper calls an algorithm."""

    learner: str
    planning_steps: int = 0

    @property
    def label(self) -> str:
        """Its name for readers, for example "Dyna-Q (p3)"."""
        name = _NAMES.get(self.learner, self.learner)
        return f"{name} (p{self.planning_steps})" if self.planning_steps else name


class Hyperparameters(NamedTuple):
    """The four numbers of the paper's grid, in the order of its table 2."""

    learning_rate: float
    discount: float
    epsilon: float
    epsilon_decay: float

    @property
    def label(self) -> str:
        """As in the paper's table 2, for example "0.01 / 0.9 / 0.3 / 0.995"."""
        return " / ".join(f"{value:g}" for value in self)

    def key(self) -> tuple[str, ...]:
        """For look-ups; six digits, so that values that went through 32 bits are found too."""
        return tuple(f"{value:.6g}" for value in self)


@dataclass(frozen=True)
class Row:
    """One configuration of a comparison."""

    learner: str
    planning_steps: int
    learning_rate: float
    discount: float
    epsilon: float
    epsilon_decay: float
    delivery: str

    @classmethod
    def of(cls, task: Task, config: TrainingConfig) -> Row:
        """The row of a task and a training configuration."""
        return cls(
            config.learner,
            config.planning_steps,
            config.learning_rate,
            config.discount,
            config.epsilon,
            config.epsilon_decay,
            task.delivery,
        )

    @property
    def variant(self) -> Variant:
        return Variant(self.learner, self.planning_steps)

    @property
    def hyperparameters(self) -> Hyperparameters:
        return Hyperparameters(self.learning_rate, self.discount, self.epsilon, self.epsilon_decay)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Configurations times seeds, trained and evaluated.

    Attributes:
        rows: The configurations, each once.
        seeds: The seeds, at least one.
        returns: Sum of the rewards of each training episode, integer (rows, seeds, episodes).
        steps: Length of each training episode in steps, integer (rows, seeds, episodes).
        deliveries: Food given to the queen in each episode, integer (rows, seeds, episodes).
        greedy_returns: The same for the greedy rollouts after training, integer
            (rows, seeds, rollouts). There may be none (rollouts = 0).
        greedy_steps: Integer (rows, seeds, rollouts).
        greedy_deliveries: Integer (rows, seeds, rollouts).
        max_steps: Limit of an episode in steps.
        behaviours: What each final policy does, places in `behaviour.BEHAVIOURS`, integer
            (rows, seeds).
        policy_returns: What the ant earned in the episode that told so, integer (rows, seeds).
        train_evaporation: Whether trails evaporated in training, and in the episode of
            `behaviours`.
        greedy_evaporation: Whether they did in the greedy rollouts.
        world: Name of the world; only in `PAPER_WORLD` ours can be held against the paper.

    Raises:
        AntsError: The shapes do not fit together, or a configuration is listed twice.
    """

    rows: tuple[Row, ...]
    seeds: tuple[int, ...]
    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
    greedy_returns: np.ndarray
    greedy_steps: np.ndarray
    greedy_deliveries: np.ndarray
    max_steps: int
    behaviours: np.ndarray
    policy_returns: np.ndarray
    train_evaporation: bool = False
    greedy_evaporation: bool = True
    world: str = PAPER_WORLD
    _positions: dict = field(init=False, repr=False)
    _measured: dict = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        if not self.rows or not self.seeds:
            raise AntsError(
                f"A comparison has {len(self.rows)} configurations and {len(self.seeds)} seeds; "
                "it needs at least one of each."
            )
        self._check_shapes(_PER_EPISODE, smallest=1)
        self._check_shapes(_PER_ROLLOUT, smallest=0)
        runs = (len(self.rows), len(self.seeds))
        for name in _PER_RUN:
            if (shape := getattr(self, name).shape) != runs:
                raise AntsError(f"{name} has the shape {shape}; it must be {runs}.")
        positions = {
            (row.delivery, row.variant, row.hyperparameters.key()): number
            for number, row in enumerate(self.rows)
        }
        if len(positions) != len(self.rows):
            raise AntsError(
                f"{len(self.rows) - len(positions)} configurations of the comparison are listed "
                "more than once; list each one once."
            )
        object.__setattr__(self, "_positions", positions)

    def _check_shapes(self, names: tuple[str, ...], smallest: int) -> None:
        expected = (len(self.rows), len(self.seeds))
        shape = getattr(self, names[0]).shape
        for name in names:
            got = getattr(self, name).shape
            if got[:2] != expected or len(got) != 3 or got[2] < smallest or got != shape:
                raise AntsError(
                    f"{name} has the shape {got}; it must be {(*expected, 'n')} "
                    f"with n at least {smallest} and the same for {', '.join(names)}."
                )

    @property
    def in_paper_world(self) -> bool:
        """Whether the world is the paper's."""
        return self.world == PAPER_WORLD

    @property
    def episodes(self) -> int:
        """Training episodes of a run."""
        return self.returns.shape[2]

    @property
    def late(self) -> str:
        """The episodes that "last 50" measures speak of: "last 50", or "all 20" of a short run."""
        return f"last {WINDOW}" if self.episodes > WINDOW else f"all {self.episodes}"

    @property
    def rollouts(self) -> int:
        """Greedy rollouts of a run."""
        return self.greedy_returns.shape[2]

    @property
    def delivery_settings(self) -> tuple[str, ...]:
        """The delivery settings present, in the order in which they are reported."""
        present = dict.fromkeys(row.delivery for row in self.rows)
        known = [name for name in DELIVERY_ORDER if name in present]
        return (*known, *(name for name in present if name not in known))

    @property
    def variants(self) -> tuple[Variant, ...]:
        """The learners with their planning depths, in order of appearance."""
        return tuple(dict.fromkeys(row.variant for row in self.rows))

    @property
    def conditions(self) -> str:
        """Where trails evaporated, as a sentence for readers."""
        training, greedy = _WAYS[self.train_evaporation], _WAYS[self.greedy_evaporation]
        return f"Training {training} evaporation of trails, greedy evaluation {greedy} it."

    @property
    def as_trained(self) -> str:
        """Whether trails evaporated in the episodes of `behaviours`, in words."""
        return f"{_WAYS[self.train_evaporation]} evaporation, as in training"

    def position(
        self, delivery: str, variant: Variant, hyperparameters: Hyperparameters
    ) -> int | None:
        """The number of a configuration's row, None where it is not in the comparison."""
        return self._positions.get((delivery, variant, hyperparameters.key()))

    def positions(self, delivery: str, variant: Variant) -> list[int]:
        """The numbers of all rows of a learner in one delivery setting, in their order."""
        return [
            number
            for number, row in enumerate(self.rows)
            if row.delivery == delivery and row.variant == variant
        ]

    def measure(self, name: str) -> np.ndarray:
        """One number per run, float64 (rows, seeds); nan where there is too little data.

        Args:
            name: A key of `taichi_ants.analysis.paper.measures.MEASURES`.
        """
        if name not in self._measured:
            measure = MEASURES[name]
            if measure.lacks(self):
                values = np.full((len(self.rows), len(self.seeds)), np.nan)
            else:
                values = measure.compute(self)
            values.setflags(write=False)
            self._measured[name] = values
        return self._measured[name]
