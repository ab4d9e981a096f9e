"""Protocols: interventions at given ticks of an episode, or when a measure crosses a bound.

    colony.run(4, 1000, protocol=[At(500, remove_ants=0.5), Every(100, trail=0)])

An event has one or more interventions, each named as in `taichi_ants.interventions`. They are
applied in the order of the fields of `ProtocolEvent`. Events of the same tick are applied in the
order of the protocol.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Any

from taichi_ants import interventions as language
from taichi_ants import measures
from taichi_ants.errors import AntsError, entries_of, shown
from taichi_ants.interventions import Intervention, ShorthandSettings
from taichi_ants.settings import Setting
from taichi_ants.task.constants import MAX_STEPS

Tick = Annotated[int, Setting(unit="ticks of the episode", least=0, most=MAX_STEPS)]
Bound = Annotated[int | None, Setting(unit="ticks of the episode", least=0, most=MAX_STEPS)]
Interval = Annotated[int, Setting(unit="ticks", least=1, most=MAX_STEPS)]


@dataclass(frozen=True, kw_only=True)
class ProtocolEvent(ShorthandSettings):
    """The interventions of an event, in the order in which they are applied."""

    remove_ants: Annotated[language.RemoveAnts | None, Setting("ants to remove")] = None
    add_ants: Annotated[language.AddAnts | None, Setting("ants to add")] = None
    ants: Annotated[language.SetAnts | None, Setting("new number of ants")] = None
    clear: Annotated[language.Clear | None, Setting("cells to clear of rock and food")] = None
    move: Annotated[language.Move | None, Setting("rock, food or queen to move")] = None
    place: Annotated[language.Place | None, Setting("rock, food or queen to place")] = None
    trail: Annotated[language.SetTrail | None, Setting("trail to lay or to clear")] = None
    task: Annotated[language.SetTask | None, Setting("settings of the task to change")] = None
    epsilon: Annotated[language.SetEpsilon | None, Setting("new exploration rate")] = None
    learning_rate: Annotated[language.SetLearningRate | None, Setting("new learning rate")] = None

    def check(self) -> None:
        super().check()
        if not self.interventions:
            names = ", ".join(setting.name for setting in fields(ProtocolEvent))
            raise AntsError(f"`{self.path}` has no intervention; give one or more of {names}.")

    @property
    def interventions(self) -> tuple[Intervention, ...]:
        """The interventions, in the order in which they are applied."""
        interventions = (getattr(self, setting.name) for setting in fields(ProtocolEvent))
        return tuple(intervention for intervention in interventions if intervention is not None)

    def times(self, length: int) -> range:
        """Return the ticks of an episode at which the event can happen, after that many ticks.

        AntsError if there are none in an episode of `length` ticks.
        """
        raise NotImplementedError

    def _within(self, name: str, length: int) -> int:
        """Return the tick in a setting; AntsError unless it lies within the episode."""
        tick = getattr(self, name)
        if tick >= length:
            raise AntsError(
                f"`{self.path}.{name}` is {tick}, but episodes have {length} ticks; choose at most "
                f"{length - 1}."
            )
        return tick


@dataclass(frozen=True)
class At(ProtocolEvent, path="at"):
    """Interventions after a number of ticks of each episode.

    >>> len(At(500, remove_ants=0.5, epsilon=0.2).interventions)  # at tick 500
    2
    """

    tick: Annotated[Tick, Setting("time of the event")]

    def times(self, length: int) -> range:
        """Return the tick, of an episode of this length.

        >>> [*At(500, trail=0).times(1000)]
        [500]
        """
        return range(self._within("tick", length), self.tick + 1)


@dataclass(frozen=True)
class Every(ProtocolEvent, path="every"):
    """Interventions at regular ticks of each episode.

    >>> [*Every(100, trail=0).times(350)]  # clear the trail at these ticks
    [100, 200, 300]
    """

    ticks: Annotated[Interval, Setting("time between two events")]
    start: Annotated[Bound, Setting("time of the first event; `ticks` if left out")] = None
    stop: Annotated[Bound, Setting("time of the last possible event")] = None

    def check(self) -> None:
        super().check()
        if self.start is None:
            object.__setattr__(self, "start", self.ticks)
        if self.stop is not None and self.stop < self.start:  # type: ignore[operator]
            raise AntsError(
                f"`every.stop` is {self.stop}, before the first event; choose at least "
                f"{self.start}."
            )

    def times(self, length: int) -> range:
        """Return the ticks, of an episode of this length."""
        last = length - 1 if self.stop is None else min(self.stop, length - 1)
        return range(self._within("start", length), last + 1, self.ticks)


@dataclass(frozen=True)
class When(ProtocolEvent, path="when"):
    """Interventions when a measure of a world is above or below a bound.

    Each world is checked for itself, every `interval` ticks. While the measure has no value, the
    event does not happen. With `once`, the event happens at most once in an episode, else at each
    check for which the condition holds.

    >>> When("deliveries", above=20, ants=10).holds(21)
    True
    """

    measure: Annotated[str, Setting("name of a registered measure")]
    above: Annotated[float | None, Setting("bound that the measure exceeds")] = None
    below: Annotated[float | None, Setting("bound that the measure is less than")] = None
    interval: Annotated[Interval, Setting("time between two checks")] = 10
    once: Annotated[bool, Setting("let the event happen only once in an episode")] = True

    def check(self) -> None:
        super().check()
        measures.get(self.measure).check_state("`when.measure`")
        if (self.above is None) == (self.below is None):
            raise AntsError("`when` needs a bound; give either `above` or `below`.")

    def times(self, length: int) -> range:
        """Return the ticks of the checks, of an episode of this length.

        >>> [*When("deliveries", above=20, ants=10).times(30)]
        [10, 20]
        """
        self._within("interval", length)
        return range(self.interval, length, self.interval)

    def holds(self, value: float) -> bool:
        """Return whether the condition holds for a value of the measure."""
        if self.above is not None:
            return value > self.above
        return self.below is not None and value < self.below


EVENTS: dict[str, type[ProtocolEvent]] = {cls.path: cls for cls in (At, Every, When)}


def checked_protocol(protocol: Any) -> tuple[ProtocolEvent, ...]:
    """Return the events of a protocol; AntsError if one is not a `ProtocolEvent`."""
    events = [protocol] if isinstance(protocol, ProtocolEvent) else entries_of(protocol)
    if events is None or not all(isinstance(event, ProtocolEvent) for event in events):
        raise AntsError(f"protocol is {shown(protocol)}; it must be a list of At, Every and When.")
    return tuple(events)


def read(tables: Mapping[str, Sequence[Any]]) -> tuple[ProtocolEvent, ...]:
    """Return the events of lists of tables by the names in `EVENTS`; those of `at` come first.

    AntsError, which names the table by its number, from 1, if a setting is not allowed.
    """
    return tuple(
        _event(kind, table, number)
        for name, kind in EVENTS.items()
        for number, table in enumerate(tables.get(name, ()), start=1)
    )


def _event(kind: type[ProtocolEvent], table: Any, number: int) -> ProtocolEvent:
    try:
        return kind.from_dict(table)
    except AntsError as error:
        raise AntsError(f"in [[{kind.path}]] number {number}, {error}") from error
