"""The colony tick by tick: the start and end of episodes, and what happens between."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from taichi_ants.arguments import checked_seeds
from taichi_ants.engines.colony.layout import WorldRow
from taichi_ants.engines.colony.state import ALL, ColonyState, Which, checked_worlds
from taichi_ants.engines.colony.stepping import Stepper
from taichi_ants.errors import AntsError, as_array, checked_whole, count, entries_of, shown
from taichi_ants.task.constants import MAX_STEPS, N_ACTIONS
from taichi_ants.worlds.world import World


class TickingColony(ColonyState):
    """A colony whose ants observe, act and learn; `Colony` adds runs of whole episodes."""

    @cached_property
    def _stepper(self) -> Stepper:
        return Stepper()

    def begin_episode(
        self, length: int | None = None, world: World | Sequence[World] | None = None
    ) -> None:
        """Reset worlds and ants to the start of an episode, and let the ants observe.

        Args:
            length: Number of ticks, for learners that update at the last tick; None if unknown.
            world: The new world or worlds, as for `Colony`; None keeps the present ones.

        Raises:
            AntsError: A world is not allowed.
        """
        others = None if world is None else checked_worlds(world, len(self.seeds), self.learns)
        length = 0 if length is None else checked_whole("length", length, most=MAX_STEPS)
        if others is not None:
            fresh = copy.copy(self)  # the worlds may have too little room
            fresh.arrays = {**self.arrays}
            fresh.lay_out(others)
        self.ready[:] = False  # also after Ctrl-C before the end
        if others is not None:
            self.count_deliveries()
            vars(self).update(vars(fresh))
        self.length, self.ticks = length, 0
        self._start()

    def _start(self, which: Which = ALL) -> None:
        """Reset some worlds, and let their ants observe."""
        self.ready[which] = False
        self.begin(which)
        self._stepper.launch(self, "begin")
        self.ready[which] = True

    def reset_worlds(self, which: np.ndarray, seeds: Sequence[int] | None = None) -> None:
        """Start the next episode of some worlds, bool (W,), while the others continue.

        For these worlds it does the same as `end_episode` and `begin_episode`, but does not change
        epsilon and the learning rate. With `seeds`, one for each of these worlds, they restart as
        in a new `Colony`, except that tables and memories of learners are kept. Seeds may repeat,
        but then `save` raises an error.

        Raises:
            AntsError: The number of worlds or seeds is wrong, or a seed is not allowed.
        """
        which = as_array("which", which, "b", (len(self.seeds),))
        if seeds is None:
            self.keep_streams(which)
        else:
            listed, n = entries_of(seeds) or [], int(np.count_nonzero(which))
            checked = [seed for one in listed for seed in checked_seeds(one)]
            if len(checked) != n:
                raise AntsError(f"seeds is {shown(seeds)}; give a list of {count(n, 'seed')}.")
            self.ready[which] = False
            self.reseed(which, checked)
        self._start(which)

    def observe(self, worlds: Sequence[int] | None = None) -> None:
        """Let the ants of some or all worlds observe again, after interventions in these worlds."""
        if self.episode < 0:
            self.check_begun()
        row = self.arrays["worlds"][WorldRow.RUNNING]
        running = row.copy()
        if worlds is not None:
            row[np.setdiff1d(np.arange(len(row)), worlds)] = 0  # ants that misread draw numbers
        try:
            self._stepper.launch(self, "see_interventions")
        finally:
            row[:] = running

    def tick(self, n: int = 1) -> None:
        """Advance by n ticks, except worlds whose episode has ended."""
        self.check_begun()
        if self.is_given_actions:
            raise AntsError(
                "training is None, so ants do not choose actions; call act with the actions of "
                "each tick instead."
            )
        for _ in self._stepper.pieces(self, checked_whole("n", n)):
            pass

    def act(self, actions: np.ndarray) -> None:
        """Advance by one tick in which ants take given actions; for colonies without a training.

        Actions are whole numbers 0 to 4 (W, capacity): left, forward, right, pick up, give. Those
        of vacant slots and of worlds whose episode has ended are ignored. AntsError if no episode
        has started, the colony has a training, or an action is not allowed.
        """
        self.check_begun()
        if not self.is_given_actions:
            raise AntsError(
                "the ants of this colony choose their own actions; call tick instead, or make a "
                'colony with training=None and sharing="frozen".'
            )
        shape, most = (len(self.seeds), self.capacity), N_ACTIONS - 1
        given = as_array("actions", actions, "iu", shape)
        if given.min() < 0 or given.max() > most:
            given = as_array("actions", np.where(self.living, given, 0), "iu", shape, 0, most)
        self.actions[:] = given
        self._stepper.advance(self, 1)

    def end_episode(self) -> None:
        """End the episode: save random streams for the next one, and decay epsilon and the rate."""
        self.check_finite()
        self.keep_streams()
        epsilon = self.training.next_epsilon(self.epsilon)
        learning_rate = self.training.next_learning_rate(self.learning_rate)
        self.epsilon, self.learning_rate = epsilon, learning_rate

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without Taichi's objects, so that copies and pickles work."""
        made = "_stepper", "model"
        return {name: value for name, value in vars(self).items() if name not in made}
