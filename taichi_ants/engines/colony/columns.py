"""The columns of ants in kernels: values of an ant, its nest, its caste and their tables."""

from collections.abc import Callable
from typing import Any

import taichi as ti

from taichi_ants.arithmetic.random_bits import advance, bits_of, high_word, stream_of
from taichi_ants.engines.colony.layout import Order
from taichi_ants.grid.constants import STREAM_INDIVIDUAL

_TEMPLATES = {"c", "v", "column", "cues", "field", "view", "row", "phase", "update"}


def function(body: Callable[..., Any]) -> Callable[..., Any]:
    """Return a `ti.func` of a colony, as a decorator; some arguments are templates by their names.

    `c` has the arrays and numbers of a kernel, `v` is its `Variant`, `cues` are those of a caste in
    `Task.all_cues`, `field` has the arrays and numbers of a pheromone.
    """
    arguments = body.__code__.co_varnames[: body.__code__.co_argcount]
    body.__annotations__ |= {name: ti.template() for name in arguments if name in _TEMPLATES}
    return ti.func(body)


@function
def chunks_of(c, v):
    """Return the number of chunks of each world in a launch."""
    n = 1
    if ti.static(v.by_ant):
        n = c.places
    elif ti.static(v.in_chunks):
        n = c.orders[Order.CHUNKS]
    return n


@function
def share_of(c, v, chunk, n):
    """Return the range of a chunk among n ants, cells or states of a world."""
    n_chunks = chunks_of(c, v)
    each = (n + n_chunks - 1) // n_chunks
    first = chunk % n_chunks * each
    return first, ti.min(first + each, n)


@function
def trait(column, ant):
    """Return a value of an ant from a byte column, as i32."""
    return ti.cast(column[ant], ti.i32)


@function
def put(column, ant, value):
    column[ant] = ti.cast(value, ti.i8)


@function
def individual(c, w, ant):
    """Return the number of an ant that never changes, from 0 to less than 1, f64."""
    stream = advance(stream_of(c.seeds[w], STREAM_INDIVIDUAL, ti.cast(c.number[ant], ti.u64)))
    return ti.cast(high_word(bits_of(stream)), ti.f64) / 4294967296.0


@function
def nest_of(c, v, ant):
    nest = 0
    if ti.static(v.n_nests > 1):
        nest = trait(c.nest, ant)
    return nest


@function
def own_map(c, v, w, ant):
    """Return the place of an ant's cell in an array with a map for each nest."""
    return (w * v.n_nests + nest_of(c, v, ant)) * c.size + c.cell[ant]


@function
def of_caste(c, ant, row):
    """Return a number of the caste of an ant, f64; `row` is a `CasteRow`."""
    return c.castes[row, trait(c.caste, ant)]


@function
def group_of(c, v, ant):
    """Return the group of an ant in its world: those of its nest and caste, who share a table."""
    group = nest_of(c, v, ant)
    if ti.static(v.n_castes > 0):
        group = group * v.n_castes + trait(c.caste, ant)
    return group
