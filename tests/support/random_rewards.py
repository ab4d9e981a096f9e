"""Random tables of rewards."""

import numpy as np

from taichi_ants.task.constants import MOST_REWARD
from taichi_ants.task.rewards import Rewards

# Tables that reveal code which recognises an event by its reward.
TELLING = (
    Rewards(pick_up=10),
    Rewards(failed=10, empty=10, shaping=10),
    Rewards(deliver=0),
    Rewards(shaping=7, empty=-3),
    Rewards(*[MOST_REWARD] * 5),
    Rewards(*[-MOST_REWARD] * 5),
)


def random_rewards(seed: int) -> Rewards:
    """Return the paper's rewards, one of `TELLING`, or random numbers from -1000 to 1000."""
    rng = np.random.default_rng([seed, 5])
    drawn = Rewards(*rng.integers(-MOST_REWARD, MOST_REWARD + 1, 5).tolist())
    return (Rewards(), TELLING[seed % len(TELLING)], drawn)[rng.integers(3)]
