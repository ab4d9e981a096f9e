"""The columns of ants in kernels: values of an ant, its nest, its caste and their tables."""

from collections.abc import Callable
from typing import Any

import taichi as ti
from taichi.lang.impl import subscript

from taichi_ants.arithmetic.random_bits import advance, bits_of, high_word, stream_of
from taichi_ants.engines.colony.layout import Order
from taichi_ants.grid.constants import STREAM_INDIVIDUAL
from taichi_ants.kernel_functions import while_compiling

_TEMPLATES = {"c", "v", "column", "cues", "field", "view", "row", "phase", "update"}
_TEMPLATES |= {"what", "arguments"}


def function(body: Callable[..., Any]) -> Callable[..., Any]:
    """Return a `ti.func` of a colony, as a decorator; some arguments are templates by their names.

    `c` has the arrays and numbers of a kernel, `v` is its `Variant`, `cues` are those of a caste in
    `Task.all_cues`, `field` has the arrays and numbers of a pheromone.
    """
    arguments = body.__code__.co_varnames[: body.__code__.co_argcount]
    body.__annotations__ |= {name: ti.template() for name in arguments if name in _TEMPLATES}
    return ti.func(body)


@while_compiling
def chunks_of(c, v):
    """Return the number of chunks of each world in a launch."""
    if v.by_ant:
        return c.places
    return subscript(None, c.orders, Order.CHUNKS) if v.in_chunks else 1


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
def add(v, column, index, n):
    """Add n to an entry, which a single thread changes unless `v.by_ant`."""
    if ti.static(v.by_ant):
        if n != 0:
            column[index] += n
    else:  # without `+=`, which would be atomic and slower
        column[index] = column[index] + n


@function
def individual(c, w, ant):
    """Return the number of an ant that never changes, from 0 to less than 1, f64."""
    stream = advance(stream_of(c.seeds[w], STREAM_INDIVIDUAL, ti.cast(c.number[ant], ti.u64)))
    return ti.cast(high_word(bits_of(stream)), ti.f64) / 4294967296.0


@while_compiling
def nest_of(c, v, ant):
    return trait(c.nest, ant) if v.n_nests > 1 else 0


@function
def of_caste(c, ant, row):
    """Return a number of the caste of an ant, f64; `row` is a `CasteRow`."""
    return c.castes[row, trait(c.caste, ant)]


@while_compiling
def group_of(c, v, ant):
    """Return the group of an ant in its world: those of its nest and caste, who share a table."""
    nest = nest_of(c, v, ant)
    return nest * v.n_castes + trait(c.caste, ant) if v.n_castes > 0 else nest
