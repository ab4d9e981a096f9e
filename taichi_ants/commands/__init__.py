"""The command lines: one file each, run as `taichi-ants NAME`, or by a script in `experiments/`."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module

import taichi_ants
from taichi_ants.studies.interruption import stoppable

COMMANDS = {  # modules beside this one, and what they do
    "compare": "the paper's comparison of learners, over many seeds",
    "colony": "the scaling study of the colony, or one colony of any size",
    "bridge": "colonies on a double bridge, where the shorter branch wins",
    "sweep": "any settings against any measure, from a file",
    "render": "pictures of ants: an episode, a colony, learning, a policy",
    "watch": "ants that one watches and changes while they run, in a browser",
}


def run(
    name: str, arguments: Sequence[str] | None = None, program: str | None = None, **more: object
) -> None:
    """Run a command to its exit; it can be stopped while it is imported, too.

    Its --help calls it `program`, by default the name of the script. `more` are further arguments
    of its `main`.
    """
    # Commands share out the cores themselves; more threads of the library for matrices only get in
    # their way. It asks when NumPy is imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with stoppable():
        from taichi_ants.studies.command_line import Parser

        Parser.program = program
        import_module(f"{__name__}.{name}").main(arguments, **more)


def main() -> None:
    """The command line `taichi-ants`."""
    name, *arguments = sys.argv[1:] or ["--help"]
    if name in COMMANDS:
        run(name, arguments, f"taichi-ants {name}")
    elif name in ("-h", "--help"):
        print("usage: taichi-ants COMMAND ...\n")
        print("Ants on a hexagonal grid that lay pheromone trails and learn by reinforcement.\n")
        for command, summary in COMMANDS.items():
            print(f"  {command:9} {summary}")
        print("\n`taichi-ants COMMAND --help` tells the rest.")
    elif name == "--version":
        print(f"taichi-ants {taichi_ants.__version__}")
    else:
        known = ", ".join(COMMANDS)
        print(f"error: there is no command {name!r}; choose one of {known}.", file=sys.stderr)
        sys.exit(2)
