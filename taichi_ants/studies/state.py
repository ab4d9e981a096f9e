"""The state of a folder of results: what is done, what failed, and how long is left."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from taichi_ants import files
from taichi_ants.errors import AntsError, count
from taichi_ants.files.results import (
    BLOCKS,
    FAILED,
    UNFINISHED,
    manifest_in,
    seconds_of,
    start_of,
)
from taichi_ants.studies.blocks import Blocks


def state(folder: Path) -> Iterator[str]:
    """Yield lines about a folder of results.

    Raises:
        AntsError: The folder contains neither results nor unfinished work, or a manifest is
            damaged.
    """
    finished, unfinished = manifest_in(folder), manifest_in(folder / UNFINISHED)
    if not (finished or unfinished):
        raise AntsError(
            f"{files.named(folder)} has neither results nor unfinished work; name the folder of a "
            "study."
        )
    if finished:
        runs = finished.get("runs")
        several = count(len(list(_runs_of(runs))), "run") if runs else ""
        yield f"finished: results{several and f' with {several}'}, since {finished['finished']}"
    if unfinished:
        yield from _of_work(folder / UNFINISHED, unfinished)


def _of_work(folder: Path, manifest: Mapping[str, Any]) -> Iterator[str]:
    """Yield lines about unfinished work."""
    times: dict[Path, float] = {}  # by block
    for path in (folder / BLOCKS).rglob("*.npz"):
        with suppress(FileNotFoundError):  # the work has just finished
            times[path] = path.stat().st_mtime
    several = count(len(times), "block")
    if manifest.get("runs"):
        yield from _of_study(folder, manifest, times)
    else:
        yield f"unfinished: {several} done"
    with suppress(ValueError, TypeError):  # the file is missing or damaged; includes AntsError
        yield from (f"failed: {one}" for one in json.loads(files.read_text(folder / FAILED)))
    if times:
        yield f"last block: {_duration(max(0.0, time.time() - max(times.values())))} ago"


def _runs_of(runs: Mapping[str, Any]) -> Iterator[tuple[str, str, float]]:
    """Yield the point, seed and work of each run, from the result of `Study.runs`.

    Without its "shard", these are the runs of all shards.
    """
    ranges = runs["shard"] or [(0, None)] * len(runs["points"])
    columns = (runs[name] for name in ("points", "seeds_of", "weights"))
    for point, seeds, weight, (first, end) in zip(*columns, ranges, strict=True):
        for seed in runs["seeds"][seeds][first:end]:
            yield point, seed, weight


def _of_study(
    folder: Path, manifest: Mapping[str, Any], times: Mapping[Path, float]
) -> Iterator[str]:
    runs, blocks = list(_runs_of(manifest["runs"])), Blocks(folder / BLOCKS, drops=False)
    done = [run for run in runs if blocks.has(*run[:2])]
    work, total = (sum(weight for *_, weight in some) for some in (done, runs))
    several = count(len(times), "block")
    shard = manifest.get("options", {}).get("shard")
    part = f"shard {shard[0]} of {shard[1]}, " if shard else ""
    every = list(_runs_of({**manifest["runs"], "shard": None})) if shard else runs
    here = sum(blocks.has(*run[:2]) for run in every) if shard else len(done)
    others = f"of all shards: {here} of {count(len(every), 'run')} done in this folder"
    if shard and len(done) == len(runs):
        yield f"finished: {part}{count(len(runs), 'run')}, in {several}"
        yield from [others] if here > len(done) else []
        return
    yield (
        f"unfinished: {part}{len(done)} of {count(len(runs), 'run')} done "
        f"({100 * work / max(total, 1e-9):.0f} % of the work), in {several}"
    )
    yield from [others] if here > len(done) else []
    # The speed of the process that worked last, or of all of them before it has finished a block.
    started = start_of(folder)
    when = [times.get(blocks.path_of(*run[:2]) or folder, 0.0) for run in done]
    new = sum(run[2] for run, at in zip(done, when, strict=True) if at > started)
    seconds = max(when) - started if new else seconds_of(folder)
    if seconds > 0 and total > work:
        yield f"left: about {_duration((total - work) * seconds / (new or work))}"


def _duration(seconds: float) -> str:
    for size, unit in ((86400, "day"), (3600, "hour"), (60, "minute")):
        if seconds >= 2 * size:
            return count(round(seconds / size), unit)
    return count(round(seconds), "second")
