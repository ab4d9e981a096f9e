"""Repeat the paper's comparison of Q-learning, SARSA and Dyna-Q with many seeds.

python experiments/compare.py --quick
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("compare")
