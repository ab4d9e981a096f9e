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
    ROWS,
    UNFINISHED,
    manifest_in,
    seconds_of,
    start_of,
)
from taichi_ants.studies.blocks import Blocks
from taichi_ants.studies.search import COMPLETE, HELD_OUT_BLOCKS, TRIAL_BLOCKS, TRIALS

_FEW = 3  # trials of a search from which the time of the others is estimated


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
        runs, trials = finished.get("runs"), finished["settings"].get("search.trials")
        several = count(len(list(_runs_of(runs))), "run") if runs else ""
        several = count(trials, "trial") if trials else several
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
    elif "search.trials" in manifest["settings"]:
        yield from _of_search(folder, manifest["settings"], several)
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


def _of_search(folder: Path, settings: Mapping[str, Any], several: str) -> Iterator[str]:
    trials = settings["search.trials"]
    begun = sorted((folder / BLOCKS).glob(f"{TRIAL_BLOCKS}*"))
    compares = (folder / BLOCKS / HELD_OUT_BLOCKS).exists()
    done = trials if compares else int(begun[-1].name.removeprefix(TRIAL_BLOCKS)) if begun else 0
    more = ", and the comparison with held-out seeds has begun" if compares else ""
    yield f"unfinished: {done} of {count(trials, 'trial')} done, in {several}{more}"
    # The first trials include the start of the process, so they say little about the others.
    if _FEW <= done < trials and (seconds := seconds_of(folder)):
        seeds = settings["search.prune_after"] or len(settings["seeds"])
        runs = sum(len(list(one.iterdir())) for one in begun) * seeds
        left = runs / done * (trials - done) + 2 * len(settings["search.held_out"])
        yield f"left: about {_duration(seconds / runs * left)}"
    if (folder / ROWS / TRIALS).exists():
        minimises = "search.minimise" in settings
        measure = settings["search.minimise" if minimises else "search.maximise"]
        rows = files.read_csv(folder / ROWS / TRIALS)
        complete = [one for one in rows if one["state"] == COMPLETE]
        if complete:
            best = min(complete, key=lambda one: one[measure] * (1 if minimises else -1))
            yield f"best: trial {best['trial']:.0f}, {measure} {best[measure]:.4g}"


def _duration(seconds: float) -> str:
    for size, unit in ((86400, "day"), (3600, "hour"), (60, "minute")):
        if seconds >= 2 * size:
            return count(round(seconds / size), unit)
    return count(round(seconds), "second")
