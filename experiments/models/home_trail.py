"""Measure how well ants without a compass find home by a second trail.

Ants lay the field "home" while they are without food. It is strongest near the nest, because
deposits fade with the time since an ant left it. Ants with food follow it in place of the compass.
See docs/models/home_trail.md.
"""

import model_script
import numpy as np

from taichi_ants import Colony, Field, TrainingConfig, worlds
from taichi_ants.task import foraging

WORLD = worlds.open_world(seed=1, ranges=(20, 20, 20))
EPISODES, TICKS, ANTS = 30, 1000, 32
LEARNING = TrainingConfig(
    "sarsa", 0.1, 0.9, 0.3, 0.9, learning_rate_decay=0.9, min_learning_rate=0.01, initial_q=5.0
)
COMPASS = foraging().replace(delivery="truncates", life={"regrowth": 0})
HOME = Field(deposit="fading", level=500, slope=10, view="strongest", deposited_when="without_food")
HOME_TRAIL = COMPASS.replace(fields={"home": HOME}, homing_cue="home")
NO_CUE = HOME_TRAIL.replace(fields={"home": {"deposited_when": "never"}})
MODELS = {"compass": COMPASS, "home trail": HOME_TRAIL, "no cue": NO_CUE}


def measure(seeds):
    """Return the deliveries of each model, and their means over the last five episodes."""
    numbers, summary, curves = [], [], {}
    for name, task in MODELS.items():
        deliveries = Colony(WORLD, task, LEARNING, seeds, ANTS).run(EPISODES, TICKS).deliveries
        for seed, of_seed in zip(seeds, deliveries.T.tolist(), strict=True):
            for episode, delivered in enumerate(of_seed):
                row = {"model": name, "seed": seed, "episode": episode}
                numbers.append({**row, "deliveries": delivered})
            summary.append({"ants with food see": name, "deliveries": np.mean(of_seed[-5:])})
        curves[name] = deliveries.T

    def draw(axes):
        for name, deliveries in curves.items():
            model_script.band(axes, np.arange(EPISODES), deliveries, name)
        axes.set(xlabel="episode", ylabel=f"deliveries in {TICKS} ticks", ylim=(0, None))

    title = "Deliveries of ants with a compass, a second trail, or neither"
    return numbers, summary, title, draw


if __name__ == "__main__":
    model_script.run(__file__, __doc__, measure)
