"""The columns of ants in kernels: values of an ant, its nest, its caste and their tables."""

import taichi as ti

from taichi_ants.arithmetic.random_bits import advance, bits_of, high_word, stream_of
from taichi_ants.grid.constants import STREAM_INDIVIDUAL


@ti.func
def trait(column: ti.template(), ant):
    """Return a value of an ant from a byte column, as i32."""
    return ti.cast(column[ant], ti.i32)


@ti.func
def put(column: ti.template(), ant, value):
    """Set a value of an ant in a byte column."""
    column[ant] = ti.cast(value, ti.i8)


@ti.func
def individual(c: ti.template(), w, ant):
    """Return the number of an ant that never changes, from 0 to less than 1, f64."""
    stream = advance(stream_of(c.seeds[w], STREAM_INDIVIDUAL, ti.cast(c.number[ant], ti.u64)))
    return ti.cast(high_word(bits_of(stream)), ti.f64) / 4294967296.0


@ti.func
def nest_of(c: ti.template(), v: ti.template(), ant):
    """Return the nest of an ant."""
    nest = 0
    if ti.static(v.n_nests > 1):
        nest = trait(c.nest, ant)
    return nest


@ti.func
def of_caste(c: ti.template(), ant, row: ti.template()):
    """Return a number of the caste of an ant, f64; `row` is a `CasteRow`."""
    return c.castes[row, trait(c.caste, ant)]


@ti.func
def group_of(c: ti.template(), v: ti.template(), ant):
    """Return the group of an ant in its world: those of its nest and caste, who share a table."""
    group = nest_of(c, v, ant)
    if ti.static(v.n_castes > 0):
        group = group * v.n_castes + trait(c.caste, ant)
    return group
