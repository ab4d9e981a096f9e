"""Sweep any settings of the world, the task, the learner or the colony, from a TOML file.

python experiments/sweep.py experiments/sweeps/learning_rates.toml
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("sweep")
