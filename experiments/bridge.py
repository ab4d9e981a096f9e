"""Train colonies on a double bridge, and measure which branch they use.

python experiments/bridge.py --quick
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("bridge")
