"""The rules: observations, actions, pheromone and rewards of ants."""

from taichi_ants.features.castes import Caste
from taichi_ants.features.choice import Choice
from taichi_ants.features.fields import Field
from taichi_ants.features.foods import Food
from taichi_ants.features.labour import Labour, Threshold
from taichi_ants.features.life import Life
from taichi_ants.features.noise import Noise
from taichi_ants.features.pheromone import Pheromone
from taichi_ants.task.observations import Observation
from taichi_ants.task.rewards import Rewards
from taichi_ants.task.task import Task, Traffic, fetching, foraging, paper, queueing

__all__ = [
    "Caste", "Choice", "Field", "Food", "Labour", "Life", "Noise", "Observation", "Pheromone",
    "Rewards", "Task", "Threshold", "Traffic", "fetching", "foraging", "paper", "queueing",
]  # fmt: skip
__dir__ = __all__.copy  # completion lists only public names
