"""Ants without a compass that find home by a second trail.

Ants lay the field "home" while they are without food. It is strongest near the nest, because
deposits fade with the time since an ant left it. Ants with food follow it in place of the compass.

    python experiments/models/home_trail.py [--seeds N] [--out FOLDER]

The script writes home_trail.png and home_trail.csv, and prints one table.
"""

from argparse import ArgumentParser
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from taichi_ants import Colony, Field, Task, TrainingConfig, worlds
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.task import foraging

WORLD = worlds.open_world(seed=1, ranges=(20, 20, 20))
EPISODES, TICKS, ANTS = 30, 1000, 32
LEARNING = TrainingConfig(
    "sarsa", 0.1, 0.9, 0.3, 0.9, learning_rate_decay=0.9, min_learning_rate=0.01, initial_q=5.0
)


def models() -> dict[str, Task]:
    """Return the task of each model, by its label."""
    compass = foraging().but(delivery="truncates", life={"regrowth": 0})
    home = Field(deposit="fading", level=500, slope=10, view="strongest", laid="without_food")
    by_trail = compass.but(fields={"home": home}, homing_cue="home")
    lost = by_trail.but(fields={"home": home.but(laid="never")})
    return {"compass": compass, "home trail": by_trail, "no cue": lost}


def measured(seeds: int) -> dict[str, np.ndarray]:
    """Return the deliveries of each model, by episode and seed."""
    return {
        name: Colony(WORLD, task, LEARNING, range(seeds), ANTS).run(EPISODES, TICKS).deliveries
        for name, task in models().items()
    }


def main() -> None:
    """Run all models, and write the figure and the table."""
    parser = ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=24, help="number of colonies of each model")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder of the files")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    rows = ["model,deliveries,ci_low,ci_high"]
    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    for name, deliveries in measured(given.seeds).items():
        low, high = bootstrap_interval(deliveries)
        axes.plot(deliveries.mean(axis=1), label=name)
        axes.fill_between(range(EPISODES), low, high, alpha=0.3, linewidth=0)
        last = deliveries[-5:].mean(axis=0, keepdims=True)
        (low,), (high,) = bootstrap_interval(last)
        rows.append(f"{name},{last.mean():.1f},{low:.1f},{high:.1f}")
    axes.set(xlabel="episode", ylabel=f"deliveries in {TICKS} ticks", ylim=(0, None))
    axes.legend()
    figure.savefig(given.out / "home_trail.png", dpi=150)
    (given.out / "home_trail.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    print(*rows, sep="\n")


if __name__ == "__main__":
    main()
