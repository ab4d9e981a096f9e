"""The commands, one file each; run them as `taichi-ants NAME`."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module

import taichi_ants
from taichi_ants.studies.interruption import stoppable

COMMANDS = {  # modules of this package with their help
    "colony": "run one colony of any size, or many in parallel",
    "sweep": "run every combination of the settings in a file, and compare them",
    "status": "show what is done in a folder of results, and how long is left",
    "tables": "write the tables of the runs that a folder of results has",
    "archive": "pack a finished study, with all that repeats it, into one file",
    "reproduce": "repeat the study in an archive, and compare all of its files",
    "render": "draw an episode or a colony",
    "check": "try the rules, observations and learners of a file",
    "watch": "watch and change ants in a browser while they run",
}


def run(name: str, arguments: Sequence[str] | None = None, program: str | None = None) -> None:
    """Run a command and exit; Ctrl-C also works during its imports.

    A command has the functions `parse_arguments` and `run`, and perhaps `STOPPED`, which it prints
    if a signal stops it. `program` is its name in --help, by default that of the script.
    """
    # Commands use all cores themselves, so OpenBLAS should not start threads; it reads this at the
    # import of NumPy.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with stoppable():
        from taichi_ants.studies.command_line import Parser, reporting

        Parser.program = program
        command = import_module(f"{__name__}.{name}")
        with reporting(getattr(command, "STOPPED", "Stopped.")):
            command.run(command.parse_arguments(arguments))


def main() -> None:
    """Run the command `taichi-ants`."""
    name, *arguments = sys.argv[1:] or ["--help"]
    if name in COMMANDS:
        run(name, arguments, f"taichi-ants {name}")
    elif name in ("-h", "--help"):
        print("usage: taichi-ants COMMAND ...\n")
        print("Simulate ants on a hexagonal grid that lay trails and learn by reinforcement.\n")
        for command, summary in COMMANDS.items():
            print(f"  {command:10} {summary}")
        print("\nRun `taichi-ants COMMAND --help` for the options of a command.")
    elif name == "--version":
        print(f"taichi-ants {taichi_ants.__version__}")
    else:
        known = ", ".join(COMMANDS)
        print(f"error: unknown command {name!r}; choose one of {known}.", file=sys.stderr)
        sys.exit(2)
