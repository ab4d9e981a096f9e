"""The paper's comparison of Q-learning, SARSA and Dyna-Q, over many seeds, with honest statistics.

Trains every configuration with every seed, follows the final policies greedily, holds the outcome
against the paper and against exact bounds, and writes tables, figures and policies to a folder.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("compare")
