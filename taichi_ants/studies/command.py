"""Studies as commands: what the options ask for is computed, or shown if it is there.

A study is a module of this package or a file (.py), which the folder of its results names. It has

    plan(options) -> Study, or an object whose attribute `study` is one
    tables(planned, results) -> str, which writes tables and figures, and returns the report

`options` are the command's own ones, as JSON has them. `planned` can have a method `facts`, whose
result adds to the settings in study.json. A file that does not change the meaning of its arrays
without raising its `VERSION` has that number; otherwise its text is a part of the keys of its runs.
"""

from __future__ import annotations

import itertools
import json
import re
import sys
import time
from argparse import Namespace
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.files.inputs import recorded, replaced
from taichi_ants.runtime import available_threads
from taichi_ants.studies import folder
from taichi_ants.studies.command_line import notice, progress_bar
from taichi_ants.studies.executors import Workers
from taichi_ants.studies.folder import INPUTS, PAGE, REPORT, Results
from taichi_ants.studies.plugins import Code, checksum_of, load_plugin, placed, read_plugin
from taichi_ants.studies.points import settings_of
from taichi_ants.studies.provenance import provenance
from taichi_ants.studies.store import DamagedError, Store
from taichi_ants.studies.study import Study, run

# Options of all studies, which `plan` does not get.
_OF_ALL = (
    *("out", "force", "no_figures", "parquet", "plugin"),
    *("arch", "threads", "workers", "ray", "shard"),
)


@dataclass(frozen=True)
class Planned:
    """A study that its module has planned, with the files that it has read.

    Attributes:
        module: The module, or its file.
        own: The object that `plan` has returned.
        code: The plugin and the file of the module, as far as there are any.
        inputs: The contents of all files that the study has read, by their places in a folder.
        facts: Facts from which `opened` plans the same study again.
    """

    module: Any
    own: Any
    study: Study
    code: list[Code]
    inputs: Mapping[str, bytes]
    facts: Mapping[str, Any]

    def asked(self) -> dict[str, Any]:
        """Return what the study asks for, as folders of results have it."""
        return folder.asked_of(self.study, self.facts)


def planned(module: str, options: Mapping[str, Any], plugin: str | None, arch: str) -> Planned:
    """Return the study of a module, a name or the path of a file, for some options.

    Raises:
        AntsError: A file cannot be read or run, or an option is not allowed.
    """
    file = module if module.endswith(".py") else None
    codes = {"plugin": read_plugin(plugin), "study": read_plugin(file)}
    with recorded() as read:
        load_plugin(plugin)
        loaded: Any = load_plugin(file) or import_module(module)
        own = loaded.plan(options)
        salt = [f"study {Path(module).stem}"]
        if file is not None:
            salt.append(str(getattr(loaded, "VERSION", checksum_of(codes["study"]))))
        if plugin is not None:
            salt.append(f"plugin {checksum_of(codes['plugin'])}")
        if arch != "cpu":  # whose last bits differ
            salt.append(arch)
        study = replace(getattr(own, "study", own), salt=tuple(salt))
        assert study.keys  # which read the files of policies
    inputs = {
        place.as_posix(): content
        for name, code in codes.items()
        for place, content in placed(code, Path(INPUTS, name)).items()
    }
    copies = dict[str, str]()
    for path, content in read.items():
        base = re.sub(r"[^\w.-]", "_", Path(path).name)
        names = (f"{INPUTS}/{f'{n}-' if n > 1 else ''}{base}" for n in itertools.count(1))
        copies[path] = next(name for name in names if name not in inputs)
        inputs[copies[path]] = content
    facts = {"module": module, "options": options, "plugin": plugin, "arch": arch, "inputs": copies}
    facts["settings"] = settings_of(study.points, study.seeds) | getattr(own, "facts", dict)()
    return Planned(loaded, own, study, [*filter(None, codes.values())], inputs, facts)


@contextmanager
def opened(place: Path) -> Iterator[Planned]:
    """Yield the study of a folder of results, planned from the files in the folder.

    Raises:
        AntsError: The folder has no study, or its study cannot be planned.
    """
    asked = folder.asked_in(place)
    if not asked:
        raise AntsError(f"{files.named(place)} has no results; name the folder of a study.")
    plugin, module = asked["plugin"], asked["module"]
    if plugin:
        plugin = str(place / INPUTS / "plugin" / Path(plugin).name)
    if module.endswith(".py"):
        module = str(place / INPUTS / "study" / Path(module).name)
    with replaced({path: place / name for path, name in asked["inputs"].items()}):
        found = planned(module, asked["options"], plugin, asked["arch"])
        found = replace(found, facts={name: asked[name] for name in found.facts})
        if list(found.study.keys) != asked["points"]:
            raise AntsError(
                f"this version plans other runs than {files.named(place)} has, which are of "
                f"version {asked['version']}, physics {asked['physics']}; use that version, or run "
                "the command of the folder again."
            )
        yield found


def run_study(settings: Namespace, module: str) -> None:
    """Compute the results of a study unless its folder has them, and print the report.

    Args:
        settings: The options of `command_line.add_common`, `add_machines` and `add_results`, and
            those of the study.
        module: The name of the module of the study, or the path of its file.
    """
    began, place = time.perf_counter(), settings.out
    options = {name: value for name, value in vars(settings).items() if name not in _OF_ALL}
    options = json.loads(files.to_json(options))
    found = planned(module, options, settings.plugin, settings.arch)
    asked, figures = found.asked(), not settings.no_figures
    parquet = getattr(settings, "parquet", False)
    if not settings.force and folder.is_finished(place, asked, figures, parquet):
        print(files.read_text(place / REPORT))
        print(f"{place}/ already has these results; use --force to write their tables again.")
    else:
        folder.ask(place, asked, found.inputs, settings.force)
        manifest = folder.manifest_in(place) or {}
        figures |= manifest.get("figures", False)
        parquet |= manifest.get("parquet", False)
        if not compute(settings, found, place, figures, parquet):
            print(_unfinished(place, settings.shard))
            return
        seconds = time.perf_counter() - began
        print(f"{files.read_text(place / REPORT)}\n{seconds:.1f} s; all results are in {place}/")
    if (place / PAGE).exists():
        print(place / PAGE)


def _unfinished(place: Path, shard: tuple[int, int] | None) -> str:
    number, shards = shard or (1, 1)
    return (
        f"Shard {number} of {shards} is finished in {place}/. When all are, and their blocks/ are "
        "in one folder, the same command without --shard writes the tables."
    )


def compute(settings: Namespace, found: Planned, place: Path, figures: bool, parquet: bool) -> bool:
    """Return whether all runs are there, after computing and, if so, writing the tables."""
    shard = settings.shard or (1, 1)
    while True:
        store = Store(place)
        for path in store.damaged:
            notice(f"{files.named(path)} is damaged, so its runs are computed again.")
        if found.study.missing(store).any():
            with folder.session(place, shard), executor_of(settings) as (executor, threads):
                title = Path(found.facts["module"].rpartition(".")[2]).stem
                with progress_bar(title, executor) as progress:
                    how: dict[str, Any] = {"threads": threads, "arch": settings.arch}
                    run(found.study, store, executor, shard, progress, found.code, **how)
            store.refresh()
        if found.study.missing(store).any():
            return False  # another shard's
        try:
            write_tables(place, found, store, figures, parquet)
            return True
        except DamagedError as error:
            notice(str(error))


def write_tables(
    place: Path, found: Planned, store: Store, figures: bool, parquet: bool, part: bool = False
) -> None:
    """Write the tables of a study; with `part`, runs can be missing, and results are unfinished.

    Raises:
        DamagedError: A block cannot be read; its runs are missing now.
    """
    seconds = sum(one["seconds"] or 0.0 for one in folder.sessions_in(place))
    made = provenance(sys.argv) | {"seconds": seconds}
    with files.writing(place), files.unfinished(place / "tables") as ready:
        ready.mkdir()
        arch = found.facts["arch"]
        results = Results(found.study, ready, store, made, figures, parquet, part, arch)
        files.write_text(ready / REPORT, found.module.tables(found.own, results))
        made |= {"figures": any(ready.rglob("*.png")), "parquet": parquet}
        folder.publish(place, ready, None if part else made)


@contextmanager
def executor_of(settings: Namespace) -> Iterator[tuple[Any, int | None]]:
    """Yield the executor that the options of a command choose, and the threads of each worker.

    Workers end with the `with` block. By default, they share the processors of this machine, and
    each worker of a cluster has one.
    """
    if settings.ray:
        from taichi_ants.studies.ray import RayWorkers

        address, threads = None if settings.ray is True else settings.ray, settings.threads or 1
        with RayWorkers(address, threads, settings.arch) as workers:
            yield workers, threads
    elif settings.workers:
        threads = settings.threads or max(1, available_threads() // settings.workers)
        with Workers(settings.workers) as local:
            yield local, threads
    else:
        yield None, settings.threads
