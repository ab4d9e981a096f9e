"""The state of a folder of results: what is done, what failed, and how long is left."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from taichi_ants import files
from taichi_ants.errors import AntsError, count
from taichi_ants.files.results import BLOCKS, FAILED, MANIFEST, UNFINISHED, read_manifest
from taichi_ants.studies.blocks import Blocks


def state(folder: Path) -> Iterator[str]:
    """Yield lines about a folder of results.

    Raises:
        AntsError: The folder contains neither results nor unfinished work, or a manifest is
            damaged.
    """
    is_new = True
    if (folder / MANIFEST).exists():
        manifest = read_manifest(folder)
        runs = manifest.get("runs")
        several = f" with {count(len(list(_runs_of(runs))), 'run')}" if runs else ""
        yield f"finished: results{several}, since {manifest['finished']}"
        is_new = False
    if (folder / UNFINISHED / MANIFEST).exists():
        yield from _of_work(folder / UNFINISHED)
        is_new = False
    if is_new:
        raise AntsError(
            f"{str(folder)!r} has neither results nor unfinished work; name the folder of a study."
        )


def _runs_of(runs: Mapping[str, Any]) -> Iterator[tuple[str, str, float]]:
    """Yield the point, seed and work of each run, from the result of `Study.runs`."""
    columns = (runs[name] for name in ("points", "seeds_of", "weights", "shard"))
    for point, seeds, weight, (first, end) in zip(*columns, strict=True):
        for seed in runs["seeds"][seeds][first:end]:
            yield point, seed, weight


def _of_work(folder: Path) -> Iterator[str]:
    manifest, saved = read_manifest(folder), folder / BLOCKS
    paths = list(saved.glob("block-*.npz"))
    if not (several := manifest.get("runs")):
        yield f"unfinished: {count(len(list(saved.glob('*.npz'))), 'block')} done"
        return
    runs, blocks = list(_runs_of(several)), Blocks(saved, drops=False)
    done = [run for run in runs if blocks.has(*run[:2])]
    work, total = (sum(weight for *_, weight in some) for some in (done, runs))
    shard = manifest["options"].get("shard")
    part = f"shard {shard[0]} of {shard[1]}, " if shard else ""
    yield (
        f"unfinished: {part}{len(done)} of {count(len(runs), 'run')} done "
        f"({100 * work / max(total, 1e-9):.0f} % of the work), in {count(len(paths), 'block')}"
    )
    failed = json.loads(files.read_text(folder / FAILED)) if (folder / FAILED).exists() else []
    yield from (f"failed: {one}" for one in failed)
    yield from _of_time(folder, blocks, runs, total - work)


def _of_time(
    folder: Path, blocks: Blocks, runs: list[tuple[str, str, float]], left: float
) -> Iterator[str]:
    """Yield how long is left, at the speed of the process that worked last."""
    started = (folder / MANIFEST).stat().st_mtime
    times = {path: path.stat().st_mtime for path in (folder / BLOCKS).glob("block-*.npz")}
    last = max(times.values(), default=started)
    if left and last > started:
        new = 0.0
        for point, seed, weight in runs:
            path = blocks.path_of(point, seed)
            new += weight * (path is not None and times[path] > started)
        if new:
            yield f"left: about {_duration(left / new * (last - started))}"
    if times:
        yield f"last block: {_duration(max(0.0, time.time() - last))} ago"


def _duration(seconds: float) -> str:
    for size, unit in ((86400, "days"), (3600, "hours"), (60, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} seconds"
