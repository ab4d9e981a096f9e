"""Ants that one watches and changes while they run, in a browser.

`watch.py --help` tells the options; docs/watching.md tells what the page can do.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("watch")
