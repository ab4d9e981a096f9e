"""Simulate the double bridge of Goss and others, and print how often the short branch wins.

For each ratio r of the branch lengths, the script prints the share of colonies in each class of the
share of ants on the short branch. It also prints the published shares and the standard error. In
the last rows, the short branch opens late. See docs/baselines.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse

    from taichi_ants.baselines.goss import (
        LATE_RATIO,
        PUBLISHED,
        PUBLISHED_LATE,
        choices,
        class_shares,
        crossing_steps,
    )
    from taichi_ants.errors import AntsError, count
    from taichi_ants.studies.command_line import THREADS, Parser, run_command, whole_number

AS_PUBLISHED = 1000  # ants that choose
MOST_CHOICES = 1 << 32  # of all colonies together; each takes a byte


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    colonies = "number of colonies for each ratio"
    add("--colonies", type=whole_number(1, 10_000_000), default=100_000, metavar="N", help=colonies)
    add(
        "--choices",
        type=whole_number(4, 10_000_000),
        default=AS_PUBLISHED,
        metavar="N",
        help="even number of ants per colony that choose a branch; the second half counts "
        "(default: %(default)s, as published); if the short branch opens late, N ants choose "
        "before that and N after",
    )
    add("--seed", type=whole_number(), default=0, metavar="N", help="seed of all colonies")
    add("--threads", type=whole_number(1, 1024), metavar="N", help=THREADS)
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """Print a row for each ratio, and the published row if `--choices` is as published."""
    n, colonies = settings.choices, settings.colonies
    if n % 2:
        raise AntsError(
            f"--choices is {n}; it must be even, because half of the ants choose at each end."
        )
    if 2 * n * colonies > MOST_CHOICES:
        raise AntsError(
            f"--choices {n} with --colonies {colonies} needs {2 * n * colonies / 1e9:.0f} GB; "
            f"their product must be at most {MOST_CHOICES // 2}, so reduce either of them."
        )
    rows = [(str(r), r, 0, published) for r, published in PUBLISHED.items()]
    rows += [(f"{LATE_RATIO}, opens late", LATE_RATIO, n, PUBLISHED_LATE)]
    print(
        f"Percentage of colonies by the share of ants {n // 2 + 1} to {n} on the short branch.\n"
        f"If that branch opens after ant {n}: ants {n + n // 2 + 1} to {2 * n}.\n"
    )
    classes = (f"{low}-{low + 20} %" for low in range(0, 100, 20))
    print(f"  {'r':25}" + "".join(f"{one:>9}" for one in classes))
    for name, ratio, opens, published in rows:
        how = {"ants": opens + n, "opens": opens, "seed": settings.seed}
        took = choices(*crossing_steps(ratio), colonies, **how, threads=settings.threads)
        shown = {"ours": class_shares(took, opens + n // 2 + 1, opens + n)}
        if n == AS_PUBLISHED:
            shown["published"] = published
        for kind, row in shown.items():
            print(f"  {name:15} {kind:9}" + "".join(f"{percent:9.1f}" for percent in row))
    # A share p of N colonies has the standard error sqrt(p (1 - p) / N), the largest with p = 1/2.
    print(
        f"\nOur shares are of {count(colonies, 'colony')} for each r, with a standard error of at "
        f"most {50 / colonies**0.5:.1f} percentage points."
    )


if __name__ == "__main__":
    run_command(lambda: print_table(parse_arguments()))
