"""Division of labour in a colony: thresholds, and ants that become foragers or idle.

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

import taichi as ti

from taichi_ants.engines.colony.columns import nest_of, of_caste, put, trait
from taichi_ants.engines.colony.layout import CasteRow, NestRow
from taichi_ants.grid.constants import N_HEADINGS, STREAM_TRAIT
from taichi_ants.task.caste import DISTRIBUTIONS
from taichi_ants.task.rules.numbers import exponential, logarithm, power
from taichi_ants.task.rules.random_bits import advance, bits_of, high_word, low_word, stream_of

_NONE, _FIXED, _UNIFORM, _NORMAL, _LOGNORMAL = range(len(DISTRIBUTIONS))
_DEMAND, _RELIEF, _EXPONENT = range(3)  # of `Labour.numbers`


@ti.func
def begin(c: ti.template(), v: ti.template(), w, ant):
    """Draw the threshold of an ant that begins, which is idle if it has one."""
    distribution = ti.cast(of_caste(c, ant, CasteRow.DISTRIBUTION), ti.i32)
    value, spread = of_caste(c, ant, CasteRow.VALUE), of_caste(c, ant, CasteRow.SPREAD)
    number = ti.cast(c.number[ant], ti.u64)
    stream = stream_of(c.seeds[w], STREAM_TRAIT, number)
    drawn = value
    if distribution == _UNIFORM:
        stream = advance(stream)
        u = (ti.cast(high_word(bits_of(stream)), ti.f64) + 0.5) / 4294967296.0
        drawn = value + spread * (2.0 * u - 1.0)
    if distribution >= _NORMAL:
        waits = True
        while waits:
            stream = advance(stream)
            bits = bits_of(stream)
            a = (ti.cast(high_word(bits), ti.f64) + 0.5) / 2147483648.0 - 1.0
            b = (ti.cast(low_word(bits), ti.f64) + 0.5) / 2147483648.0 - 1.0
            q = a * a + b * b
            if q < 1.0:
                z = a * power(-2.0 * logarithm(q) / q, ti.f64(0.5))
                drawn = value + spread * z
                waits = drawn < 0.0
                if distribution == _LOGNORMAL:
                    drawn, waits = value * exponential(spread * z), False
    c.threshold[ant] = ti.cast(drawn, ti.f32)
    put(c.idle, ant, ti.cast(distribution != _NONE, ti.i32))


@ti.func
def stays_idle(c: ti.template(), v: ti.template(), w, ant, random_state):
    """Let an idle ant start foraging or not; return 1 if it stays idle, else 0, and its stream."""
    idle, after = trait(c.idle, ant), random_state
    if idle == 1:
        after = advance(random_state)
        stimulus = c.stimulus[w * v.n_nests + nest_of(c, v, ant)]
        chance = ti.f64(0.0)
        if stimulus > 0.0:
            ratio, raised = ti.cast(c.threshold[ant], ti.f64) / stimulus, ti.f64(0.0)
            if ratio > 0.0:
                raised = power(ratio, c.labour[_EXPONENT])
            chance = 1.0 / (1.0 + raised)
        if high_word(bits_of(after)) < ti.cast(chance * 4294967296.0, ti.u64):
            idle = 0
            put(c.idle, ant, 0)
    return idle, after


@ti.func
def stops(c: ti.template(), v: ti.template(), w, ant):
    """Return whether a forager that has acted becomes idle, by a draw if it can."""
    chance, stops = of_caste(c, ant, CasteRow.STOP_PROBABILITY), False
    if chance > 0.0 and trait(c.carries, ant) == 0:
        if is_at_nest(c, v, w, ant):
            c.streams[ant] = advance(c.streams[ant])
            word = high_word(bits_of(c.streams[ant]))
            stops = word < ti.cast(chance * 4294967296.0, ti.u64)
    return stops


@ti.func
def is_at_nest(c: ti.template(), v: ti.template(), w, ant):
    """Return whether the queen of an ant is on a neighbour of its cell."""
    queen, sees_queen = c.nests[NestRow.QUEEN_CELL, w * v.n_nests + nest_of(c, v, ant)], False
    for heading in ti.static(range(N_HEADINGS)):
        sees_queen = sees_queen | (c.cell[ant] + c.compass[heading + 1] == queen)
    return sees_queen


@ti.func
def relieve(c: ti.template(), column, deliveries):
    """Lower the stimulus of a nest, a column of `nests`, after some deliveries."""
    lowered = c.stimulus[column] - c.labour[_RELIEF] * ti.cast(deliveries, ti.f64)
    c.stimulus[column] = ti.select(lowered > 0.0, lowered, ti.f64(0.0))


@ti.func
def demand(c: ti.template(), v: ti.template(), w):
    """Raise the stimulus of the nests of a world at the end of a tick."""
    for nest in range(v.n_nests):
        c.stimulus[w * v.n_nests + nest] += c.labour[_DEMAND]
