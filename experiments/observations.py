"""What ants gain from seeing more: all observations with all learners, at equal numbers of ticks.

python experiments/observations.py
"""

import sys
from pathlib import Path

from taichi_ants.commands import run

SWEEP = Path(__file__).parent / "sweeps" / "observations.toml"

if __name__ == "__main__":
    run("sweep", [str(SWEEP), *sys.argv[1:]])
