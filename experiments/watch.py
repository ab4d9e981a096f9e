"""Watch and change ants in a browser while they run.

See `watch.py --help` for the options, and docs/watching.md for the page.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("watch")
