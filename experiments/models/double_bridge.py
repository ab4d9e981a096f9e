"""Let ants choose between the branches of a double bridge by the choice function of Deneubourg.

Ants choose by pheromone alone, with exponent 2, and with k = 5 deposits, which evaporate with a
half-life of 150 ticks. Ants with food know by the compass which cells are nearer to the queen. In
the model "both ways", all ants mark, and ants with food follow the marks of all ants. In the model
"on the return", only ants with food mark. Ants without food follow the marks of ants with food in
both models. On the late bridge, rock closes the short branch for the first half of the time. Shares
are of the crossings in the last tenth of the time.

The script prints, for each bridge, the share of colonies with most crossings on the short branch,
and the share of colonies with at least 80 % of them on one branch. It writes double_bridge.csv,
with a row for each colony, and double_bridge.png. See docs/models.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import sys
    from pathlib import Path

    import numpy as np

    sys.path.append(str(Path(__file__).parents[1]))
    from bridge import crossings

    from taichi_ants import Colony, Field, files
    from taichi_ants.analysis import style
    from taichi_ants.analysis.statistics import bootstrap_interval
    from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
    from taichi_ants.task import Choice, Life, Pheromone, Task
    from taichi_ants.worlds import double_bridge

DEPOSIT, ANTS, TICKS, SHORT, LONG = 100, 60, 6000, 20, 37
MARKS = {
    **{"evaporation": "exponential", "half_life": 150},
    **{"deposit": "add", "level": DEPOSIT, "cap": 1_000_000},
}
ON_THE_RETURN = Task(
    pheromone=Pheromone(**MARKS),
    choice=Choice("deneubourg", k=5 * DEPOSIT, exponent=2),
    traffic="following",
    life=Life(regrowth=0),
    turns_at_queen=True,
)
MODELS = {
    "both ways": ON_THE_RETURN.replace(
        fields={"both": Field(deposited_when="always", **MARKS)}, choice={"carriers_follow": "both"}
    ),
    "on the return": ON_THE_RETURN,
}
# The length of the long branch, and the tick at which the short one opens.
BRIDGES = {"equal": (SHORT, 0), "short at once": (LONG, 0), "short late": (LONG, TICKS // 2)}


def shares(model: Task, long: int, opens: int, seeds: int) -> np.ndarray:
    """Return the share of the last crossings that are on the short branch, for each seed."""
    found = np.empty(seeds)
    # Interventions, which open the short branch late, need a colony with a single world.
    several = (
        [[seed] for seed in range(seeds)] if opens else [range(0, seeds, 2), range(1, seeds, 2)]
    )
    for some in several:
        bridge = {"short": SHORT, "long": long, "mirrored": bool(some[0] % 2)}
        world = double_bridge(**bridge)
        colony = Colony(world, model, None, some, ANTS, sharing="frozen", schedule="by_world")
        late = crossings(colony, bridge, TICKS, opens)[-1].sum(axis=0)
        with np.errstate(invalid="ignore"):  # without any crossing, the share is not known
            found[list(some)] = late[0] / late.sum(axis=0)
    return found


def interval(which: np.ndarray) -> str:
    """Return the share of true entries in percent, with its 95 % interval."""
    (low,), (high,) = bootstrap_interval(1.0 * which[None])
    return f"{100 * which.mean():3.0f} [{100 * low:.0f}, {100 * high:.0f}]".ljust(14)


def main(settings: argparse.Namespace) -> None:
    """Print the table, and write the figure and its numbers."""
    files.check_writable_file(settings.out / "double_bridge.csv")
    rows, lines = [], []
    with style.styled(), progress_bar("Colonies on bridges") as progress:
        figure = style.new_figure(4.4)
        panels = figure.subplots(len(MODELS), len(BRIDGES), sharex=True, sharey=True)
        cases = [(model, bridge) for model in MODELS for bridge in BRIDGES]
        for number, (axes, (model, bridge)) in enumerate(zip(panels.flat, cases, strict=True)):
            every = shares(MODELS[model], *BRIDGES[bridge], settings.seeds)
            rows += [{"marks": model, "bridge": bridge, "seed": seed, "short_share": share}
                     for seed, share in enumerate(every.tolist())]  # fmt: skip
            known = every[np.isfinite(every)]
            lines.append(
                f"{model:15} {bridge:14} {len(known):8}  {interval(known > 0.5)}  "
                f"{interval(np.abs(known - 0.5) >= 0.3)}"
            )
            axes.hist(known, np.linspace(0, 1, 11), color=style.BLUE)
            axes.set(title=f"{bridge}, {model}")
            progress((number + 1) / len(cases))
        for axes in panels[-1]:
            axes.set_xlabel("share on the short branch")
        style.frame(figure, "Double bridge: colonies by their use of the short branch",
                    f"{settings.seeds} colonies of {ANTS} ants in each panel, last tenth of "
                    f"{TICKS} ticks.", {})  # fmt: skip
    print("marks           bridge         colonies  short (%)     one side (%)")
    print(*lines, sep="\n")
    columns = ("marks", "bridge", "seed", "short_share")
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
