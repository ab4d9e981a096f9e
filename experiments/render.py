"""Pictures of ants: an episode, a colony, learning made visible, or a policy sheet.

`render.py episode --help` tells the options of an episode, and so on.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("render")
