"""Watch and change ants in a browser while they run.

See `watch.py --help` for the options, and docs/how-to/colonies.md for the page.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("watch")
