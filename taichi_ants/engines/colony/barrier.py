"""The parts of a launch that share a colony, and the barrier at which they wait for each other.

A launch does groups of phases one after another. Each part does its share of the chunks in a group,
and waits until all parts have done theirs. The first part that starts decides: it opens the barrier
once the others have arrived, or gives up. If it gives up, all parts that have started leave at this
barrier, also those that still wait at the one before. A part that starts later leaves at its first
barrier, which is the same one.
"""

import taichi as ti

from taichi_ants.engines.colony import layout
from taichi_ants.engines.colony.columns import function
from taichi_ants.engines.colony.layout import ARRIVALS_TOGETHER, LINE, Barrier, Order


@function
def part_of(c):
    """Return the number of a part that starts, by the order of starts."""
    return ti.cast(ti.atomic_add(c.barrier[Barrier.STARTED], 1), ti.i32)


@function
def share_of_part(c, n, part, parts, at):
    """Return a part's range among n chunks or worlds in group `at`; empty if it was done, or -1."""
    begin, end = n * part // parts, n * (part + 1) // parts
    return begin, ti.select(at >= c.orders[Order.FIRST], end, begin)


@function
def next_group(c, part, parts, at):
    """Wait until all parts have done group `at`; return the next one, or -1 to leave, as before."""
    following = ti.select(at < 0, -1, at + 1)
    if parts > 1 and at >= 0:
        if wait_for_all(c, part, parts, at) == 0:
            following = -1
    return following


@function
def wait_for_all(c, part, parts, number):
    """Wait until all parts arrive at barrier `number`; return 0 if one does not arrive, else 1.

    A few parts count their arrivals together, and the last of them counts for all of them: many
    threads that write to one cache line wait for each other.
    """
    goes_on, each = 1, ARRIVALS_TOGETHER
    if part == 0:
        wanted, spins = (number + 1) * ((parts - 2) // each + 1), 0
        # Atomic, because the compiler could move a plain read out of the loop. It adds nothing, so
        # it becomes a read, which the cache lines of all threads can serve.
        arrived = ti.atomic_add(c.barrier[Barrier.ARRIVED], 0)
        while arrived < wanted and spins < c.orders[Order.SPINS]:
            arrived = ti.atomic_add(c.barrier[Barrier.ARRIVED], 0)
            spins += 1
        goes_on = ti.cast(arrived >= wanted, ti.i32)
        ti.atomic_add(
            c.barrier[Barrier.OPENED], ti.select(goes_on == 1, ti.i64(1), ti.i64(layout.GAVE_UP))
        )
    else:
        several = (part - 1) // each
        last = (number + 1) * ti.min(each, parts - 1 - several * each) - 1
        if ti.atomic_add(c.barrier[Barrier.TOGETHER + several * LINE], 1) == last:
            ti.atomic_add(c.barrier[Barrier.ARRIVED], 1)
        opened = ti.atomic_add(c.barrier[Barrier.OPENED], 0)
        while opened >= 0 and opened <= number:
            opened = ti.atomic_add(c.barrier[Barrier.OPENED], 0)
        # The first part may have opened this barrier, and given up at the next one since then.
        if opened < 0:
            opened -= ti.i64(layout.GAVE_UP)
        goes_on = ti.cast(opened > number, ti.i32)
    return goes_on


@function
def wait_for_blocks(c, thread, arrivals):
    """Wait, on a GPU, until all blocks of threads have arrived; `thread` is that of its block.

    The fences make others see what this block wrote, and this one what others wrote.
    """
    ti.simt.block.sync()
    if thread == 0:
        ti.simt.grid.memfence()
        ti.atomic_add(c.barrier[Barrier.ARRIVED], 1)
        while ti.atomic_add(c.barrier[Barrier.ARRIVED], 0) < arrivals:
            pass
        ti.simt.grid.memfence()
    ti.simt.block.sync()
