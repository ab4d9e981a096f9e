"""Compare the rules and observations that a file registers with the plain reference, bit by bit.

The command loads a Python file, and compares each of its rules in kernels with its Python function,
for drawn inputs and in drawn colonies, and each of its observations in drawn colonies. It prints a
line for each, and exits with status 1 if one differs. See docs/rules.md.
"""

from __future__ import annotations

import argparse
import sys
from itertools import chain

from taichi_ants.studies import command_line
from taichi_ants.studies.command_line import whole_number


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    parser.add_argument("file", metavar="FILE", help="Python file with rules or observations")
    many = whole_number(1, 1_000_000)
    about = "number of drawn inputs"
    parser.add_argument("--inputs", type=many, default=4000, metavar="N", help=about)
    settings, _ = parser.parse_given(arguments)
    return settings


def check_rules(settings: argparse.Namespace) -> None:
    """Check all rules and observations of the file."""
    from taichi_ants import rules
    from taichi_ants.errors import AntsError
    from taichi_ants.task import observations
    from taichi_ants.testing import check_observation, check_rule

    built_in = observations.names()
    command_line.load_plugin(settings.file)
    own = [name for name in observations.names() if name not in built_in]
    if not rules.names() and not own:
        raise AntsError(
            f"the file {settings.file!r} registers no rules or observations; register one with "
            "taichi_ants.rules.register or taichi_ants.task.observations.register."
        )
    differs = False
    checks = chain(
        (check_rule(name, settings.inputs) for name in rules.names()),
        (check_observation(name) for name in own),
    )
    for check in checks:
        print(check, flush=True)
        differs |= bool(check.difference)
    if differs:
        sys.exit(1)


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    command_line.run_command(lambda: check_rules(parse_arguments(arguments)))
