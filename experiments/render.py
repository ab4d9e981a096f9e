"""Draw an episode or a colony.

See `render.py episode --help`, for example, for the options of an episode.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("render")
