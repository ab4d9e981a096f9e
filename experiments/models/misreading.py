"""Find the rate of misread cells at which trails no longer help ants that forage.

For each rate, ants learn to forage together, once with trails and once without, each in the world
of its seed. Then they follow what they learned. The script prints deliveries per 1000 ticks with
and without trails, and the difference, paired by seed, with 95 % intervals over seeds. It writes
misreading.csv, with a row for each seed, and misreading.png. See docs/models.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    from dataclasses import replace
    from pathlib import Path

    import numpy as np

    from taichi_ants import Colony, Task, TrainingConfig, files, task
    from taichi_ants.analysis import style
    from taichi_ants.analysis.statistics import bootstrap_interval
    from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
    from taichi_ants.task import Life, Noise
    from taichi_ants.worlds import open_world

RATES = (0.0, 0.01, 0.03, 0.1, 0.2, 0.4)
ANTS, EPISODES, TICKS, RANGES = 64, 40, 1000, (24, 24, 24)
LEARNING = TrainingConfig("sarsa", 0.1, 0.9, epsilon=0.3, epsilon_decay=0.9, min_epsilon=0.01)
FORAGING = replace(task.foraging(), delivery="truncates", life=Life(regrowth=0))
RULES = {"with trails": FORAGING, "without": FORAGING.replace(pheromone={"deposit": "none"})}
SERIES = (*RULES, "difference")


def deliveries(rules: Task, rate: float, seeds: int, episodes: int, ticks: int) -> np.ndarray:
    """Return the deliveries per 1000 ticks of ants that have learned, float (seeds,)."""
    places = [open_world(seed, RANGES) for seed in range(seeds)]
    noisy = replace(rules, noise=Noise(misread=rate))
    colony = Colony(places, noisy, LEARNING, range(seeds), ANTS)
    colony.run(episodes, ticks)
    calm = replace(LEARNING, epsilon=0.01)
    followers = Colony(places, noisy, calm, range(1000, 1000 + seeds), ANTS, sharing="frozen",
                       q_values=colony.q_values)  # fmt: skip
    return followers.run(2, ticks).deliveries.mean(axis=0) * 1000 / ticks


def main(settings: argparse.Namespace) -> None:
    """Print the table, and write the figure and its numbers."""
    files.check_writable_file(settings.out / "misreading.csv")
    rows, found = [], []
    with progress_bar("Colonies that misread") as progress:
        for number, rate in enumerate(RATES):
            sizes = settings.seeds, settings.episodes, settings.ticks
            each = np.array([deliveries(rules, rate, *sizes) for rules in RULES.values()])
            each = np.array([*each, each[0] - each[1]])
            found.append([each.mean(axis=1), *bootstrap_interval(each)])
            rows += [{"misread": rate, "seed": seed, **dict(zip(SERIES, one, strict=True))}
                     for seed, one in enumerate(each.T.tolist())]  # fmt: skip
            progress((number + 1) / len(RATES))
    print("misread", *(f"{name:>20}" for name in SERIES))
    for rate, (means, low, high) in zip(RATES, found, strict=True):
        cells = (f"{m:7.0f} [{a:4.0f}, {b:4.0f}]" for m, a, b in zip(means, low, high, strict=True))
        print(f"{rate:7g}", *cells)
    files.write_csv(settings.out / "misreading.csv", rows, ("misread", "seed", *SERIES))
    draw(settings.out / "misreading.png", np.array(found), settings.seeds)


def draw(path: Path, found: np.ndarray, seeds: int) -> None:
    """Draw means and intervals, (rates, 3, series), over rates."""
    with style.styled():
        figure = style.new_figure(3.4)
        axes = figure.subplots()
        for number, name in enumerate(RULES):
            means, low, high = found[:, :, number].T
            colour = style.COLOURS[number]
            axes.plot(RATES, means, color=colour, marker="o", label=name)
            axes.fill_between(RATES, low, high, color=colour, alpha=0.2)
        axes.set(xlabel="probability of misreading a cell", ylabel="deliveries per 1000 ticks")
        caption = f"Means over {seeds} seeds with 95 % intervals; {ANTS} ants."
        frame = "Trails help less, the more cells ants misread", caption
        style.frame(figure, *frame, style.legend_entries([axes]))
    style.save(figure, path)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--seeds", type=whole_number(2), default=20, metavar="N", help="seeds of each case")
    add("--out", type=Path, default=Path(), metavar="FOLDER", help="folder for figure and numbers")
    add("--episodes", type=whole_number(1), default=EPISODES, metavar="N", help="of training")
    add("--ticks", type=whole_number(1), default=TICKS, metavar="N", help="ticks of an episode")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    run_command(lambda: main(parse_arguments()))
