"""Measure how a colony recovers after a share of its ants is removed.

Ants follow the hand-written policy. The queen turns food into ants, which live for 1000 ticks.
After 2000 ticks, a share of the ants is removed. The colony has recovered when it has at least 95 %
of the ants of the same colony without the removal. See docs/models/recovery.md.
"""

import model_script
import numpy as np

from taichi_ants import Colony, Interventions, TrainingConfig, task, worlds
from taichi_ants.interventions import RemoveAnts
from taichi_ants.learners.policies import trail_follower

RULES = task.foraging().replace(life={"births": True, "lifespan": 1000, "regrowth": 0})
SHARES, REMOVAL, TICKS, STEP = (0.0, 0.25, 0.5, 0.75), 2000, 4000, 50


def ants_over_time(seeds, share):
    """Return the number of ants every STEP ticks, (seeds, times)."""
    places = [worlds.open_world(seed, (20, 20, 20)) for seed in seeds]
    follow = TrainingConfig.frozen(epsilon=0.05)
    options = {"capacity": 200, "sharing": "frozen", "q_values": trail_follower("ants")}
    colony, counts = Colony(places, RULES, follow, seeds, ants=32, **options), []
    colony.begin_episode()
    for tick in range(0, TICKS, STEP):
        if tick == REMOVAL:
            Interventions(colony).apply(RemoveAnts(share=share))
        counts.append(colony.living.sum(axis=1))
        colony.tick(STEP)
    return np.transpose(counts)


def measure(seeds):
    """Return the number of ants for each share, and the time to recover."""
    ants = {share: ants_over_time(seeds, share) for share in SHARES}
    numbers, summary = [], []
    for share, counts in ants.items():
        for seed, of_seed in zip(seeds, counts, strict=True):
            for step, n in enumerate(of_seed.tolist()):
                numbers.append({"removed": share, "seed": seed, "tick": step * STEP, "ants": n})
        back = (counts >= 0.95 * ants[0.0])[:, REMOVAL // STEP :]
        ticks = np.where(back.any(axis=1), back.argmax(axis=1), back.shape[1]) * STEP
        summary += [{"share removed": share, "ticks to recover": n} for n in ticks.tolist()]

    def draw(axes):
        for share, counts in ants.items():
            model_script.band(axes, np.arange(0, TICKS, STEP), counts, f"{share:.0%} removed")
        axes.set(xlabel="tick", ylabel="living ants", ylim=(0, None))

    title = "Ants of a colony from which a share is removed after 2000 ticks"
    return numbers, summary, title, draw


if __name__ == "__main__":
    model_script.run(__file__, __doc__, measure)
