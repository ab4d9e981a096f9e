"""Measure how two nests share one pile of food.

The pile lies between two queens, and its cells hold 20 loads each. All ants follow the hand-written
policy, and the ants of both nests follow and change the same trails. Both nests have as many ants.
A nest's share is its part of all loads delivered in 500 ticks. See docs/models/two_nests.md.
"""

import model_script
import numpy as np

from taichi_ants import Colony, TrainingConfig, World, task
from taichi_ants.learners.policies import trail_follower
from taichi_ants.task import Food

RULES = task.foraging().replace(foods={"seed": Food(loads=20)})
# The distances of the queens from the pile, in cells.
DISTANCES, TICKS, STEP = ((10, 10), (8, 12), (6, 14)), 500, 20
# The centre of the world and the cells around it, so that neither nest is nearer to an edge.
PILE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]


def deliveries_over_time(seeds, near, far):
    """Return the deliveries of both nests every STEP ticks, (seeds, times, nests)."""
    world = World((24, 24, 24), [(near, 0, 0), (0, far, far)], foods=PILE)
    follow = TrainingConfig.frozen(epsilon=0.05)
    options = {"sharing": "frozen", "q_values": trail_follower("ants")}
    colony, counts = Colony(world, RULES, follow, seeds, ants=64, **options), []
    colony.begin_episode()
    for _ in range(0, TICKS, STEP):
        colony.tick(STEP)
        counts.append(colony.outcome().nest_deliveries[0])
    return np.stack(counts, axis=1)


def measure(seeds):
    """Return the deliveries of both nests over time, and the share of the first."""
    numbers, summary, shares = [], [], {}
    for near, far in DISTANCES:
        case = f"{near} and {far} cells"
        deliveries = deliveries_over_time(seeds, near, far)
        for seed, of_seed in zip(seeds, deliveries.tolist(), strict=True):
            for step, (first, second) in enumerate(of_seed, start=1):
                row = {"near": near, "far": far, "seed": seed, "tick": step * STEP}
                numbers.append({**row, "first": first, "second": second})
        both = deliveries.sum(axis=2)
        with np.errstate(invalid="ignore"):  # before the first delivery, the share is not known
            shares[case] = deliveries[..., 0] / both
        for share, loads in zip(shares[case][:, -1], both[:, -1], strict=True):
            row = {"distances": case, "share of the first nest": share}
            summary.append({**row, "loads of both": loads})

    def draw(axes):
        for case, share in shares.items():
            known = np.isfinite(share).all(axis=0)  # in all colonies
            model_script.band(axes, np.arange(STEP, TICKS + 1, STEP)[known], share[:, known], case)
        axes.axhline(0.5, color="0.6", linewidth=0.8)
        axes.set(xlabel="tick", ylabel="share of the first nest", ylim=(0, 1))

    title = "Part of the loads that the first of two nests has delivered"
    return numbers, summary, title, draw


if __name__ == "__main__":
    model_script.run(__file__, __doc__, measure)
