"""Studies as commands: what the options ask for is computed, or shown if it is there.

A study is a module of this package or a file (.py), which the folder of its results names. It has

    plan(options) -> Study, or an object whose attribute `study` is one
    tables(plan, results) -> str, which writes tables and figures, and returns the report

`options` are the command's own ones, as JSON has them. A plan can have a method `facts`, whose
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

from taichi_ants import PHYSICS, __version__, files
from taichi_ants.errors import AntsError, imported
from taichi_ants.files.inputs import recorded, replaced
from taichi_ants.runtime import available_threads
from taichi_ants.studies import folder
from taichi_ants.studies.command_line import notice, progress_bar
from taichi_ants.studies.executors import Workers
from taichi_ants.studies.folder import INPUTS, MANIFEST, PAGE, REPORT, Results
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
        plan: The object that the module's `plan` has returned.
        code: The plugin and the file of the module, as far as there are any.
        inputs: The contents of all files that the study has read, by their paths in a folder.
        facts: Facts from which `opened` plans the same study again.
    """

    module: Any
    plan: Any
    study: Study
    code: list[Code]
    inputs: Mapping[str, bytes]
    facts: Mapping[str, Any]

    def asked(self) -> dict[str, Any]:
        """Return what the study asks for, as JSON in folders of results."""
        study = self.study
        asked = {
            **{"version": __version__, "physics": PHYSICS, **self.facts},
            **{"points": study.keys, "seeds": study.seeds, "arrays": study.arrays},
            **{"seconds": study.seconds[:, 0], "families": study.families},
        }
        return json.loads(files.to_json(asked))


def planned(module: str, settings: Namespace) -> Planned:
    """Return the study of a module, a name or the path of a file, for the settings of a command.

    Raises:
        AntsError: A file cannot be read or run, or an option is not allowed.
    """
    options = {name: value for name, value in vars(settings).items() if name not in _OF_ALL}
    options = json.loads(files.to_json(options))
    plugin, arch, file = settings.plugin, settings.arch, module if module[-3:] == ".py" else None
    codes = {"plugin": read_plugin(plugin), "study": read_plugin(file)}
    with recorded() as read:
        load_plugin(plugin, codes["plugin"])
        loaded: Any = load_plugin(file, codes["study"]) or import_module(module)
        plan = loaded.plan(options)
        salt = [f"study {Path(module).stem}"]
        if file is not None:
            salt.append(str(getattr(loaded, "VERSION", checksum_of(codes["study"]))))
        if plugin is not None:
            salt.append(f"plugin {checksum_of(codes['plugin'])}")
        if arch != "cpu":  # whose last bits differ
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
        base = re.sub(r"[^\w.-]", "_", Path(path).name)
        names = (f"{INPUTS}/{f'{n}-' if n > 1 else ''}{base}" for n in itertools.count(1))
        copies[path] = next(name for name in names if name not in inputs)
        inputs[copies[path]] = content
    facts = {"module": module, "options": options, "plugin": plugin, "arch": arch, "inputs": copies}
    facts["settings"] = settings_of(study.points, study.seeds) | getattr(plan, "facts", dict)()
    return Planned(loaded, plan, study, [*filter(None, codes.values())], inputs, facts)


@contextmanager
def opened(path: Path) -> Iterator[Planned]:
    """Yield the study of a folder of results, planned from the files in the folder.

    Raises:
        AntsError: The folder has no study, or its study cannot be planned.
    """
    asked = folder.asked_in(path)
    plugin, module = asked["plugin"], asked["module"]
    if plugin:
        plugin = str(path / INPUTS / "plugin" / Path(plugin).name)
    if module.endswith(".py"):
        module = str(path / INPUTS / "study" / Path(module).name)
    settings = Namespace(**asked["options"], plugin=plugin, arch=asked["arch"])
    with replaced({name: path / copy for name, copy in asked["inputs"].items()}):
        again = planned(module, settings)
        if list(again.study.keys) != asked["points"]:
            raise AntsError(
                f"this version plans other runs than {files.named(path)} has, which are of "
                f"version {asked['version']}, physics {asked['physics']}; use that version, or run "
                "the command of the folder again."
            )
        yield replace(again, facts={name: asked[name] for name in again.facts})


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
    asked, study = planned.asked(), planned.study
    is_shown = not settings.force and folder.is_finished(out, asked, figures, parquet)
    if not is_shown:
        folder.ask(out, asked, planned.inputs, settings.force)
        manifest = folder.json_in(out / MANIFEST) or {}
        figures |= manifest.get("figures", False)
        parquet |= manifest.get("parquet", False)
    is_finished = is_shown
    while not is_finished:
        store = Store(out)
        for path in store.damaged:
            notice(f"{files.named(path)} is damaged, so its runs are computed again.")
        if study.missing(store).any():
            title = Path(planned.facts["module"].rpartition(".")[2]).stem
            with (
                folder.session(out, shard),
                executor_of(settings) as (executor, threads),
                progress_bar(title) as progress,
            ):
                how: dict[str, Any] = {"threads": threads, "arch": planned.facts["arch"]}
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
    """Write the tables of a study; with `part`, runs can be missing, and results are unfinished.

    Raises:
        DamagedError: A block cannot be read; its runs are missing now.
    """
    seconds = sum(session["seconds"] or 0.0 for session in folder.sessions_in(out))
    made = provenance(sys.argv) | {"seconds": seconds}
    with files.writing(out), files.unfinished(out / "tables") as ready:
        ready.mkdir()
        arch = planned.facts["arch"]
        results = Results(planned.study, ready, store, made, figures, parquet, part, arch)
        files.write_text(ready / REPORT, planned.module.tables(planned.plan, results))
        made |= {"figures": any(ready.rglob("*.png")), "parquet": parquet}
        folder.publish(out, ready, None if part else made)


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
