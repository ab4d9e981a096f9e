"""The colony: many ants in one world, or in each of many worlds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from taichi_ants.engines.colony.episodes import ColonyEpisodes
from taichi_ants.engines.colony.layout import WorldRow
from taichi_ants.engines.colony.stepping import TickingColony
from taichi_ants.engines.colony.timetable import Timetable
from taichi_ants.errors import AntsError, checked_whole, enough_memory, entries_of, shown
from taichi_ants.measures.measure import Measure
from taichi_ants.measures.series import SeriesRecorder, stops
from taichi_ants.protocol import ProtocolEvent
from taichi_ants.task.constants import MAX_STEPS
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]


class Colony(TickingColony):
    """Colonies of ants, one in each of W worlds, that act and learn tick by tick.

    A colony depends only on its world, configuration and seed, not on the other worlds, the number
    of threads or the schedule. Most of its properties are arrays with an entry for each world, some
    of them views that you may change. Those (W, capacity) have an entry for each slot, which is a
    place for an ant, and show the last ant in it. Those of features that the task lacks are 0.

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
            by size. "by_ant" is that of a GPU, which has no other: each ant, cell or state has its
            own thread, and the state is on the device while ticks run. All give the same numbers,
            with ants stored in different orders.

    With the schedule "by_ant", read attributes again after each `tick`: arrays that you read before
    have old values, and what you write into them is lost. Ctrl-C within `tick` ends the episode.

    Raises:
        AntsError: An argument is not allowed, the learner does not work in a colony or with a
            shared table, or a world has too few free cells for the ants.

    >>> colony.tick(200)
    >>> colony.ticks, colony.living.sum().item()
    (200, 16)
    """

    @enough_memory("so many episodes")
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
        """Return the results of whole episodes.

        Args:
            episodes: The number of episodes.
            ticks: The ticks of each episode.
            progress: A function that is called with the share of the work done, 0 to 1.
            worlds: The `world` of `begin_episode` for each episode; None keeps the present worlds.
            measures: Names of registered measures, or `Measure` objects, to read at the end of each
                episode; see `taichi_ants.measures`. They do not change the colony.
            every: Read the measures also every n ticks, before the events of the tick.
            protocol: Events with interventions, see `taichi_ants.protocol`. They happen in each
                episode, which begins without the changes of the one before.

        >>> episodes = colony.run(episodes=2, ticks=100, measures=["deliveries"], every=50)
        >>> episodes.deliveries.shape, len(episodes.series.ticks)
        ((2, 1), 4)
        """
        episodes = checked_whole("episodes", episodes)
        ticks = checked_whole("ticks", ticks, most=MAX_STEPS)
        places: Any = [None] * episodes if worlds is None else entries_of(worlds)
        if places is None or len(places) != episodes:
            raise AntsError(
                f"worlds is {shown(worlds)}; give a list with an entry for each of the {episodes} "
                "episodes."
            )
        for place in places if worlds is not None else ():
            pairs = zip(self._checked_worlds(place), self.seeds, strict=True)
            for world, seed in dict.fromkeys(pairs):
                world.start(seed, self.ants, self.start)  # raises an error if there is no room
        recorder, timetable = SeriesRecorder(measures, every), Timetable(self, protocol, ticks)
        outcomes = []
        for episode in range(episodes):
            self.begin_episode(ticks, places[episode])
            recorder.begin(episode)
            with timetable:
                for stop in stops(ticks, recorder.every):
                    for _ in timetable.pieces(TickingColony._pieces, stop - self.ticks):
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
