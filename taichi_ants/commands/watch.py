"""Watch a colony in a browser and change it while it runs.

The command prints the address of a page, which opens only on this machine. On the page, you choose
the world, the rules and the policy, run the colony, and place or remove rocks, food, trails and
ants. You can save the session, which replays bit for bit. To end, press Ctrl-C or choose "Quit the
server" on the page. See docs/how-to/colonies.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from taichi_ants.settings import flat
from taichi_ants.studies.command_line import PLUGIN, Parser, add_threads, progress_bar, whole_number
from taichi_ants.studies.interruption import held
from taichi_ants.studies.plugins import load_plugin
from taichi_ants.task import Life, queueing

if TYPE_CHECKING:
    from taichi_ants.learners.policies import Policy

_POLICIES = Path(__file__).parents[2] / "experiments" / "policies"  # of a clone
_LEADS = """<!doctype html>
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url=ADDRESS">
<title>Taichi Ants</title>
<a href="ADDRESS">Open the live page</a>
"""
START: dict[str, Any] = {
    **{"world": "far_piles", "map": "", "world_seed": 3, "size": 30, "policy": "learn sarsa"},
    **{"ants": 64, "seed": 0, "ticks": 1000},
    "settings": flat(replace(queueing(), life=Life(regrowth=0)).as_dict(), "task"),
}

# Steps of the first session before a page opens: twenty episodes, after which its ants deliver, and
# the ticks in which they lay lanes between the queen and the food.
LEARNED = 20 * (1000 + 1) + 300


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add, port = parser.add_argument, whole_number(0, 65535)
    about = "folder of results, of which --row plays a run, instead of the live page"
    add("folder", type=Path, nargs="?", metavar="FOLDER", help=about)
    about = "row of the table of runs to play, from 1: the first episode of its evaluation"
    add("--row", type=whole_number(1), metavar="N", help=about)
    files: dict[str, Any] = {"action": "extend", "nargs": "+", "default": [], "metavar": "FILE"}
    about = "policy files (.npz) to offer on the page, in addition to experiments/policies/"
    add("--policy", **files, help=about)
    add("--session", metavar="FILE", help="resume a saved session")
    add("--port", type=port, default=0, metavar="N", help="port of the page; 0 picks a free one")
    about = "do not open a browser (the default if the output is not a terminal)"
    add("--no-browser", action="store_true", help=about)
    add("--duration", type=whole_number(1), metavar="N", help="end after N seconds")
    add("--plugin", metavar="FILE", help=PLUGIN)
    add_threads(parser)
    settings = parser.parse_args(arguments)
    if (settings.folder is None) != (settings.row is None):
        parser.error("FOLDER and --row belong together, so give both or neither")
    return settings


def run(settings: argparse.Namespace) -> None:
    """Serve the page until the session ends, or play a row of a folder of results."""
    from taichi_ants import runtime
    from taichi_ants.live.choices import Choices
    from taichi_ants.live.server import SessionServer
    from taichi_ants.live.session import Session
    from taichi_ants.studies.replay import play

    if settings.folder is not None:
        play(settings.folder, settings.row, settings.threads)
        return
    load_plugin(settings.plugin)
    choices = Choices(policies(settings.policy))
    runtime.start(settings.threads)
    if settings.session:
        with progress_bar("Replaying") as progress:
            session = Session.load(settings.session, progress)
    else:
        session = Session(choices.setup(START))
        session.advance(LEARNED)
    prepare = partial(load_plugin, settings.plugin) if settings.plugin else None
    room = SessionServer(session, choices, settings.port, prepare, playing=not settings.session)
    print(f"{room.url}\nOpen this address; Ctrl-C ends.", flush=True)
    with ExitStack() as opened:
        if not settings.no_browser and sys.stdout.isatty():
            opened.enter_context(_opened(room.url))

        def each_turn() -> None:
            if stopped():
                room.end()
            if room.pages:
                opened.close()

        with held() as stopped:
            room.run(settings.duration, each_turn)
    print("Ended.")


def policies(given: list[str]) -> dict[str, Policy]:
    """Return the given policies and those in experiments/policies, by file name."""
    from taichi_ants import load_policy

    paths = [*sorted(_POLICIES.glob("*.npz")), *map(Path, given)]
    return {path.stem: load_policy(path) for path in paths}


@contextmanager
def _opened(url: str) -> Iterator[None]:
    """Open a browser, if possible, on a private temporary file that redirects to the address.

    Other users of the machine can read the browser's command line, but not this file.
    """
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        yield
        return
    with TemporaryDirectory(prefix="taichi-ants-") as folder:  # which only this user can enter
        path = Path(folder, "open.html")
        path.touch(0o600)
        path.write_text(_LEADS.replace("ADDRESS", url), encoding="utf-8")
        webbrowser.open(path.as_uri())
        yield
