"""Folders of results: a command computes the results, or shows those that the folder has."""

from __future__ import annotations

import hashlib
import itertools
import re
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from operator import methodcaller
from pathlib import Path
from typing import Any, TypeVar

from taichi_ants import files
from taichi_ants.analysis import style
from taichi_ants.files.results import (
    FAILED,
    INPUTS,
    MANIFEST,
    PAGE,
    REPORT,
    UNFINISHED,
    ResultFolder,
    read_manifest,
    seeds_by_point,
)
from taichi_ants.studies.blocks import Blocks
from taichi_ants.studies.command_line import read_plugin
from taichi_ants.studies.provenance import provenance
from taichi_ants.studies.runner import FailedBlocksError, Study

# Options that do not determine results, and the text of a sweep file, which is an input.
_OF_THE_RUN = ("out", "force", "shard", "workers", "threads", "ray", "text", "command")
Results = TypeVar("Results")
# (folder of results, results if just computed, manifest) -> HTML
Pages = Callable[[Path, Results | None, Mapping[str, Any]], str]
# (folder of finished results, their `Study.runs` if any, blocks to which it adds them)
Take = Callable[[Path, Mapping[str, Any], Blocks], None]


def work_or_show(
    settings: Namespace,
    determines: Mapping[str, Any],
    work: Callable[[Path, Path], Results],
    leading: Sequence[str] = (),
    page: Pages[Results] | None = None,
    study: Study[Any] | None = None,
    take: Take | None = None,
    inputs: Mapping[str, bytes] | None = None,
    as_parquet: Callable[[Path, Path], None] | None = None,
) -> None:
    """Compute the results of a command unless its folder has them, and print the report.

    Args:
        settings: The command's `out`, `force`, `no_figures`, `plugin` and `arch`.
        determines: Everything else that determines the results.
        work: A function of two folders, for blocks and for results; it writes the report.
        leading: The argument of `ResultFolder`, whose errors are raised.
        page: A function that makes the page; a missing page is made again.
        study: The study that `work` computes, if any.
        take: A function that writes the blocks of finished results that are a part of the study.
        inputs: The contents of the files that the study has read, by path, except the plugin and
            the sweep file. The results contain copies of them.
        as_parquet: A function that writes Parquet files from the tables in a folder of results to
            another folder, for the command's option `parquet`.
    """
    code, text = read_plugin(settings.plugin), getattr(settings, "text", None)
    sweep = {} if text is None else {str(settings.file): text.encode()}
    given = {**(inputs or {}), **sweep, **code}
    plugin = hashlib.sha256(b"\0".join(code.values())).hexdigest() if code else None
    facts = {**determines, "arch": settings.arch, "plugin": plugin}
    shard = getattr(settings, "shard", None)
    runs = study.runs(shard or (1, 1)) if study else None
    folder = ResultFolder(settings.out, facts, leading, runs, take is not None)
    is_finished = not settings.force and folder.is_finished()
    if is_finished and (shard or folder.has_other_work() or not _lacks(settings, folder)):
        _show(settings, folder, page)
    else:
        began = time.perf_counter()
        with folder.work(settings.force, _asked(settings)) as (blocks, ready):
            if take and not settings.force and (part := folder.part()):
                _take(folder, part, take, blocks)
            with _noting_failures(blocks.parent / FAILED):
                results = work(blocks, ready)
            if shard:
                print(_of_shard(settings, *shard))
                return
            report = files.read_text(ready / REPORT)
            seconds = folder.seconds_before + time.perf_counter() - began
            figures = not settings.no_figures and any(ready.rglob("*.png"))
            made = provenance(sys.argv) | {"seconds": seconds, "figures": figures}
            if as_parquet and settings.parquet:
                as_parquet(ready, ready)
            made |= {"asked": _again(settings), "inputs": _copied(given, ready)}
            if page:
                with style.all_or_none(ready / PAGE):
                    files.write_text(ready / PAGE, page(ready, results, made))
            folder.publish(ready, made)
        print(f"{report}\n{seconds:.1f} s; all results are in {settings.out}/")
    if page:
        print(settings.out / PAGE)


def _lacks(settings: Namespace, folder: ResultFolder) -> bool:
    """Return whether finished results lack figures or tables that they can get without new runs.

    If so, the settings include what the results have.
    """
    part = folder.part()
    if not part:
        return False
    figures, options = part["figures"], part["asked"]["options"]
    parquet = options.get("parquet", False)
    missing = any(
        name.endswith(".parquet") and not (settings.out / name).exists() for name in part["files"]
    )
    lacks = not (settings.no_figures or figures)
    lacks |= getattr(settings, "parquet", False) and (missing or not parquet)
    if lacks:
        settings.no_figures = settings.no_figures and not figures
        settings.parquet = getattr(settings, "parquet", False) or parquet
    return lacks


def _asked(settings: Namespace) -> dict[str, Any]:
    """Return what `merge` needs to run a command again, for the manifest of unfinished work."""
    return {"command": getattr(settings, "command", None), "options": vars(settings)}


def _again(settings: Namespace) -> dict[str, Any]:
    """Return the command and those options that determine results, for the manifest of results."""
    asked = _asked(settings)
    options = {n: value for n, value in asked["options"].items() if n not in _OF_THE_RUN}
    return {**asked, "options": options}


def _copied(inputs: Mapping[str, bytes], folder: Path) -> dict[str, str]:
    """Write copies of inputs to a folder of results; return their names there, by path."""
    names: dict[str, str] = {}
    for path in inputs:
        base = re.sub(r"[^\w.-]", "_", Path(path).name)
        numbered = (f"{INPUTS}/{f'{n}-' if n > 1 else ''}{base}" for n in itertools.count(1))
        names[path] = next(name for name in numbered if name not in names.values())
    for path, name in names.items():
        files.check_writable_folder(folder / INPUTS)
        files.write_atomically(folder / name, methodcaller("write", inputs[path]))
    return names


def _take(folder: ResultFolder, part: Mapping[str, Any], take: Take, blocks: Path) -> None:
    """Write the blocks of finished results, unless a process that was killed has done that."""
    saved, runs = Blocks(blocks), part.get("runs", {})
    wanted = seeds_by_point(runs).items() if runs else ()
    if not wanted or not all(saved.has(point, seed) for point, seeds in wanted for seed in seeds):
        folder.check(may_lack=[n for n in part["files"] if n.endswith((".png", ".parquet"))])
        take(folder.path, runs, saved)
        (blocks.parent / MANIFEST).touch()  # now the work begins: `status` measures its speed


@contextmanager
def _noting_failures(path: Path) -> Iterator[None]:
    """Write the failed blocks of a study to a file, for `status`."""
    path.unlink(missing_ok=True)
    try:
        yield
    except FailedBlocksError as error:
        files.write_text(path, files.to_json(error.several, indent=2))
        raise


def _of_shard(settings: Namespace, number: int, shards: int) -> str:
    return (
        f"Shard {number} of {shards} is finished in {settings.out}/; when all shards are finished, "
        "join them with `taichi-ants merge FOLDER ... --out FOLDER`."
    )


def _show(settings: Namespace, folder: ResultFolder, page: Pages[Results] | None) -> None:
    """Print the report of finished results, and make a missing page again."""
    folder.check(may_lack=[PAGE] if page else [])
    folder.tidy()
    manifest = read_manifest(settings.out)
    is_missing = not (settings.out / PAGE).exists()
    if page and is_missing:
        folder.add(PAGE, page(settings.out, None, manifest))
    print(files.read_text(settings.out / REPORT))
    print(f"{settings.out}/ already has these results; use --force to compute them again.")
    if folder.has_other_work():
        print(f"It also has unfinished work of other settings, in {settings.out / UNFINISHED}/.")
    if not (settings.no_figures or manifest["figures"]):
        print("They have no figures; use --force to draw figures.")
    if page and is_missing:
        print(f"{PAGE} was missing and has been written again from the other files.")
