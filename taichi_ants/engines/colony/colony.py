"""The colony: many ants in one world, in many worlds at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from taichi_ants import checks
from taichi_ants.engines.colony.layout import WorldRow
from taichi_ants.engines.colony.state import ColonyEpisodes, ColonyState, checked_worlds
from taichi_ants.engines.colony.stepping import Stepper
from taichi_ants.errors import AntsError, array_of, checked_whole, entries_of, shown
from taichi_ants.task.constants import ACTION_NAMES, MAX_STEPS, N_ACTIONS
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]


class Colony(ColonyState):
    """Colonies of ants, one in each of W worlds, that act and learn in lockstep.

    A colony depends on its world, its configurations and its seed alone: not on the other worlds,
    the number of threads or the schedule.

    Args:
        world: One world for all seeds, or one for each, of the same ranges.
        task: The rules of the game; None is the paper's. Colonies that learn have its evaporation
            in training, others that in evaluation.
        training: The learner and its settings. None, with sharing "frozen": ants do what `act` is
            given, and there are no action values.
        seeds: One seed for each of the W worlds.
        ants: How many start each episode, 1 to 2**24: the listed ants of the World first.
        capacity: How many ants can live at once. None: `ants` if none are born, else 2 * `ants` +
            64.
        start: Where ants start that the World does not list: "nest", on the free cells nearest to
            the queen; "spread", on free cells anywhere. The seed decides which, and the headings.
        ends_at_delivery: Whether an episode ends at its first delivery, as when an ant trains
            alone. Only for one ant, without births.
        sharing: "shared": one table for all ants of a world, for learners with a TD error.
            "independent": one, and a memory of the learner, for each slot. "frozen": nobody learns.
        q_values: Action values to start from, float (n_states, 5) or (W, n_states, 5); None: zeros,
            but if nobody learns they must be given, unless `training` is None. If tables are not
            shared, (W, slots, n_states, 5) too.
        threads, arch: As in `train`.
        schedule: "by_world" hands worlds to threads, "by_chunk" groups of ants; None chooses by
            size. Both give the same numbers; by chunk, ants are stored in another order.

    Raises:
        AntsError: An argument is not allowed; the learner needs what a colony, or a shared table,
            does not have; or a world has too few free cells for the ants.
    """

    @cached_property
    def _stepper(self) -> Stepper:
        return Stepper()

    def begin_episode(
        self, length: int | None = None, world: World | Sequence[World] | None = None
    ) -> None:
        """Set worlds and ants to their start; the ants look around.

        Args:
            length: How many ticks there will be, for learners that need to know which tick is the
                last.
            world: As of the class: where the colonies live from now on. None: where they are.

        Raises:
            AntsError: A world is not allowed.
        """
        others = None if world is None else checked_worlds(world, len(self.seeds), self.learns)
        self.length = 0 if length is None else checked_whole("length", length, most=MAX_STEPS)
        if others is not None:
            self.delivered += self.deliveries
            self.lay_out(others)
        self.ticks = 0
        self.begin()
        self._stepper.launch(self, "begin_phases")

    def begin_some(self, which: np.ndarray, seeds: Sequence[int] | None = None) -> None:
        """Let some worlds, bool (W,), begin their next episode, while the others go on with theirs.

        For these it is as `end_episode` and `begin_episode`; epsilon and the learning rate stay.
        With `seeds`, one for each of these worlds, they begin a new life, as in a new `Colony`;
        tables and memories of learners go on. Such seeds may repeat, but then `save` refuses the
        colony.

        Raises:
            AntsError: There are other numbers of worlds or seeds, or a seed is not allowed.
        """
        which = array_of("which", which)
        if which.dtype != bool or which.shape != (len(self.seeds),):
            raise AntsError(f"which is {shown(which)}; give a bool for each of the worlds.")
        if seeds is None:
            self.keep_streams(which)
        else:
            listed = entries_of(seeds)
            if listed is None:
                raise AntsError(f"seeds is {shown(seeds)}; give a seed for each of these worlds.")
            checked = [seed for one in listed for seed in checks.checked_seeds(one)]
            if len(checked) != np.count_nonzero(which):
                n = np.count_nonzero(which)
                raise AntsError(f"there are {len(checked)} seeds for {n} worlds.")
            self.reseed(which, checked)
        self.begin(which)
        self._stepper.launch(self, "begin_phases")

    def observe(self) -> None:
        """Let the ants see what interventions have changed since the last tick."""
        self.check_begun()
        self._stepper.launch(self, "intervention_phases")

    def tick(self, n: int = 1) -> None:
        """Let n ticks pass; worlds whose episode has ended stand still."""
        self.check_begun()
        if self.is_given_actions:
            raise AntsError(
                "training is None, so nobody chooses; give the actions of each tick to act."
            )
        for _ in self._stepper.pieces(self, checked_whole("n", n)):
            pass

    def act(self, actions: np.ndarray) -> None:
        """Let one tick pass in which each ant does what is given; for colonies without training.

        Actions are whole numbers 0 to 4 (W, capacity): left, forward, right, pick up, give; those
        of vacant slots, and of worlds whose episode has ended, are ignored. AntsError if no episode
        has begun, the colony has a training, or an action is not allowed.
        """
        self.check_begun()
        if not self.is_given_actions:
            raise AntsError(
                "this colony has a training by which ants choose; call tick, or make it with "
                'training=None and sharing="frozen".'
            )
        given, shape = array_of("actions", actions), (len(self.seeds), self.capacity)
        if given.dtype.kind not in "iu" or given.shape != shape:
            raise AntsError(
                f"actions is {shown(given)}; give whole numbers of shape {shape}, one a slot."
            )
        if given.min() < 0 or given.max() >= N_ACTIONS:
            given = np.where(self.living, given, 0)
            wrong = given[(given < 0) | (given >= N_ACTIONS)]
            if len(wrong):
                raise AntsError(
                    f"an action is {wrong[0]}; it must lie between 0 and {N_ACTIONS - 1}: "
                    f"{', '.join(ACTION_NAMES)}."
                )
        self.actions[:] = given
        self._stepper.advance(self, 1)

    def end_episode(self) -> None:
        """Keep the streams of the ants that start an episode; epsilon and learning rate decay."""
        self.check_finite()
        self.keep_streams()
        self.epsilon = self.training.next_epsilon(self.epsilon)
        self.learning_rate = self.training.next_learning_rate(self.learning_rate)

    def run(
        self,
        episodes: int,
        ticks: int,
        progress: Progress | None = None,
        worlds: Sequence[World | Sequence[World]] | None = None,
    ) -> ColonyEpisodes:
        """Whole episodes of a fixed number of ticks.

        Args:
            progress: Called now and then with the share of the work that is done.
            worlds: Of each episode, see `begin_episode`; None: all take place where the colonies
                are.
        """
        episodes = checked_whole("episodes", episodes)
        ticks = checked_whole("ticks", ticks, most=MAX_STEPS)
        places = self._checked_places(worlds, episodes)
        checks.check_progress(progress)
        outcomes = []
        for episode in range(episodes):
            self.begin_episode(ticks, places[episode])
            for _ in self._stepper.pieces(self, ticks):
                if progress is not None:
                    progress((episode + self.ticks / ticks) / episodes)
                if not self.running.any():
                    break
            outcomes.append(self.outcome())
            self.end_episode()
        return ColonyEpisodes(
            **{name: np.stack([vars(one)[name][0] for one in outcomes])
               for name in vars(outcomes[0])}
        )  # fmt: skip

    def _checked_places(self, worlds: Any, episodes: int) -> Sequence[Any]:
        """The worlds of each episode, all of them allowed; None where the colonies stay."""
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
                one.start(seed, self.ants, self.start)  # whether there is room
        return worlds

    def __getstate__(self) -> dict[str, Any]:
        """Return all but what belongs to the Taichi that runs: copies and pickles go on alike."""
        return {name: value for name, value in vars(self).items() if name != "_stepper"}

    def __repr__(self) -> str:
        others = len(dict.fromkeys(self.worlds)) - 1
        more = f" and {others} more" if others else ""
        lines = [
            f"world: {self.worlds[0]}{more}",
            f"task: {self.task}",
            f"training: {None if self.is_given_actions else self.training}",
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
