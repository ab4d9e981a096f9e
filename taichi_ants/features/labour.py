"""Division of labour: ants with response thresholds, which become foragers or idle.

The stimulus of a nest, f64, is 0 at the start of an episode. After the actions of a tick it becomes
max(0, stimulus - relief * deliveries) + demand. Ants respond to the stimulus at the start of a
tick. At a stimulus of 0, no idle ant starts foraging. Otherwise r = threshold / stimulus, and an
idle ant starts if the high word of its draw is below floor(2^32 / (1 + r^exponent)). All numbers
are f64, and r^exponent is `numbers.power`, or 0 if r is 0. A forager stops if the high word of its
draw is below floor(2^32 * stop_probability).

The threshold of an ant is f32. It comes from the ant's own stream of (seed, STREAM_TRAIT, number),
whose draws have the words `high` and `low`. Everything is computed in f64 and rounded at the end:

- "fixed": value, without a draw.
- "uniform": value + spread * (2 * u - 1), with u = (high + 0.5) / 2^32.
- "normal" and "lognormal": a = (high + 0.5) / 2^31 - 1, b = (low + 0.5) / 2^31 - 1 and q = a * a +
  b * b. If q >= 1, the draw is repeated. z = a * power(-2 * logarithm(q) / q, 0.5). The threshold
  is value + spread * z, and everything is repeated if that is below 0; or, if "lognormal", value *
  exponential(spread * z).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Annotated, Any, ClassVar, Literal, get_args

from taichi_ants.errors import is_flag
from taichi_ants.features.feature import ANT, NEST, Array, Feature, Mark, Task
from taichi_ants.grid.constants import N_HEADINGS, STREAM_TRAIT
from taichi_ants.kernel_functions import bits, numbers, ti
from taichi_ants.settings import Setting, Settings

LabourRule = Literal["none", "thresholds"]
Stimulus = Annotated[float | None, Setting(least=0, most=1e6)]
_UNIT = "units of stimulus"
_DIVIDES = Setting(only=("rule", "thresholds"))
Distribution = Literal["none", "fixed", "uniform", "normal", "lognormal"]
DISTRIBUTIONS: tuple[str, ...] = get_args(Distribution)
_NONE, _FIXED, _UNIFORM, _NORMAL, _LOGNORMAL = range(len(DISTRIBUTIONS))


@dataclass(frozen=True)
class Labour(Settings, path="task.labour"):
    """The rule by which ants start and stop foraging; by default, they always forage.

    >>> Task(labour="thresholds", castes={"all": {"threshold": 5}}).labour.demand
    1.0
    """

    sentences: ClassVar[dict[str, str]] = {
        "rule=thresholds": "Each nest has a stimulus s, which is 0 at the start of an episode, "
        "rises by {demand} per tick, and falls by {relief} with each delivery, but not below 0. "
        "An idle ant with the threshold t starts to forage with the probability `s^{exponent} / "
        "(s^{exponent} + t^{exponent})` per tick. A forager without food next to its queen "
        "becomes idle with the probability {stop_probability} per tick (Bonabeau, Theraulaz and "
        "Deneubourg 1996).",
    }

    rule: Annotated[LabourRule, Setting("rule by which ants start and stop foraging")] = "none"
    demand: Annotated[
        Stimulus, Setting("rise of the stimulus per tick", unit=_UNIT, usual=1.0), _DIVIDES
    ] = None
    relief: Annotated[
        Stimulus, Setting("fall of the stimulus per delivery", unit=_UNIT, usual=10.0), _DIVIDES
    ] = None
    exponent: Annotated[
        float | None, Setting("exponent of the response", least=0, most=20, usual=2.0), _DIVIDES
    ] = None
    stop_probability: Annotated[
        float | None,
        Setting("probability per tick that a forager without food next to its queen becomes idle"),
        Setting(least=0, most=1, usual=0.2, only=("rule", "thresholds")),
    ] = None

    @classmethod
    def named(cls) -> Mapping[str, Labour]:
        """Return the named values: "none" and "thresholds".

        >>> sorted(task.Labour.named())
        ['none', 'thresholds']
        """
        return {rule: cls(rule) for rule in get_args(LabourRule)}


@dataclass(frozen=True)
class Threshold(Settings, path="task.castes.NAME.threshold"):
    """The distribution of the response thresholds of a caste, by default none.

    >>> task.Caste(threshold=5).threshold.distribution
    'fixed'
    """

    distribution: Annotated[
        Distribution, Setting("distribution of the thresholds; none: the ants always forage")
    ] = "none"
    value: Annotated[
        Stimulus,
        Setting("threshold, or the middle of its distribution", unit=_UNIT),
        Setting(usual=10.0, only=("distribution", *DISTRIBUTIONS[1:])),
    ] = None
    spread: Annotated[
        Stimulus,
        Setting("width of the distribution: half the range, or a standard deviation", usual=1.0),
        Setting(only=("distribution", *DISTRIBUTIONS[2:])),
    ] = None

    def _faults(self) -> Iterator[str]:
        value, spread = self.value or 0.0, self.spread or 0.0
        if self.distribution == "uniform" and spread > value:
            yield (
                f"`{self.path}.spread` is {spread}; it must be at most the value, {value}, because "
                "thresholds cannot be negative."
            )
        if self.distribution == "lognormal" and spread > 20:
            yield f"`{self.path}.spread` is {spread}; it must be between 0 and 20 for 'lognormal'."

    @classmethod
    def converted(cls, value: Any) -> Any:
        """Return the threshold that a number or the name of a distribution stands for."""
        is_number = isinstance(value, Real) and not is_flag(value)
        return cls("fixed", value) if is_number else super().converted(value)

    @classmethod
    def named(cls) -> Mapping[str, Threshold]:
        """Return the named values, one for each distribution.

        >>> task.Threshold.named()["uniform"].spread
        1.0
        """
        return {name: cls(name) for name in DISTRIBUTIONS}  # type: ignore[arg-type]

    @property
    def exists(self) -> bool:
        """Whether the ants have a threshold."""
        return self.distribution != "none"


def _faults(task: Task) -> Iterator[str]:
    divides = LABOUR.is_used(task)
    if divides and not any(caste.threshold.exists for caste in task.castes.values()):
        yield (
            f"`task.labour.rule` is {task.labour.rule!r}, but ants have no thresholds; add a caste "
            "with a `threshold` to `task.castes`."
        )
    for name, caste in task.castes.items():
        if caste.threshold.exists and not divides:
            yield (
                f"`task.castes.{name}.threshold` is {caste.threshold.distribution!r}; leave it out "
                "unless `task.labour.rule` is 'thresholds'."
            )


def _foraging(snapshot: Any) -> float:
    n = len(snapshot.ant_idle)
    return int((~snapshot.ant_idle).sum()) / n if n else float("nan")


LABOUR = Feature(
    Labour,
    arrays=(
        Array("idle", ANT, "i1", "idle", "bool", "idle", "yes, no", doc="Whether the ant is idle"),
        Array("threshold", ANT, "f4", "thresholds", "f4", "response threshold", unit=_UNIT),
        Array("stimulus", NEST, "f8", "stimuli", "f8", "stimulus", unit=_UNIT),
    ),
    numbers=("demand", "relief", "exponent"),
    of_castes={
        "stop_probability": lambda task, caste: (
            (task.labour.stop_probability or 0.0) * caste.threshold.exists
        ),
        "distribution": lambda task, caste: DISTRIBUTIONS.index(caste.threshold.distribution),
        "value": lambda task, caste: caste.threshold.value or 0.0,
        "spread": lambda task, caste: caste.threshold.spread or 0.0,
    },
    fixed=lambda caste: caste.threshold.exists,
    faults=_faults,
    example={
        "labour": "thresholds",
        "castes": {"ants": {"threshold": {"distribution": "uniform", "value": 5.0, "spread": 5.0}}},
    },
    marks=(Mark("idle", "idle"),),
    measures={"foraging": (_foraging, "", "share of the ants that forage, which are not idle")},
)


@LABOUR.at("born")
def draw_threshold(a):
    """Draw the threshold of an ant, which is idle if it has one."""
    distribution = ti.cast(a.distribution, ti.i32)
    value, spread = a.value, a.spread
    stream = bits.stream_of(a.seed, STREAM_TRAIT, ti.cast(a.number, ti.u64))
    drawn = value
    if distribution == _UNIFORM:
        stream = bits.advance(stream)
        u = (ti.cast(bits.high_word(bits.bits_of(stream)), ti.f64) + 0.5) / 4294967296.0
        drawn = value + spread * (2.0 * u - 1.0)
    if distribution >= _NORMAL:
        waits = True
        while waits:
            stream = bits.advance(stream)
            words = bits.bits_of(stream)
            x = (ti.cast(bits.high_word(words), ti.f64) + 0.5) / 2147483648.0 - 1.0
            y = (ti.cast(bits.low_word(words), ti.f64) + 0.5) / 2147483648.0 - 1.0
            q = x * x + y * y
            if q < 1.0:
                z = x * numbers.power(-2.0 * numbers.logarithm(q) / q, ti.f64(0.5))
                drawn = value + spread * z
                waits = drawn < 0.0
                if distribution == _LOGNORMAL:
                    drawn, waits = value * numbers.exponential(spread * z), False
    a.threshold = ti.cast(drawn, ti.f32)
    a.idle = ti.cast(distribution != _NONE, ti.i8)


@LABOUR.at("choose")
def stay_idle(a, stream):
    """Let an idle ant start foraging or not."""
    idle, after = ti.cast(a.idle, ti.i32), stream
    if idle == 1:
        after = bits.advance(stream)
        stimulus, chance = a.stimulus, ti.f64(0.0)
        if stimulus > 0.0:
            ratio, raised = ti.cast(a.threshold, ti.f64) / stimulus, ti.f64(0.0)
            if ratio > 0.0:
                raised = numbers.power(ratio, a.task.labour.exponent)
            chance = 1.0 / (1.0 + raised)
        if bits.high_word(bits.bits_of(after)) < ti.cast(chance * 4294967296.0, ti.u64):
            idle = 0
            a.idle = ti.i8(0)
    return idle, after


@LABOUR.at("rests")
def is_idle(a):
    return ti.cast(a.idle, ti.i32)


@LABOUR.at("delivered")
def relieve(nest, n):
    lowered = nest.stimulus - nest.task.labour.relief * ti.cast(n, ti.f64)
    nest.stimulus = ti.select(lowered > 0.0, lowered, ti.f64(0.0))


@LABOUR.at("acted")
def stop(a):
    """Let a forager without food next to its queen stop, by a draw."""
    chance, stops = a.stop_probability, False
    if chance > 0.0 and a.carries == 0:
        queen, is_at_nest = a.queen_cell, False
        for heading in ti.static(range(N_HEADINGS)):
            is_at_nest = is_at_nest | (a.cell + a.compass[heading + 1] == queen)
        if is_at_nest:
            a.stream = bits.advance(a.stream)
            word = bits.high_word(bits.bits_of(a.stream))
            stops = word < ti.cast(chance * 4294967296.0, ti.u64)
    return stops


@LABOUR.at("stopped")
def become_idle(a):
    a.idle = ti.i8(1)


@LABOUR.at("tick_ended")
def demand(nest):
    nest.stimulus = nest.stimulus + nest.task.labour.demand


@LABOUR.input("response threshold of the ant, 0 without one")
def threshold(a):
    return a.threshold


@LABOUR.input("stimulus of the ant's nest", by_deliveries=True)
def stimulus(a):
    return a.stimulus
