"""The colony: many ants in one world, or in each of many worlds."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from taichi_ants import arguments
from taichi_ants.engines.colony.episodes import ColonyEpisodes
from taichi_ants.engines.colony.layout import WorldRow
from taichi_ants.engines.colony.state import ALL, ColonyState, Which, checked_worlds
from taichi_ants.engines.colony.stepping import Stepper
from taichi_ants.engines.colony.timetable import Timetable
from taichi_ants.errors import AntsError, as_array, checked_whole, count, entries_of, shown
from taichi_ants.measures.measure import Measure
from taichi_ants.measures.series import Recorder, stops
from taichi_ants.protocol import ProtocolEvent
from taichi_ants.task.constants import MAX_STEPS, N_ACTIONS
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]


class Colony(ColonyState):
    """Colonies of ants, one in each of W worlds, that act and learn tick by tick.

    A colony depends only on its world, configuration and seed, not on the other worlds, the number
    of threads or the schedule.

    Args:
        world: One world for all seeds, or one per seed, all with the same ranges.
        task: The rules; None for those of the paper. Colonies that learn use its evaporation in
            training, others its evaporation in evaluation.
        training: The learner and its settings. None, with sharing "frozen": there are no action
            values; you give the actions with `act`, or ants choose by a task whose rule of choice
            is "deneubourg".
        seeds: One seed for each of the W worlds.
        ants: Number of ants at the start of an episode, 1 to 2**24. The ants that the world lists
            are the first.
        capacity: Largest number of living ants. None: `ants` without births, else 2 * `ants` + 64.
        start: Start cells of ants that the world does not list: "nest" for the free cells nearest
            to the queen, "spread" for any free cells. The seed decides which, and the headings.
        ends_at_delivery: Whether an episode ends at its first delivery, as when an ant trains
            alone. Requires one ant and no births.
        sharing: "shared" for one table per world, for learners with a TD error; "independent" for
            one table and memory per slot; "frozen" for no learning.
        q_values: Initial action values, float (n_states, 5), (W, n_states, 5) or, if sharing is
            "independent", (W, slots, n_states, 5). None: the initial value of `training`. Required
            for sharing "frozen" with a `training`.
        threads, arch: As in `train`.
        schedule: "by_world" distributes worlds to threads, "by_chunk" groups of ants; None chooses
            by size. Both give the same numbers, with ants stored in different orders.

    Raises:
        AntsError: An argument is not allowed, the learner does not work in a colony or with a
            shared table, or a world has too few free cells for the ants.
    """

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
        """Reset worlds to the start of an episode, and let their ants observe.

        Tables, memories and random streams stay.
        """
        self.ready[which] = False
        self.count_deliveries(which)
        self.set_learning_rate(self.learning_rate)
        self.reset(which)
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
            checked = [seed for one in listed for seed in arguments.checked_seeds(one)]
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

    def run(
        self,
        episodes: int,
        ticks: int,
        progress: Progress | None = None,
        worlds: Sequence[World | Sequence[World]] | None = None,
        *,
        measures: str | Measure | Sequence[str | Measure] = (),
        every: int | None = None,
        protocol: ProtocolEvent | Sequence[ProtocolEvent] = (),
    ) -> ColonyEpisodes:
        """Return the results of whole episodes with a fixed number of ticks.

        Args:
            progress: A function that is called with the share of the work done, 0 to 1.
            worlds: The `world` of `begin_episode` for each episode; None keeps the present worlds.
            measures: Names of registered measures, or `Measure` objects, to read at the end of each
                episode; see `taichi_ants.measures`. They do not change the colony.
            every: Read the measures also every n ticks, before the events of the tick.
            protocol: Events with interventions, see `taichi_ants.protocol`. They happen in each
                episode, which begins without the changes of the one before.
        """
        episodes = checked_whole("episodes", episodes)
        ticks = checked_whole("ticks", ticks, most=MAX_STEPS)
        places = self._checked_places(worlds, episodes)
        recorder, timetable = Recorder(measures, every), Timetable(self, protocol, ticks)
        outcomes = []
        for episode in range(episodes):
            self.begin_episode(ticks, places[episode])
            recorder.begin(episode)
            with timetable:
                for stop in stops(ticks, recorder.every):
                    for _ in timetable.pieces(self._stepper, stop - self.ticks):
                        if progress is not None:
                            progress((episode + self.ticks / ticks) / episodes)
                        if not self.running.any():
                            break
                    recorder.read(self)
                    if not self.running.any():
                        break
                outcomes.append(self.outcome())
            self.end_episode()
        counts: dict[str, Any] = {
            name: np.concatenate([getattr(outcome, name) for outcome in outcomes])
            for name, array in vars(outcomes[0]).items()
            if isinstance(array, np.ndarray)
        }
        return ColonyEpisodes(**counts, seeds=self.seeds, series=recorder.series())

    def _checked_places(self, worlds: Any, episodes: int) -> Sequence[Any]:
        """Return the worlds of each episode after checks; None to keep the present ones."""
        if worlds is None:
            return [None] * episodes
        if not isinstance(worlds, (list, tuple)) or len(worlds) != episodes:
            raise AntsError(
                f"worlds is {shown(worlds)}; give a list with an entry for each of the {episodes} "
                "episodes."
            )
        for place in worlds:
            several = checked_worlds(place, len(self.seeds), self.learns)
            for one, seed in dict.fromkeys(zip(several, self.seeds, strict=True)):
                one.start(seed, self.ants, self.start)  # raises an error if there is no room
        return worlds

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without Taichi's objects, so that copies and pickles work."""
        made = "_stepper", "model"
        return {name: value for name, value in vars(self).items() if name not in made}

    def __repr__(self) -> str:
        others = len(dict.fromkeys(self.worlds)) - 1
        more = f" and {others} more" if others else ""
        lines = [
            f"world: {self.worlds[0]}{more}",
            f"task: {self.task}",
            f"training: {self.training if self.has_training else None}",
            f"seeds: {shown(self.seeds)}",
            f"ants: {self.ants}, capacity: {self.capacity}, start: {self.start!r}",
            f"sharing: {self.sharing!r}, epsilon: {self.epsilon:.4g}",
        ]
        if self.episode >= 0:
            now = self.arrays["worlds"].sum(axis=1)
            lines.append(
                f"episode: {self.episode}, ticks: {self.ticks}, living: {now[WorldRow.LIVING]}, "
                f"deliveries: {now[WorldRow.DELIVERIES]}"
            )
        return "\n    ".join(["Colony(", *lines]) + "\n)"
