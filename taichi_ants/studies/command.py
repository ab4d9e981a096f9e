"""Studies as commands: what the options ask for is computed, or shown if it is there.

A study is a module of this package or a file (.py), which the folder of its results names. It has

    plan(options) -> Study, or an object whose attribute `study` is one
    tables(plan, results) -> str, which writes tables and figures, and returns the report

`options` are the command's own ones, as JSON has them. A plan can have a method `facts`, whose
result adds to the settings in study.json. A file that does not change the meaning of its arrays
without raising its `VERSION` has that number; otherwise its text is a part of the keys of its runs.
"""

import json
import os
import sys
import time
from argparse import Namespace
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from taichi_ants import PHYSICS, __version__, files
from taichi_ants.errors import AntsError, imported
from taichi_ants.runtime import available_threads
from taichi_ants.studies import folder
from taichi_ants.studies.command_line import notice, progress_bar
from taichi_ants.studies.executors import Workers
from taichi_ants.studies.folder import INPUTS, MANIFEST, PAGE, REPORT, Results, provenance
from taichi_ants.studies.plugins import Code, checksum_of, load_plugin, placed, read_plugin
from taichi_ants.studies.points import settings_of
from taichi_ants.studies.store import DamagedError, Store
from taichi_ants.studies.study import Study, run

# Options of all studies, which `plan` does not get.
_OF_ALL = {"out", "force", "no_figures", "parquet", "plugin"}
_OF_ALL |= {"arch", "threads", "workers", "ray", "shard"}


@dataclass(frozen=True)
class Planned:
    """A study that its module has planned, with the files that it has read.

    Attributes:
        module: The module, or its file.
        plan: The object that the module's `plan` has returned.
        code: The plugin and the file of the module, as far as there are any.
        inputs: The contents of all files that the study has read, by their paths in a folder.
        asked: What the study asks for, as JSON has it, in folders of results.
    """

    module: Any
    plan: Any
    study: Study
    code: list[Code]
    inputs: Mapping[str, bytes]
    asked: Mapping[str, Any]


def planned(module: str, settings: Namespace) -> Planned:
    """Return the study of a module, a name or the path of a file, for the settings of a command.

    Raises an AntsError if a file cannot be read or run, or an option is not allowed.
    """
    options = {name: value for name, value in vars(settings).items() if name not in _OF_ALL}
    options = json.loads(files.to_json(options))
    plugin, arch, file = settings.plugin, settings.arch, module if module[-3:] == ".py" else None
    codes = {"plugin": read_plugin(plugin), "study": read_plugin(file)}
    with files.recorded() as read:
        load_plugin(plugin, codes["plugin"])
        loaded: Any = load_plugin(file, codes["study"]) or import_module(module)
        plan = loaded.plan(options)
        salt = [f"study {Path(module).stem}"]
        if file is not None:
            salt.append(str(getattr(loaded, "VERSION", checksum_of(codes["study"]))))
        if plugin is not None:
            salt.append(f"plugin {checksum_of(codes['plugin'])}")
        if arch != "cpu":  # nobody has compared a GPU with it yet
            salt.append(arch)
        study = replace(getattr(plan, "study", plan), salt=tuple(salt))
        assert study.keys  # which read the files of policies
    inputs = {
        path.as_posix(): content
        for name, code in codes.items()
        for path, content in placed(code, Path(INPUTS, name)).items()
    }
    copies = dict[str, str]()
    for path, content in read.items():
        copy = Path(INPUTS, Path(path).name)
        while copy.as_posix() in inputs:
            copy = copy.with_name(f"2-{copy.name}")
        copies[path] = copy.as_posix()
        inputs[copies[path]] = content
    asked = {
        **{"version": __version__, "physics": PHYSICS, "module": module, "options": options},
        **{"plugin": plugin, "arch": arch, "inputs": copies},
        "settings": settings_of(study.points, study.seeds) | getattr(plan, "facts", dict)(),
        **{"points": study.keys, "seeds": study.seeds, "arrays": study.arrays},
        **{"seconds": study.seconds[:, 0], "families": study.families},
    }
    asked = json.loads(files.to_json(asked))
    return Planned(loaded, plan, study, [*filter(None, codes.values())], inputs, asked)


@contextmanager
def opened(path: Path) -> Iterator[Planned]:
    """Yield the study of a folder of results, planned from its files; AntsError if it has none."""
    asked = folder.asked_in(path)
    plugin, module = asked["plugin"], asked["module"]
    if plugin:
        plugin = str(path / INPUTS / "plugin" / Path(plugin).name)
    if module.endswith(".py"):
        module = str(path / INPUTS / "study" / Path(module).name)
    settings = Namespace(**asked["options"], plugin=plugin, arch=asked["arch"])
    with files.replaced({name: path / copy for name, copy in asked["inputs"].items()}):
        again = planned(module, settings)
        if list(again.study.keys) != asked["points"]:
            raise AntsError(
                f"this version plans other runs than {files.named(path)} has, which are of "
                f"version {asked['version']}, physics {asked['physics']}; use that version, or run "
                "the command of the folder again."
            )
        yield replace(again, asked={**asked, "version": __version__})


def run_study(settings: Namespace, planned: Planned, report: bool = True) -> bool:
    """Compute the results of a study unless its folder has them, and print the `report`.

    Args:
        settings: The options of `command_line.add_study`.
        planned: The study.

    Returns:
        Whether the results are there; with a shard, runs of others can be missing.
    """
    began, out, shard = time.perf_counter(), settings.out, settings.shard or (1, 1)
    figures, parquet = not settings.no_figures, getattr(settings, "parquet", False)
    if parquet:
        imported("Parquet", "pyarrow", "parquet")
    asked, study = planned.asked, planned.study
    before = folder.json_in(out / MANIFEST) or {}
    is_shown = (
        not settings.force
        and folder.is_finished(out, asked, before)
        and (before["figures"] or not figures)
        and (before["parquet"] or not parquet)
    )
    if not is_shown:
        folder.ask(out, asked, planned.inputs, settings.force)
        figures |= before.get("figures", False)
        parquet |= before.get("parquet", False)
    is_finished = is_shown
    while not is_finished:
        store = Store(out)
        for path in store.damaged:
            notice(f"{files.named(path)} is damaged, so its runs are computed again.")
        if study.missing(store).any():
            title = planned.module.__name__.rpartition(".")[2].removeprefix("plugin_")
            with (
                folder.session(out, shard),
                executor_of(settings) as (executor, threads),
                progress_bar(title) as progress,
            ):
                how: dict[str, Any] = {"threads": threads, "arch": asked["arch"]}
                run(study, store, executor, shard, progress, planned.code, **how)
            store.refresh()
        if study.missing(store).any():
            print(
                f"Shard {shard[0]} of {shard[1]} is finished in {out}/. When all are, and their "
                "blocks/ are in one folder, the same command without --shard writes the tables."
            )
            return False
        try:
            write_tables(out, planned, store, figures, parquet)
            is_finished = True
        except DamagedError as error:
            notice(str(error))
    if report:
        print(files.read_text(out / REPORT))
    if is_shown:
        print(f"{out}/ already has these results; use --force to write their tables again.")
    else:
        print(f"{time.perf_counter() - began:.1f} s; all results are in {out}/")
    if (out / PAGE).exists():
        print(out / PAGE)
    return True


def write_tables(
    out: Path, planned: Planned, store: Store, figures: bool, parquet: bool, part: bool = False
) -> None:
    """Write the tables of a study; DamagedError if a block cannot be read.

    With `part`, runs can be missing, and the results are unfinished.
    """
    seconds = sum(session["seconds"] or 0.0 for session in folder.sessions_in(out))
    made = provenance(sys.argv) | {"seconds": seconds}
    with files.writing(out), files.unfinished(out / "tables") as ready:
        ready.mkdir()
        how = figures, parquet, part, planned.asked["arch"]
        results = Results(planned.study, ready, store, made, *how)
        files.write_text(ready / REPORT, planned.module.tables(planned.plan, results))
        paths = sorted(path.relative_to(ready) for path in ready.rglob("*") if path.is_file())
        checksums = {path.as_posix(): folder.checksum_of(ready / path) for path in paths}
        with suppress(AntsError):  # a damaged manifest is replaced
            for name in (folder.json_in(out / MANIFEST) or {"files": ()})["files"]:
                is_inside = (out / name).resolve().is_relative_to(out.resolve())
                if name not in checksums and is_inside:
                    (out / name).unlink(missing_ok=True)
        for path in paths:
            (out / path).parent.mkdir(parents=True, exist_ok=True)
            os.replace(ready / path, out / path)
        if part:
            (out / MANIFEST).unlink(missing_ok=True)
        else:
            made |= {"figures": any(path.suffix == ".png" for path in paths), "parquet": parquet}
            made |= {"study": files.checksum_of_json(folder.asked_in(out)), "files": checksums}
            folder.write_json(out / MANIFEST, made)


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
