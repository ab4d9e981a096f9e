"""How the ants of a colony learn: into one table, each into its own, or not at all."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.learners.config import update_weights
from taichi_ants.reference.colony_records import Transition
from taichi_ants.reference.knowledge import Knowledge
from taichi_ants.reference.learning import learn_alone
from taichi_ants.reference.random_stream import RandomStream
from taichi_ants.reference.records import Pair
from taichi_ants.task.constants import N_ACTIONS, N_STATES

if TYPE_CHECKING:
    from taichi_ants.learners.config import TrainingConfig

_ONE = 1 << 32  # TD errors are summed in units of 2**-32


class FixedTable:
    """One table for all ants, that stays as it is.

    Attributes:
        draws_next_action: Whether a' is drawn at the end of a tick.
        tables: The one table.
    """

    draws_next_action = False

    def __init__(self, config: TrainingConfig, slots: int, q_values: np.ndarray | None) -> None:
        self._common = Knowledge(config, q_values)
        self.tables = [self._common]

    def values(self, slot: int, state: int) -> list[np.float32]:
        """Return the five action values of a state for the ant in a slot."""
        return self._common.rows[state]

    def born(self, slot: int) -> None:
        """Note that an ant was born into a slot."""

    def learn(
        self, transitions: Sequence[Transition], streams: Sequence[RandomStream], epsilon: float
    ) -> list[np.float32]:
        """Learn from the transitions of a tick.

        Args:
            transitions: Of all ants that acted, in any order.
            streams: Of each of these ants, for the draws of planning.
            epsilon: Of the policy.

        Returns:
            The TD error of each transition by the table as it was before; none where none learns.
        """
        return []


class SharedTable(FixedTable):
    """One table into which all ants learn.

    All errors of a tick, and of a round of planning, are errors by the table as it stood before.
    The n errors of a pair are rounded to multiples of 2**-32, so that their sum is exact, and move
    its value by 1 - (1 - alpha)**n of their mean: as far as n updates in turn go towards one
    target. One error alone counts as for a single ant, unrounded.
    """

    def __init__(self, config: TrainingConfig, slots: int, q_values: np.ndarray | None) -> None:
        super().__init__(config, slots, q_values)
        self.draws_next_action = self._common.learner.draws_next_action
        self._planning_steps = config.planning_steps
        self._weights = update_weights(config.learning_rate, slots)

    def learn(
        self, transitions: Sequence[Transition], streams: Sequence[RandomStream], epsilon: float
    ) -> list[np.float32]:
        """See `FixedTable.learn`."""
        errors = [
            self._common.td_error(step.pair, step.outcome, step.next_action, epsilon)
            for step in transitions
        ]
        self._update([step.pair for step in transitions], errors)
        if self._common.learner.plans:
            self._remember(transitions)
            for _ in range(self._planning_steps):
                self._plan(streams, epsilon)
        return errors

    def _remember(self, transitions: Sequence[Transition]) -> None:
        # Of several transitions of one pair the last one stored counts: the highest ant number's.
        for step in sorted(transitions, key=lambda step: (step.pair, step.number)):
            self._common.remember(step.pair, step.outcome)

    def _plan(self, streams: Sequence[RandomStream], epsilon: float) -> None:
        pairs = [self._common.draw_visited(stream) for stream in streams]
        errors = [
            self._common.td_error(pair, self._common.model[pair], None, epsilon) for pair in pairs
        ]
        self._update(pairs, errors)

    def _update(self, pairs: Sequence[Pair], errors: Sequence[np.float32]) -> None:
        errors_of: dict[Pair, list[np.float32]] = defaultdict(list)
        for pair, error in zip(pairs, errors, strict=True):
            errors_of[pair].append(error)
        for pair, several in errors_of.items():
            mean = several[0] if len(several) == 1 else mean_error(several)
            self._common.update(pair, self._weights[len(several)], mean)


def mean_error(errors: Sequence[np.float32]) -> np.float32:
    """Return the mean of TD errors, each rounded to a multiple of 2**-32, rounded once at the end.

    The sum must fit into a signed 64-bit integer.
    """
    total = sum(int(np.floor(float(error) * _ONE + 0.5)) for error in errors)
    if not -(1 << 63) <= total < 1 << 63:
        raise AssertionError(f"the sum of {len(errors)} TD errors does not fit into 64 bits")
    return np.float32(float(total) / (float(len(errors)) * _ONE))


class OwnTables:
    """A table for each slot, into which the ant in it learns as if alone.

    Attributes:
        draws_next_action: Whether a' is drawn at the end of a tick.
        tables: Of each slot.
    """

    def __init__(self, config: TrainingConfig, slots: int, q_values: np.ndarray | None) -> None:
        if q_values is None:
            q_values = np.zeros((N_STATES, N_ACTIONS), np.float32)
        each = np.broadcast_to(q_values, (slots, N_STATES, N_ACTIONS))
        self._config = config
        self.tables = [Knowledge(config, table) for table in each]
        self.draws_next_action = self.tables[0].learner.draws_next_action

    def values(self, slot: int, state: int) -> list[np.float32]:
        """See `FixedTable.values`."""
        return self.tables[slot].rows[state]

    def born(self, slot: int) -> None:
        """Let the ant that was born into a slot begin with zeros and without a model."""
        self.tables[slot] = Knowledge(self._config)

    def learn(
        self, transitions: Sequence[Transition], streams: Sequence[RandomStream], epsilon: float
    ) -> list[np.float32]:
        """See `FixedTable.learn`."""
        return [
            learn_alone(
                self.tables[step.slot],
                step.pair,
                step.outcome,
                step.next_action,
                epsilon,
                stream,
                self._config.planning_steps,
            )
            for step, stream in zip(transitions, streams, strict=True)
        ]


SHARING: dict[str, type[FixedTable | OwnTables]] = {
    "shared": SharedTable,
    "own": OwnTables,
    "fixed": FixedTable,
}
