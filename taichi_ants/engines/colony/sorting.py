"""Sort the ants of each world by cell: a stable radix sort by two digits, which threads share.

It gives the same order as `ColonyState._sort_ants`. Columns move through `spare`, as many at once
as fit into its 64 bits.
"""

from collections.abc import Callable, Iterator
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import taichi as ti

from taichi_ants.engines.colony.barrier import next_group, part_of, share_of_part
from taichi_ants.engines.colony.columns import chunks_of, function, share_of
from taichi_ants.engines.colony.layout import COLUMNS, SORTED_BITS, Order

_N_DIGITS = 1 << SORTED_BITS // 2
_VARIANT = SimpleNamespace(in_chunks=True, by_ant=False)  # see `kernels.Variant`
_TYPES = {"i1": (ti.i8, ti.u8, 8), "i4": (ti.i32, ti.u32, 32), "f4": (ti.f32, ti.u32, 32)}
_TYPES["u8"] = ti.u64, ti.u64, 64


def scratch(n_slots: int, n_chunks: int) -> dict[str, np.ndarray]:
    return {
        "order": np.zeros(n_slots, np.int32),  # the slot from which the ant in each slot comes
        "spare": np.zeros(n_slots, np.uint64),
        # By chunk: how many of its ants have each digit, then where the next of them goes.
        "digits": np.zeros(n_chunks * 2 * _N_DIGITS, np.int32),
    }


def moved_together(columns: tuple[str, ...]) -> Iterator[list[tuple[str, Any, Any, int]]]:
    """Yield columns that fit together into 64 bits: names, types, as unsigned, first bits."""
    kinds = {name: _TYPES[COLUMNS[name].dtype if name in COLUMNS else "u8"] for name in columns}
    some: list[tuple[str, Any, Any, int]] = []
    used = 0
    for name, (kind, unsigned, bits) in sorted(kinds.items(), key=lambda item: item[1][2]):
        if used + bits > 64:
            yield some
            some, used = [], 0
        used = -(-used // bits) * bits
        some.append((name, kind, unsigned, used))
        used += bits
    yield some


@function
def digit_of(c, i, high):
    """Return the low digit of the ant in slot i, or the high one of what entry i of `spare` has."""
    digit = 0
    if high == 1:
        digit = ti.cast(c.spare[i] >> ti.u64(32), ti.i32)
    else:
        digit = c.cell[i] >> c.near_bits & (_N_DIGITS - 1)
    return digit


@function
def count(c, v, chunk, first, last, high):
    counts = 2 * _N_DIGITS * chunk
    for digit in range(_N_DIGITS):
        c.digits[counts + digit] = 0
    for i in range(first, last):
        at = counts + digit_of(c, i, high)
        c.digits[at] = c.digits[at] + 1


@function
def place(c, v, chunk, first, last, high):
    """Place the ants of a chunk by a digit, behind those with smaller ones or in earlier chunks."""
    w, n_chunks = chunk // chunks_of(c, v), chunks_of(c, v)
    places = 2 * _N_DIGITS * chunk + _N_DIGITS
    following = w * c.n_slots
    for digit in range(_N_DIGITS):
        for other in range(w * n_chunks, (w + 1) * n_chunks):
            if other == chunk:
                c.digits[places + digit] = following
            following += c.digits[2 * _N_DIGITS * other + digit]
    for i in range(first, last):
        at = places + digit_of(c, i, high)
        to = c.digits[at]
        c.digits[at] = to + 1
        if high == 1:
            c.order[to] = ti.cast(c.spare[i], ti.i32)
        else:
            following_digit = c.cell[i] >> c.near_bits >> ti.static(SORTED_BITS // 2)
            c.spare[to] = ti.cast(following_digit, ti.u64) << ti.u64(32) | ti.cast(i, ti.u64)


@cache
def sort(columns: tuple[str, ...], arguments: Any) -> Callable[..., None]:
    v, moves = _VARIANT, tuple(moved_together(columns))

    @function
    def take(c, v, first, last, number):
        for n in ti.static(range(len(moves))):
            if number == n:
                for i in range(first, last):
                    word, slot = ti.u64(0), c.order[i]
                    for name, _, unsigned, bit in ti.static(moves[n]):
                        value = ti.bit_cast(getattr(c, name)[slot], unsigned)
                        word |= ti.cast(value, ti.u64) << ti.u64(bit)
                    c.spare[i] = word

    @function
    def put(c, v, first, last, number):
        for n in ti.static(range(len(moves))):
            if number == n:
                for i in range(first, last):
                    word = c.spare[i]
                    for name, kind, unsigned, bit in ti.static(moves[n]):
                        value = ti.cast(word >> ti.u64(bit), unsigned)
                        getattr(c, name)[i] = ti.bit_cast(value, kind)

    @function
    def slots_of(c, v, chunk):
        first, last = share_of(c, v, chunk, c.n_slots)
        before = chunk // chunks_of(c, v) * c.n_slots
        return before + first, before + last

    @ti.kernel
    def sort_ants(c: arguments):  # type: ignore[no-untyped-def]
        ti.loop_config(block_dim=1)
        for _ in range(c.orders[Order.PARTS]):
            part, parts, at = part_of(c), c.orders[Order.PARTS], 0
            n = c.n_worlds * chunks_of(c, v)
            for high in range(2):
                for do in ti.static((count, place)):
                    begin, end = share_of_part(c, n, part, parts, at)
                    for chunk in range(begin, end):
                        first, last = slots_of(c, v, chunk)
                        do(c, v, chunk, first, last, high)
                    at = next_group(c, part, parts, at)
            for number in range(ti.static(len(moves))):
                for do in ti.static((take, put)):
                    begin, end = share_of_part(c, n, part, parts, at)
                    for chunk in range(begin, end):
                        first, last = slots_of(c, v, chunk)
                        do(c, v, first, last, number)
                    at = next_group(c, part, parts, at)

    return sort_ants
