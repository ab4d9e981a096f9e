"""Show what is done, what failed, and how long is left in folders of results.

The command reads only files, so it also works while another process, or another machine with the
same disk, computes. See docs/how-to/clusters.md.
"""

import argparse
import math
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from taichi_ants.errors import count
from taichi_ants.files import checksum_of_json
from taichi_ants.studies import command_line
from taichi_ants.studies.folder import MANIFEST, asked_in, json_in, sessions_in
from taichi_ants.studies.store import Store
from taichi_ants.studies.study import share_of


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help="folder of results")
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Print the state of each folder."""
    for folder in settings.folders:
        print(folder, *(f"  {line}" for line in status(folder)), sep="\n")


def status(folder: Path) -> Iterator[str]:
    """Yield lines about a folder of results; AntsError if it has no study, or a damaged one."""
    asked, store, sessions = asked_in(folder), Store(folder), sessions_in(folder)
    numbers, blocks = store.where(asked["points"], asked["seeds"], asked["arrays"])
    done, manifest = numbers >= 0, json_in(folder / MANIFEST)
    if done.all() and manifest and manifest.get("study") == checksum_of_json(asked):
        yield f"finished: results with {count(done.size, 'run')}, since {manifest['finished']}"
        return
    seconds = np.broadcast_to(np.array(asked["seconds"])[:, None], done.shape)
    share = 100 * seconds[done].sum() / seconds.sum()
    yield (
        f"unfinished: {done.sum()} of {count(done.size, 'run')} done ({share:.0f} % of the work), "
        f"in {count(len(np.unique(numbers[done])), 'block')}"
    )
    for number, shards in sorted({tuple(facts["shard"]) for facts in sessions} - {(1, 1)}):
        mine = share_of(seconds, asked["families"], number, shards)
        yield f"shard {number} of {shards}: {done[mine].sum()} of {count(mine.sum(), 'run')} done"
    times = np.array([block.path.stat().st_mtime for block in blocks] or [0.0])
    last = [{"began": math.inf, "failed": []}, *sessions][-1]
    new = done & (times[numbers] > last["began"])
    if new.any() and not done.all():
        speed = seconds[new].sum() / (times.max() - last["began"])
        yield f"left: about {_duration(seconds[~done].sum() / speed)}"
    yield from (f"failed: {block}" for block in last["failed"])
    if blocks:
        yield f"last block: {_duration(max(0.0, time.time() - times.max()))} ago"


def _duration(seconds: float) -> str:
    for size, unit in ((86400, "day"), (3600, "hour"), (60, "minute")):
        if seconds >= 2 * size:
            return count(round(seconds / size), unit)
    return count(round(seconds), "second")
