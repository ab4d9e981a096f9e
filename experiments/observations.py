"""What ants gain from seeing more: all learners with all observations, at equal steps.

python experiments/observations.py
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("observations")
