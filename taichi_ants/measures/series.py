"""The series of measures of the worlds of a colony, and the recorder that reads them."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_ants.errors import AntsError, checked_whole, expect
from taichi_ants.measures.measure import Measure, get
from taichi_ants.records import Record


@dataclass(frozen=True, eq=False, repr=False)
class Series(Record):
    """The values of measures in R rows, each for one world at one tick of an episode.

    Attributes:
        worlds: int32 (R,), the number of the world.
        episodes: int32 (R,), the number of the episode of `run`.
        ticks: int32 (R,), the ticks since the episode began.
        values: The values of each measure by name, float64 (R,). Measures with parts have a name
            for each, as "entropy.trail". A value is nan if the measure has none.
        units: The unit of each measure by name; "" if it has none.

    >>> series = colony.run(1, 200, measures=["deliveries"], every=100).series
    >>> series.ticks.tolist(), series.values["deliveries"].shape
    ([100, 200], (2,))
    """

    worlds: np.ndarray
    episodes: np.ndarray
    ticks: np.ndarray
    values: Mapping[str, np.ndarray]
    units: Mapping[str, str]

    def __len__(self) -> int:
        return len(self.ticks)

    def __repr__(self) -> str:
        return f"Series({len(self)} rows of {', '.join(self.values)})"


class SeriesRecorder:
    """A recorder that reads measures of a colony at fixed ticks of each episode.

    Args:
        measures: Names or `Measure` objects, or a single one.
        every: Ticks between two rows; None for one row at the end of each episode.

    Raises:
        AntsError: A measure does not exist, or `every` is not at least 1.
    """

    def __init__(self, measures: Any = (), every: int | None = None) -> None:
        expect("measures", measures, str, Measure, Iterable)
        listed = [measures] if isinstance(measures, (str, Measure)) else measures
        self.measures = list({measure.name: measure for measure in map(get, listed)}.values())
        for measure in self.measures:
            measure.check_state("measures")
        self.every = None if every is None else checked_whole("every", every)
        if self.every is not None and not self.measures:
            raise AntsError(f"every is {every}, but measures is empty; name at least one measure.")
        self._rows: list[tuple[int, int, int]] = []  # world, episode, tick
        self._values: list[dict[str, float]] = []  # of each row
        self._units: dict[str, str] = {}
        self.begin(0)

    def begin(self, episode: int) -> None:
        """Start a new episode, by its number in the run."""
        self._episode = episode
        self._read: dict[int, int] = {}  # the tick of the last row of each world

    def read(self, colony: Any) -> None:
        """Read measures of a `Colony`, except in worlds that did not change since the last row."""
        for world, tick in enumerate(colony.episode_ticks.tolist() if self.measures else ()):
            if self._read.get(world) == tick:  # its episode has ended
                continue
            self._read[world] = tick
            snapshot, values = colony.snapshot(world), dict[str, float]()
            named = (snapshot.fields, snapshot.of_ants)
            for array in (*vars(snapshot).values(), *(a for one in named for a in one.values())):
                if isinstance(array, np.ndarray):  # all measures of the row read it
                    array.setflags(write=False)
            for measure in self.measures:
                numbers = measure.read(snapshot)
                values |= numbers
                self._units |= dict.fromkeys(numbers, measure.unit)
            self._rows.append((world, self._episode, tick))
            self._values.append(values)

    def series(self) -> Series | None:
        """Return all rows so far; None without measures."""
        if not self.measures:
            return None
        values = {
            name: np.array([row.get(name, math.nan) for row in self._values])
            for name in self._units
        }
        worlds, episodes, ticks = np.array(self._rows, np.int32).reshape(-1, 3).T.copy()
        return Series(worlds, episodes, ticks, values, dict(self._units))


def stops(ticks: int, every: int | None) -> Iterator[int]:
    """Yield the ticks of the rows of an episode of this length, in which the last tick has one."""
    yield from range(every or ticks, ticks, every or ticks)
    yield ticks
