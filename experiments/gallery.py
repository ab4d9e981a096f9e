"""Makes the pictures of the README: a still, short animations and a policy sheet.

Each is made by `render.py`; the arguments below can be given to it by hand as well.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from taichi_ants.command_line import Parser, run_command
from taichi_ants.commands import render

_MAP = str(Path(__file__).parent / "maps" / "garden.txt")

_COLONY = [
    *("--show", "colony", "--world", "open", "--world-seed", "3", "--seed", "1"),
    *("--learning-rate", "0.01", "--epsilon", "0.05"),
    *("--title", "a colony that learned together"),
]
GALLERY: dict[str, list[str]] = {
    "still.png": [*_COLONY, "--step", "400"],
    "colony.gif": [
        *(*_COLONY, "--max-steps", "300", "--every", "6", "--fps", "10"),
        *("--size", "800x450", "--no-legend"),
    ],
    "episode.gif": [
        *("--world", _MAP, "--size", "960x540", "--fps", "4"),
        *("--title", "SARSA in a garden"),
    ],
    # Seed 7 is worth a look: after 10 episodes the ant has learned that steps towards the queen
    # pay, but not yet to give the food away, and circles beside her.
    "learning.gif": [
        *("--show", "learning", "--seed", "7", "--max-steps", "100"),
        *("--size", "1200x420", "--fps", "12"),
        *("--title", "SARSA: the same ant before and after learning"),
    ],
    "policy_sheet.png": [
        *("--show", "sheet", "--seed", "7"),
        *("--title", "What SARSA has learned in the world of the paper, after 500 episodes"),
    ],
}


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    parser = Parser(__doc__.split("\n", 1)[0])
    default = Path(__file__).parents[1] / "renders"
    parser.add_argument("--folder", type=Path, default=default, help="where to put them")
    return parser.parse_args(arguments)


def make_gallery(folder: Path) -> None:
    """Make all pictures; the ones that exist are replaced."""
    for name, arguments in GALLERY.items():
        render.show(render.parse_arguments([*arguments, "--out", str(folder / name)]))


if __name__ == "__main__":
    run_command(lambda: make_gallery(parse_arguments().folder))
