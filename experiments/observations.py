"""Compare what ants gain from each observation, with several learners and equal numbers of ticks.

One ant learns alone with every learner, and 16 ants learn into one table with every learner that
can share it. The sweep is experiments/sweeps/observations.toml. For your own sweep, copy and change
that file, and run it with experiments/sweep.py. See docs/sweep_results.md.
"""

from pathlib import Path

from taichi_ants.commands import run

SWEEP = Path(__file__).parent / "sweeps" / "observations.toml"

if __name__ == "__main__":
    run("sweep", file=SWEEP, about=__doc__)
