"""Shards: parts of a study that were computed apart, joined into one folder."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, count
from taichi_ants.files.results import (
    BLOCKS,
    MANIFEST,
    UNFINISHED,
    ResultFolder,
    manifest_in,
    seconds_of,
    seeds_by_point,
)
from taichi_ants.studies.blocks import Blocks

_OF_TIME = "seconds"  # the array that differs from run to run


def join(folders: Sequence[Path], out: Path, replace: bool = False) -> dict[str, Any]:
    """Copy the blocks of shards into the unfinished work of one folder.

    With `replace`, other results and other unfinished work in `out` are replaced.

    Returns:
        The manifest of the first shard.

    Raises:
        AntsError: A folder is not a shard, settings differ, a block is damaged, runs are missing,
            shards contain different results of the same run, or `out` cannot be written.
    """
    manifests = [_manifest_of(folder) for folder in folders]
    first = manifests[0]
    for folder, manifest in zip(folders, manifests, strict=True):
        _check_same(folders[0], first, folder, manifest)
    shards = [Blocks(folder / UNFINISHED / BLOCKS, drops=False) for folder in folders]
    for folder, shard in zip(folders, shards, strict=True):
        if damaged := shard.damaged():
            raise AntsError(
                f"{files.named(damaged[0])} is damaged; run the command of the shard in "
                f"{files.named(folder)} again, which computes such blocks again."
            )
    _check_complete(first, manifests, shards)
    _check_overlaps(first, folders, shards)
    runs, sizes = first["runs"], [len(names) for names in first["runs"]["seeds"]]
    runs = {**runs, "shard": [[0, sizes[n]] for n in runs["seeds_of"]]}  # of all shards
    place = ResultFolder(out, first["settings"], runs=runs)
    if not replace and place.is_finished():
        raise AntsError(
            f"{str(out)!r} already has these results; choose another --out, or give --force."
        )
    seconds = sum(seconds_of(folder / UNFINISHED) for folder in folders)
    with place.work(replace, {"seconds": seconds}) as (blocks, _), files.writing(out):
        for folder in folders:
            for path in sorted((folder / UNFINISHED / BLOCKS).glob("*.npz")):
                with files.unfinished(blocks / path.name) as copy:
                    shutil.copyfile(path, copy)
                    os.replace(copy, blocks / path.name)
    has_parquet = any(one["options"].get("parquet") for one in manifests)
    return {**first, "options": {**first["options"], "parquet": has_parquet}}


def _manifest_of(folder: Path) -> dict[str, Any]:
    manifest = manifest_in(folder / UNFINISHED)
    if not manifest:
        what = "finished results" if (folder / MANIFEST).exists() else "no unfinished work"
        wrong = f"has {what}, not a shard" if folder.exists() else "does not exist"
        raise AntsError(f"{str(folder)!r} {wrong}; name folders made with --shard.")
    if not manifest.get("runs") or not manifest.get("command"):
        raise AntsError(
            f"{str(folder)!r} has unfinished work of a command without --shard; name folders made "
            "with --shard."
        )
    return manifest


def _check_same(first: Path, one: dict[str, Any], second: Path, other: dict[str, Any]) -> None:
    own, theirs = one["settings"], other["settings"]
    names = dict.fromkeys([*own, *theirs])
    different = [name for name in names if own.get(name) != theirs.get(name)]
    if one["command"] != other["command"]:
        different = ["command"]
    if different:
        raise AntsError(
            f"{str(first)!r} and {str(second)!r} are not shards of the same work "
            f"({', '.join(different)} differ); name shards of one command."
        )


def _check_complete(
    first: Mapping[str, Any], manifests: Sequence[Mapping[str, Any]], shards: Sequence[Blocks]
) -> None:
    wanted = seeds_by_point(first["runs"])
    runs = sum(map(len, wanted.values()))
    lacks = sum(
        not any(shard.has(point, seed) for shard in shards)
        for point, seeds in wanted.items()
        for seed in seeds
    )
    if not lacks:
        return
    given = [one["options"].get("shard") for one in manifests]
    totals = {one[1] for one in given if one}
    absent = [n for n in range(1, max(totals, default=0) + 1) if [n, max(totals)] not in given]
    which = (
        f"give shard {', '.join(map(str, absent))} of {max(totals)} too"
        if len(totals) == 1 and absent
        else "finish all shards with their commands"
    )
    raise AntsError(f"{lacks} of {count(runs, 'run')} are missing in these folders; {which}.")


def _check_overlaps(
    first: Mapping[str, Any], folders: Sequence[Path], shards: Sequence[Blocks]
) -> None:
    for number, (point, seeds) in enumerate(seeds_by_point(first["runs"]).items()):
        holders: dict[str, tuple[Path, Blocks]] = {}  # by seed
        for other, others in zip(folders, shards, strict=True):
            for seed in (one for one in seeds if others.has(point, one)):
                folder, shard = holders.setdefault(seed, (other, others))
                if shard is not others and not _are_same(
                    shard.read(point, [seed]), others.read(point, [seed])
                ):
                    raise AntsError(
                        f"{str(folder)!r} and {str(other)!r} have different results for "
                        f"{_words(first, number)}, seed {seed.partition('@')[0]}; find out which "
                        "are right, and leave the other folder out."
                    )


def _are_same(one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> bool:
    return one.keys() == other.keys() and all(
        np.array_equal(array, other[name], equal_nan=array.dtype.kind == "f")
        for name, array in one.items()
        if name != _OF_TIME
    )


def _words(manifest: Mapping[str, Any], place: int) -> str:
    """Return the settings of a point that vary, or its number."""
    several = manifest["settings"].get("vary")
    if not several:
        return f"point {place + 1}"
    row = manifest["runs"]["rows"].index(place)
    return ", ".join(f"{name} {value}" for name, value in several[row].items())
