"""Colonies on a double bridge: does the shorter branch win?

python experiments/bridge.py --quick
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("bridge")
