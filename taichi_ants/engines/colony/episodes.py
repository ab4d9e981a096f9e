"""The results of a colony's episodes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from taichi_ants.files.tables import column
from taichi_ants.measures.series import Series
from taichi_ants.measures.tidy import Measured, Tidy
from taichi_ants.records import Record


@dataclass(frozen=True, eq=False, repr=False)
class ColonyEpisodes(Record, Tidy):
    """Results of episodes, arrays of shape (episodes, worlds).

    Attributes:
        returns: int64, the sum of the rewards of all ants.
        ticks: int32, the length of the episode.
        deliveries: int32, the number of deliveries.
        first_delivery: int32, ticks to the first delivery; -1 if there was none.
        moves: int64, the number of attempts to move.
        blocked: int64, the number of those that failed.
        carried: int64, the ticks with food of all delivered loads.
        births: int32, the number of ants that were born.
        deaths: int32, the number of ants that died.
        waiting_births: int32, the food that is not an ant yet at the end, because no cell next to
            its queen is free or `capacity` ants live.
        regrown: int32, the number of food items that grew back.
        living: int32, the number of ants at the end.
        deliveries_by_nest_and_kind: int32 (episodes, worlds, nests, kinds of food).
        caste_deliveries: int32 (episodes, worlds, castes); one column if there are no castes.
        seeds: The seed of each world.
        series: The values of the measures that you asked `Colony.run` for, else None.

    >>> colony.run(episodes=3, ticks=200).deliveries.shape  # episodes, worlds
    (3, 1)
    """

    returns: np.ndarray
    ticks: np.ndarray
    deliveries: np.ndarray
    first_delivery: np.ndarray
    moves: np.ndarray
    blocked: np.ndarray
    carried: np.ndarray
    births: np.ndarray
    waiting_births: np.ndarray
    deaths: np.ndarray
    regrown: np.ndarray
    living: np.ndarray
    deliveries_by_nest_and_kind: np.ndarray
    caste_deliveries: np.ndarray
    seeds: tuple[int, ...] = ()
    series: Series | None = field(default=None, repr=False)

    @property
    def nest_deliveries(self) -> np.ndarray:
        """Deliveries by nest, (episodes, worlds, nests)."""
        return self.deliveries_by_nest_and_kind.sum(axis=3, dtype=np.int32)

    @property
    def food_deliveries(self) -> np.ndarray:
        """Deliveries by kind of food, (episodes, worlds, kinds)."""
        return self.deliveries_by_nest_and_kind.sum(axis=2, dtype=np.int32)

    def of_world(self, w: int) -> dict[str, Any]:
        """Return the counts of a world in the first episode, as in `Snapshot.counts`."""
        counts: dict[str, Any] = {name: int(array[0, w]) for name, array in self.counts().items()}
        for name in ("nest_deliveries", "food_deliveries", "caste_deliveries"):
            counts[name] = getattr(self, name)[0, w]
        return counts

    def counts(self) -> dict[str, np.ndarray]:
        """Return the arrays of all counts of worlds by name.

        >>> sorted(colony.run(1, 100).counts())[:3]
        ['births', 'blocked', 'carried']
        """
        arrays = (item for item in vars(self).items() if isinstance(item[1], np.ndarray))
        return {name: array for name, array in arrays if array.ndim == 2}

    def measured(self) -> Measured:
        """Return the values of the measures, or all counts if `Colony.run` was asked for none."""
        shape, series = self.returns.shape, self.series
        if series is None:
            episodes, worlds = (numbers.ravel().astype(np.int32) for numbers in np.indices(shape))
            ticks = self.ticks.ravel()
            values = {name: array.ravel() for name, array in self.counts().items()}
            plotted: tuple[str, ...] = ("deliveries",)
        else:
            worlds, episodes, ticks = series.worlds, series.episodes, series.ticks
            values, plotted = dict(series.values), tuple(series.values)
        seeds = column(self.seeds)[worlds]
        index = {"world": worlds, "seed": seeds, "episode": episodes, "tick": ticks}
        return Measured(
            index=index,
            values=values,
            of_seed=worlds,
            of_group=np.zeros(len(worlds), np.int32),
            seeds=self.seeds,
            plotted=plotted,
            units={} if series is None else dict(series.units),
        )
