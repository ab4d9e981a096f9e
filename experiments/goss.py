"""The double bridge of Goss and others: how often a colony's ants take the shorter branch.

Prints the distribution of colonies by the share of their ants on the short branch, for branches
whose lengths have the ratio r, beside the published one, and how exact so many colonies make it.
See docs/baselines.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # these imports take a moment, in which Ctrl-C shall be heard too
    import argparse

    from taichi_ants.baselines.goss import PUBLISHED, choices, class_shares, crossing_steps
    from taichi_ants.errors import count
    from taichi_ants.studies.command_line import Parser, run_command, whole_number


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--colonies", type=whole_number(1, 10_000_000), default=100_000, help="for each ratio")
    add("--seed", type=whole_number(), default=0, help="of all colonies")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="CPU threads (default: all)")
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """A row for each ratio, ours and the published one."""
    print("percent of colonies by the share of the 501st to 1000th ant on the short branch\n")
    print("  r              0-20 %  20-40 %  40-60 %  60-80 %  80-100 %")
    for ratio, published in PUBLISHED.items():
        short, long = crossing_steps(ratio)
        took = choices(short, long, settings.colonies, seed=settings.seed, threads=settings.threads)
        for name, row in (("ours", class_shares(took)), ("published", published)):
            print(f"  {ratio:3}  {name:9}" + "".join(f"{percent:9.1f}" for percent in row))
    # A share p of N colonies has the standard error sqrt(p (1 - p) / N), most with p one half.
    print(
        f"\nour shares are of {count(settings.colonies, 'colony')} for each r: their standard "
        f"error is at most {50 / settings.colonies**0.5:.1f} points"
    )


if __name__ == "__main__":
    run_command(lambda: print_table(parse_arguments()))
