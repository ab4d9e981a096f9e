"""Measure how response thresholds divide labour between foragers and nurses.

The ants of a nest have different thresholds. The stimulus of the nest rises with its demand and
falls with each delivery. An idle ant (a nurse) starts foraging more often if the stimulus is high
and its threshold low. Foragers follow the hand-written policy. See
docs/models/division_of_labour.md.
"""

import model_script
import numpy as np

from taichi_ants import Colony, TrainingConfig, task, worlds
from taichi_ants.learners.policies import trail_follower
from taichi_ants.task import Labour, Threshold

ANTS, TICKS, STEP, RELIEF = 64, 4000, 50, 1
DEMANDS = (0.25, 0.5, 1.0, 2.0)  # units of stimulus per tick
WORKERS = {"worker": {"threshold": Threshold("lognormal", value=20, spread=1)}}
FOLLOW = TrainingConfig.frozen(epsilon=0.05)


def foraging_over_time(seeds, demand):
    """Return who forages every STEP ticks (seeds, times, ants), thresholds, and deliveries."""
    labour = Labour("thresholds", demand=demand, relief=RELIEF, stop_probability=0.2)
    rules = task.foraging().replace(castes=WORKERS, labour=labour, life={"regrowth": 0})
    world = worlds.open_world(seed=1, ranges=(20, 20, 20))
    options = {"sharing": "frozen", "q_values": trail_follower("ants"), "start": "spread"}
    colony, forages = Colony(world, rules, FOLLOW, seeds, ants=ANTS, **options), []
    colony.begin_episode()
    for _ in range(0, TICKS, STEP):
        colony.tick(STEP)
        forages.append(~colony.idle)
    return np.stack(forages, axis=1), colony.thresholds, colony.outcome().deliveries[0]


def measure(seeds):
    """Return the share of foragers over time, and how ants of low and high thresholds differ."""
    numbers, summary, shares = [], [], {}
    for demand in DEMANDS:
        forages, thresholds, deliveries = foraging_over_time(seeds, demand)
        shares[demand] = forages.mean(axis=2)
        for seed, share, of_ants, own, n in zip(
            seeds, shares[demand], forages.mean(axis=1), thresholds, deliveries, strict=True
        ):
            for step, one in enumerate(share.tolist(), start=1):
                numbers.append(
                    {"demand": demand, "seed": seed, "tick": step * STEP, "foragers": one}
                )
            low, _, high = np.array_split(of_ants[np.argsort(own)], 3)
            row = {"demand": demand, "foragers": share[len(share) // 2 :].mean()}
            row |= {"low thresholds": low.mean(), "high thresholds": high.mean()}
            summary.append({**row, "food per demand": n * RELIEF / (demand * TICKS)})

    def draw(axes):
        for demand, share in shares.items():
            model_script.band(axes, np.arange(STEP, TICKS + 1, STEP), share, f"demand {demand:g}")
        axes.set(xlabel="tick", ylabel="share of foragers", ylim=(0, 1))

    title = "Share of the ants that forage, by the demand of the nest"
    return numbers, summary, title, draw


if __name__ == "__main__":
    model_script.run(__file__, __doc__, measure)
