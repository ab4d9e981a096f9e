"""Let ants choose between the branches of a double bridge by the choice function of Deneubourg.

Ants choose by trails alone, with k = 20 deposits and exponent 2. They lay trails with food only,
and do not know their way except by the compass. On the late bridge, rock closes the short branch
for the first half of the time. Shares are of the crossings in the last tenth of the time.

The script prints, for each bridge, the share of colonies with most crossings on the short branch,
and the share of colonies with at least 80 % of them on one branch. It writes double_bridge.csv,
with a row for each colony, and double_bridge.png. See docs/models.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    from pathlib import Path

    import numpy as np

    from taichi_ants import Colony, files
    from taichi_ants.analysis import style
    from taichi_ants.analysis.statistics import bootstrap_interval
    from taichi_ants.studies.bridge import crossings
    from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
    from taichi_ants.task import Choice, Life, Pheromone, Task
    from taichi_ants.worlds import double_bridge

DEPOSIT, ANTS, TICKS, SHORT, LONG = 100, 60, 6000, 12, 20
LASTING = Pheromone(evaporation="none", deposit="add", level=DEPOSIT, cap=1_000_000)
TRAILS = {
    "no evaporation": LASTING,
    "half-life 300": LASTING.but(evaporation="exponential", half_life=300),
}
# The length of the long branch, and the tick at which the short one opens.
BRIDGES = {"equal": (SHORT, 0), "short at once": (LONG, 0), "short late": (LONG, TICKS // 2)}


def shares(pheromone: Pheromone, long: int, opens: int, seeds: int) -> np.ndarray:
    """Return the share of the last crossings that are on the short branch, for each seed."""
    rules = Task(
        pheromone=pheromone,
        choice=Choice("deneubourg", k=20 * DEPOSIT, exponent=2),
        traffic="following",
        life=Life(regrowth=0),
        turns_at_queen=True,
    )
    found = np.empty(seeds)
    # Interventions, which open the short branch late, need a colony with a single world.
    several = (
        [[seed] for seed in range(seeds)] if opens else [range(0, seeds, 2), range(1, seeds, 2)]
    )
    for some in several:
        bridge = {"short": SHORT, "long": long, "mirrored": bool(some[0] % 2)}
        world = double_bridge(**bridge)
        colony = Colony(world, rules, None, some, ANTS, sharing="frozen", schedule="by_world")
        late = crossings(colony, bridge, TICKS, opens)[-1].sum(axis=0)
        with np.errstate(invalid="ignore"):  # without any crossing, the share is not known
            found[list(some)] = late[0] / late.sum(axis=0)
    return found


def main(settings: argparse.Namespace) -> None:
    """Print the table, and write the figure and its numbers."""
    files.check_writable_folder(settings.out)
    rows, lines = [], []
    with style.styled(), progress_bar("Colonies on bridges") as progress:
        figure = style.new_figure(4.4)
        panels = figure.subplots(len(TRAILS), len(BRIDGES), sharex=True, sharey=True)
        cases = [(trail, bridge) for trail in TRAILS for bridge in BRIDGES]
        for number, (axes, (trail, bridge)) in enumerate(zip(panels.flat, cases, strict=True)):
            every = shares(TRAILS[trail], *BRIDGES[bridge], settings.seeds)
            rows += [{"trails": trail, "bridge": bridge, "seed": seed, "short_share": share}
                     for seed, share in enumerate(every.tolist())]  # fmt: skip
            known = every[np.isfinite(every)]
            (low,), (high,) = bootstrap_interval(1.0 * (known > 0.5)[None])
            one = (np.abs(known - 0.5) >= 0.3).mean()
            lines.append(f"{trail:15} {bridge:14} {len(known):8} {100 * (known > 0.5).mean():10.0f}"
                         f"  {100 * low:3.0f} to {100 * high:3.0f} {100 * one:9.0f}")  # fmt: skip
            axes.hist(known, np.linspace(0, 1, 11), color=style.BLUE)
            axes.set(title=f"{bridge}, {trail}")
            progress((number + 1) / len(cases))
        for axes in panels[-1]:
            axes.set_xlabel("share on the short branch")
        style.frame(figure, "Double bridge: colonies by their use of the short branch",
                    f"{settings.seeds} colonies of {ANTS} ants in each panel, last tenth of "
                    f"{TICKS} ticks.", {})  # fmt: skip
    print("trails          bridge         colonies  short (%)  interval    one side (%)")
    print(*lines, sep="\n")
    columns = ("trails", "bridge", "seed", "short_share")
    files.write_csv(settings.out / "double_bridge.csv", rows, columns)
    style.save(figure, settings.out / "double_bridge.png")


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--seeds", type=whole_number(2), default=60, metavar="N", help="colonies in each case")
    add("--out", type=Path, default=Path(), metavar="FOLDER", help="folder for figure and numbers")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    run_command(lambda: main(parse_arguments()))
