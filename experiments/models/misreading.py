"""Find the rate of misread cells at which trails no longer help ants that forage.

For each rate, ants learn to forage together, once with trails and once without, each in the world
of its seed. Then they follow what they learned. The table has deliveries per 1000 ticks with and
without trails, and the difference, paired by seed. See docs/models/misreading.md.
"""

from dataclasses import replace

import model_script
import numpy as np

from taichi_ants import Colony, TrainingConfig, task
from taichi_ants.studies.command_line import progress_bar
from taichi_ants.task import Life, Noise
from taichi_ants.worlds import open_world

RATES = (0.0, 0.01, 0.03, 0.1, 0.2, 0.4)
ANTS, EPISODES, TICKS, RANGES = 64, 40, 1000, (24, 24, 24)
LEARNING = TrainingConfig("sarsa", 0.1, 0.9, epsilon=0.3, epsilon_decay=0.9, min_epsilon=0.01)
FORAGING = replace(task.foraging(), delivery="truncates", life=Life(regrowth=0))
RULES = {"with trails": FORAGING, "without": FORAGING.replace(pheromone={"deposit": "none"})}


def deliveries(rules, rate, seeds):
    """Return the deliveries per 1000 ticks of ants that have learned, float (seeds,)."""
    places = [open_world(seed, RANGES) for seed in seeds]
    noisy = replace(rules, noise=Noise(misread=rate))
    colony = Colony(places, noisy, LEARNING, seeds, ANTS)
    colony.run(EPISODES, TICKS)
    calm, others = replace(LEARNING, epsilon=0.01), [1000 + seed for seed in seeds]
    options = {"sharing": "frozen", "q_values": colony.q_values}
    followers = Colony(places, noisy, calm, others, ANTS, **options)
    return followers.run(2, TICKS).deliveries.mean(axis=0) * 1000 / TICKS


def measure(seeds):
    """Return the deliveries with and without trails for each rate, and their difference."""
    found, numbers = {name: [] for name in RULES}, []
    with progress_bar("Colonies that misread") as progress:
        for done, rate in enumerate(RATES, start=1):
            for name, rules in RULES.items():
                found[name].append(deliveries(rules, rate, seeds))
            each = (of_rate[-1].tolist() for of_rate in found.values())
            for seed, *both in zip(seeds, *each, strict=True):
                row = {"misread": rate, "seed": seed, **dict(zip(RULES, both, strict=True))}
                numbers.append({**row, "difference": both[0] - both[1]})
            progress(done / len(RATES))
    summary = [{name: row[name] for name in row if name != "seed"} for row in numbers]

    def draw(axes):
        for name, by_rate in found.items():
            model_script.band(axes, RATES, np.transpose(by_rate), name, marker="o")
        axes.set(xlabel="probability of misreading a cell", ylabel="deliveries per 1000 ticks")

    title = "Trails help less, the more cells ants misread"
    caption = f"Means over {len(seeds)} seeds with 95 % intervals; {ANTS} ants."
    return numbers, summary, title, draw, caption


if __name__ == "__main__":
    model_script.run(__file__, __doc__, measure)
