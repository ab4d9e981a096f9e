"""Simulate the double bridge of Goss and others, and print how often the short branch wins.

For each ratio r of the branch lengths, the script prints the share of colonies in each class of the
share of ants on the short branch. It also prints the published shares and the standard error. In
the last rows, the short branch opens late. See docs/models/goss.md.
"""

# No `from __future__ import annotations`, because Taichi reads the annotations of kernels.
from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    from typing import Annotated

    import numpy as np
    import published
    import taichi as ti

    from taichi_ants import runtime
    from taichi_ants.analysis.tables import Table
    from taichi_ants.arithmetic.numbers import power
    from taichi_ants.arithmetic.random_bits import advance, bits_of, high_word, low_word
    from taichi_ants.errors import AntsError, checked_whole, count
    from taichi_ants.grid.constants import STREAM_BRIDGE
    from taichi_ants.grid.randomness import stream_state
    from taichi_ants.settings import Count, Seed, Setting, checked_arguments
    from taichi_ants.studies.command_line import Parser, add_threads, run_command, whole_number

# Percent of colonies for each ratio r of the branches, by the share of ants on the short branch:
# 0-20 %, 20-40 %, 40-60 %, 60-80 %, 80-100 %.
PUBLISHED = {1.0: (37, 9, 8, 7, 39), 1.4: (23, 10, 8, 10, 49), 2.0: (15, 6, 6, 7, 66)}
# The same for r = 2 and a short branch that opens after the 1000th ant; ants 1501 to 2000 count.
PUBLISHED_LATE = (100, 0, 0, 0, 0)
LATE_RATIO = 2.0
AS_PUBLISHED = 1000  # ants that choose
N_CLASSES = 5
SHORT_CELLS = 10  # 2 seconds each
_LAUNCH = 1 << 14  # colonies per launch, which takes less than half a second


@ti.kernel
def cross(
    took: ti.types.ndarray(dtype=ti.u8, ndim=2),
    states: ti.types.ndarray(dtype=ti.u64, ndim=1),
    short: ti.i32,
    long: ti.i32,
    k: ti.f64,
    n: ti.i32,
    opens: ti.i32,
):
    """Write the choices of all colonies to `took`, see `choices`; colonies run in parallel.

    Arrivals follow from `took`: an ant arrives `short` or `long` steps after its choice. Each step
    takes one draw from the streams `states`: the high word for the nest, the low word for the food.
    Ants that have no choice because of `opens` draw too.
    """
    for colony in range(took.shape[0]):
        state = states[colony]
        marks = ti.Vector([0, 0, 0, 0])  # at the nest: short, long; at the food: short, long
        for step in range(took.shape[1] // 2):
            state = advance(state)
            bits = bits_of(state)
            for end in ti.static(range(2)):
                if step >= short:
                    marks[2 * end] += took[colony, 2 * (step - short) + 1 - end]
                if step >= long:
                    marks[2 * end + 1] += 1 - took[colony, 2 * (step - long) + 1 - end]
                to_short = power(k + marks[2 * end], ti.cast(n, ti.f64))
                to_long = power(k + marks[2 * end + 1], ti.cast(n, ti.f64))
                word = high_word(bits)
                if ti.static(end == 1):
                    word = low_word(bits)
                takes_short = ti.cast(
                    ti.cast(word, ti.f64) * (to_short + to_long) < to_short * 4294967296.0, ti.i32
                )
                if 2 * step + end < opens:
                    takes_short = 0
                marks[2 * end] += takes_short
                marks[2 * end + 1] += 1 - takes_short
                took[colony, 2 * step + end] = ti.cast(takes_short, ti.u8)


def crossing_steps(ratio: float) -> tuple[int, int]:
    """Return the steps to cross the short branch and a branch that is `ratio` times as long."""
    return SHORT_CELLS - 1, round(SHORT_CELLS * ratio) - 1


@checked_arguments
def choices(
    short: Count,
    long: Count,
    colonies: Count = 10_000,
    *,
    ants: Count = AS_PUBLISHED,
    k: Annotated[float, Setting(above=0, most=1e9)] = 20.0,
    n: Annotated[int, Setting(least=1, most=8)] = 2,
    opens: int = 0,
    seed: Seed = 0,
    threads: int | None = None,
) -> np.ndarray:
    """Return the branch that each ant takes: uint8 (colonies, ants), 1 for the short one.

    The model is that of Goss, Aron, Deneubourg and Pasteels: Self-organized shortcuts in the
    Argentine ant. Naturwissenschaften 76 (1989), 579-581. At each end of the bridge, one ant leaves
    every 2 seconds, which is a *step* of the model. If that end has S marks of the short branch and
    L of the long one, it takes the short one with probability

        (k + S)^n / ((k + S)^n + (k + L)^n).

    It leaves one mark of its branch at the end where it chooses, and one at the other end when it
    arrives. Marks do not evaporate. The short branch takes 20 seconds, the long one 20 r: 10 and
    10 r cells of 2 seconds each. An ant is in the first cell when it chooses and in the last when
    it arrives.

    `short` and `long` are the steps to cross the branches, see `crossing_steps`. `ants` is the
    number of choices, and even: ants choose in turn at the nest, first, and at the food. The first
    `opens` ants choose before the short branch opens, and take the long one. More colonies do not
    change the first ones.
    """
    checked_whole("`long`", long, short)
    checked_whole("`opens`", opens, 0, ants)
    states = stream_state(seed, STREAM_BRIDGE, np.arange(colonies))
    runtime.start(threads)
    took = np.zeros((colonies, ants), np.uint8)
    with runtime.quiet():
        for first in range(0, colonies, _LAUNCH):
            some = slice(first, first + _LAUNCH)
            cross(took[some], states[some], short, long, k, n, opens)
    return took


def class_shares(took: np.ndarray, first: int = 501, last: int = 1000) -> np.ndarray:
    """Return the percentage of colonies in each class of shares of the short branch, float64 (5,).

    The classes are 0-20 %, ... 80-100 % of the ants `first` to `last`, counted from 1; a share on a
    border belongs to the class above. `took` is a result of `choices`.
    """
    short = took[:, first - 1 : last].sum(axis=1, dtype=np.int64)
    classes = np.minimum(N_CLASSES * short // (last - first + 1), N_CLASSES - 1)
    return 100 * np.bincount(classes, minlength=N_CLASSES) / len(took)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    colonies = "number of colonies for each ratio"
    add("--colonies", type=whole_number(1, 10_000_000), default=100_000, metavar="N", help=colonies)
    chosen = (
        "even number of ants per colony that choose a branch; the second half counts (default: "
        "%(default)s, as published); if the short branch opens late, N ants choose before that "
        "and N after"
    )
    number = whole_number(4, 10_000_000)
    add("--choices", type=number, default=AS_PUBLISHED, metavar="N", help=chosen)
    add("--seed", type=whole_number(), default=0, metavar="N", help="seed of all colonies")
    add("--publish", action="store_true", help="write the table to the docs")
    add_threads(parser)
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """Print a row for each ratio, and the published row if `--choices` is as published."""
    n, colonies = settings.choices, settings.colonies
    if n % 2:
        raise AntsError(
            f"--choices is {n}; it must be even, because half of the ants choose at each end."
        )
    cases = [(str(r), r, 0, theirs) for r, theirs in PUBLISHED.items()]
    cases += [(f"{LATE_RATIO}, opens late", LATE_RATIO, n, PUBLISHED_LATE)]
    rows: list[list[str]] = []
    for name, ratio, opens, theirs in cases:
        how = {"ants": opens + n, "opens": opens, "seed": settings.seed}
        took = choices(*crossing_steps(ratio), colonies, **how, threads=settings.threads)
        shown = {"ours": class_shares(took, opens + n // 2 + 1, opens + n)}
        if n == AS_PUBLISHED:
            shown["published"] = theirs
        rows += [[name, kind, *(f"{share:.1f}" for share in row)] for kind, row in shown.items()]
    # A share p of N colonies has the standard error sqrt(p (1 - p) / N), the largest with p = 1/2.
    notes = (
        f"Percentage of colonies by the share of ants {n // 2 + 1} to {n} on the short branch; if "
        f"it opens after ant {n}, of ants {n + n // 2 + 1} to {2 * n}. Ours: "
        f"{count(colonies, 'colony')} for each r, with a standard error of at most "
        f"{50 / colonies**0.5:.1f} percentage points.",
    )
    columns = ("r", "", *(f"{low}-{low + 20} %" for low in range(0, 100, 20)))
    published.show("goss", [Table("", columns, rows, notes, 2)], settings.publish)


if __name__ == "__main__":
    run_command(lambda: print_table(parse_arguments()))
