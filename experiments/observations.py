"""Compare all pairs of an observation and a learner, after equal numbers of ticks.

The sweep is experiments/sweeps/observations.toml. For your own sweep, copy and change that file,
and run it with experiments/sweep.py. See docs/observations.md.
"""

from pathlib import Path

from taichi_ants.commands import run

SWEEP = Path(__file__).parent / "sweeps" / "observations.toml"

if __name__ == "__main__":
    run("sweep", file=SWEEP, about=__doc__)
