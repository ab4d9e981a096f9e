"""Try the rules, observations and learners that a file registers.

The command loads a Python file. It compares each rule in kernels with its Python twin, for drawn
inputs and in drawn colonies, and each observation in drawn colonies, bit by bit. Each learner
learns for 2000 steps while Taichi checks indices. The command prints a line for each, and exits
with status 1 if one has a fault. See docs/rules.md and docs/learners.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from itertools import chain

from taichi_ants.studies import command_line
from taichi_ants.studies.command_line import whole_number


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    parser.add_argument(
        "file", metavar="FILE", help="Python file with rules, observations or learners"
    )
    many = whole_number(1, 1_000_000)
    about = "number of drawn inputs of each rule"
    parser.add_argument("--inputs", type=many, default=4000, metavar="N", help=about)
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Try everything that the file registers."""
    from taichi_ants import learners, rules
    from taichi_ants.errors import AntsError
    from taichi_ants.studies.plugins import load_plugin
    from taichi_ants.task import observations

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
    for line, fault in _results(new[0], new[1], new[2], settings.inputs):
        print(line, flush=True)
        has_fault |= bool(fault)
    if has_fault:
        sys.exit(1)


def _results(
    rules: list[str], observations: list[str], learners: list[str], inputs: int
) -> Iterator[tuple[str, str]]:
    """Yield a line and a fault, or an empty string, for each name."""
    from taichi_ants.testing import check_learner, check_observation, check_rule

    of_rules = (check_rule(name, inputs) for name in rules)
    for comparison in chain(of_rules, map(check_observation, observations)):
        yield str(comparison), comparison.difference
    for name in learners:
        fault = check_learner(name)
        yield f"{name}: 2000 steps: {fault or 'no fault'}", fault
