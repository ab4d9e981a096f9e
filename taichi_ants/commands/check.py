"""Try the rules, observations and learners that a file registers.

The command loads a Python file. It compares each rule in kernels with its Python twin, for drawn
inputs and in drawn colonies, and each observation in drawn colonies, bit by bit. Each learner
learns for 2000 steps while Taichi checks indices. The command prints a line for each, and exits
with status 1 if one has a fault. See docs/how-to/models.md.
"""

import argparse
from itertools import chain

from taichi_ants.studies import command_line


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    about = "Python file with rules, observations or learners"
    parser.add_argument("file", metavar="FILE", help=about)
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Try everything that the file registers."""
    from taichi_ants import learners, rules
    from taichi_ants.engines.learner_check import fault_of
    from taichi_ants.errors import AntsError
    from taichi_ants.studies.plugins import load_plugin
    from taichi_ants.task import observations
    from taichi_ants.testing import check_observation, check_rule

    registries = rules, observations, learners
    before = [set(registry.names()) for registry in registries]
    load_plugin(settings.file)
    new = [
        [name for name in registry.names() if name not in known]
        for registry, known in zip(registries, before, strict=True)
    ]
    if not any(new):
        raise AntsError(
            f"the file {settings.file!r} registers no rules, observations or learners; register "
            "one, for example with taichi_ants.rules.register."
        )
    has_fault = False
    for comparison in chain(map(check_rule, new[0]), map(check_observation, new[1])):
        print(comparison, flush=True)
        has_fault |= bool(comparison.difference)
    for name in new[2]:
        fault = fault_of(learners.get(name))
        print(f"{name}: 2000 steps: {fault or 'no fault'}", flush=True)
        has_fault |= bool(fault)
    if has_fault:
        raise SystemExit(1)
