"""Sharing: the ants of a world learn into one table, each into its own, or not at all."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.learners.config import update_weights
from taichi_ants.reference.ants import Ant, Pair, Transition
from taichi_ants.reference.learners import DynaQ, ReferenceLearner
from taichi_ants.reference.random_stream import RandomStream

if TYPE_CHECKING:
    from taichi_ants.task import Caste

# Makes a learner from a table (n_states, 5), which it copies; None: the initial value.
Make = Callable[[np.ndarray | None], ReferenceLearner]

_ONE = 1 << 32  # TD errors are summed in units of 2**-32


class FrozenTable:
    """One table for all ants, which does not change.

    `tables` are the learners: one, or one for each slot. If `draws_next_action`, ants draw their
    next action at the end of a tick.
    """

    draws_next_action = False

    def __init__(self, make: Make, slots: int, q_values: np.ndarray | None) -> None:
        self.tables = [make(q_values)]

    def of(self, ant: Ant) -> ReferenceLearner:
        """Return the learner of an ant."""
        return self.tables[0]

    def draws_ahead(self, ant: Ant) -> bool:
        """Return whether an ant draws its next action at the end of a tick."""
        return self.draws_next_action

    def take(self, castes: Sequence[Caste], discount: float | None) -> None:
        """Take the numbers of castes."""

    def born(self, slot: int) -> None:
        """Note that an ant was born into a slot."""

    def set_learning_rate(self, learning_rate: float) -> None:
        """Set the learning rate."""
        for table in self.tables:
            table.learning_rate = np.float32(learning_rate)

    def learn(
        self, steps: Sequence[Transition], streams: Sequence[RandomStream], epsilon: float
    ) -> None:
        """Learn from all transitions of a tick, and set the `td_error` of each.

        `streams` are the random streams of the ants, from which learners draw.
        """


class SharedTable(FrozenTable):
    """One table into which all ants learn.

    All TD errors of a tick, or of a round of planning, use the table from before it. The n errors
    of a pair are rounded to multiples of 2**-32, so that their sum is exact. They move the value by
    1 - (1 - alpha)**n of their mean, as n successive updates towards one target would. A single
    error is not rounded.
    """

    def __init__(self, make: Make, slots: int, q_values: np.ndarray | None) -> None:
        super().__init__(make, slots, q_values)
        [self._common] = self.tables
        if not self._common.shares:
            raise AntsError(
                f"the ants cannot share the table of the learner {self._common.name!r}, because it "
                'has no TD error to sum over ants; choose sharing="independent".'
            )
        self.draws_next_action = self._common.draws_next_action
        self._slots = slots
        self.set_learning_rate(float(self._common.learning_rate))

    def set_learning_rate(self, learning_rate: float) -> None:
        super().set_learning_rate(learning_rate)
        self._weights = update_weights(learning_rate, self._slots)

    def learn(
        self, steps: Sequence[Transition], streams: Sequence[RandomStream], epsilon: float
    ) -> None:
        for step, error in zip(steps, self._update(steps, epsilon), strict=True):
            step.td_error = error
        if isinstance(self._common, DynaQ):
            # If several ants have the same pair, the model keeps that of the highest number.
            for step in sorted(steps, key=lambda step: (step.pair, step.number)):
                self._common.remember(step)
            for _ in range(int(self._common.settings["planning_steps"])):
                self._update([self._common.draw_seen(stream) for stream in streams], epsilon)

    def _update(self, steps: Sequence[Transition], epsilon: float) -> list[np.float32]:
        errors = [self._common.error(step, epsilon) for step in steps]
        errors_of: dict[Pair, list[np.float32]] = defaultdict(list)
        for step, error in zip(steps, errors, strict=True):
            errors_of[step.pair].append(error)
        for pair, of_pair in errors_of.items():
            mean = of_pair[0] if len(of_pair) == 1 else mean_error(of_pair)
            weight = self._weights[min(len(of_pair), len(self._weights) - 1)]
            self._common.update(pair, weight, mean)
        return errors


def mean_error(errors: Sequence[np.float32]) -> np.float32:
    """Return the mean of TD errors, each rounded to a multiple of 2**-32, rounded once at the end.

    The sum must fit into a signed 64-bit integer.
    """
    total = sum(int(np.floor(float(error) * _ONE + 0.5)) for error in errors)
    if not -(1 << 63) <= total < 1 << 63:
        raise AssertionError(f"the sum of {len(errors)} TD errors does not fit into 64 bits")
    return np.float32(float(total) / (float(len(errors)) * _ONE))


class IndependentTables(FrozenTable):
    """A table for each slot, into which its ant learns as if it were alone."""

    def __init__(self, make: Make, slots: int, q_values: np.ndarray | None) -> None:
        if q_values is None or q_values.ndim == 2:
            self.tables = [make(q_values) for _ in range(slots)]
        else:
            self.tables = [make(table) for table in q_values]
        self._make = make
        self.draws_next_action = self.tables[0].draws_next_action

    def of(self, ant: Ant) -> ReferenceLearner:
        return self.tables[ant.slot]

    def born(self, slot: int) -> None:
        learning_rate = self.tables[slot].learning_rate
        self.tables[slot] = self._make(None)  # the initial value, and no memory
        self.tables[slot].learning_rate = learning_rate

    def learn(
        self, steps: Sequence[Transition], streams: Sequence[RandomStream], epsilon: float
    ) -> None:
        for step, stream in zip(steps, streams, strict=True):
            step.td_error = self.tables[step.slot].learn(step, epsilon, stream)


class ByGroup(FrozenTable):
    """A shared or frozen table for each nest and caste; groups are castes in turn, nest by nest.

    `epsilons` and `learning_rates` are those of castes with numbers that do not follow the
    colony's, else None.
    """

    def __init__(self, groups: Sequence[FrozenTable], castes: Sequence[Caste]) -> None:
        self._groups = groups
        self._n_castes = max(1, len(castes))
        self.tables = [table for group in groups for table in group.tables]
        self.take(castes, None)

    def take(self, castes: Sequence[Caste], discount: float | None) -> None:
        """Take the numbers of castes, and the discount of those without one."""
        self._epsilons = [caste.epsilon for caste in castes] or [None]
        self._learning_rates = [caste.learning_rate for caste in castes] or [None]
        for number, table in enumerate(self.tables):
            own_discount = castes[number % self._n_castes].discount if castes else None
            if own_discount is not None or discount is not None:
                table.discount = np.float32(discount if own_discount is None else own_discount)
        for group, rate in zip(self._groups, self._by_group(self._learning_rates), strict=True):
            if rate is not None:
                group.set_learning_rate(rate)

    def _by_group(self, numbers: Sequence[float | None]) -> list[float | None]:
        return [*numbers] * (len(self._groups) // self._n_castes)

    def group(self, ant: Ant | Transition) -> int:
        """Return the number of the group of an ant."""
        return ant.nest * self._n_castes + ant.caste

    def of(self, ant: Ant) -> ReferenceLearner:
        return self.tables[self.group(ant)]

    def draws_ahead(self, ant: Ant) -> bool:
        return self._groups[self.group(ant)].draws_next_action

    def set_learning_rate(self, learning_rate: float) -> None:
        rates = self._by_group(self._learning_rates)
        for group, rate in zip(self._groups, rates, strict=True):
            group.set_learning_rate(learning_rate if rate is None else rate)

    def learn(
        self, steps: Sequence[Transition], streams: Sequence[RandomStream], epsilon: float
    ) -> None:
        epsilons = self._by_group(self._epsilons)
        for number, (group, own_epsilon) in enumerate(zip(self._groups, epsilons, strict=True)):
            ours = [i for i, step in enumerate(steps) if self.group(step) == number]
            rate = epsilon if own_epsilon is None else own_epsilon
            group.learn([steps[i] for i in ours], [streams[i] for i in ours], rate)


SHARING = {"shared": SharedTable, "independent": IndependentTables, "frozen": FrozenTable}
