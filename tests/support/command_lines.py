"""Commands of the package and of `experiments/`, run for tests in a new process or in this one."""

import contextlib
import csv
import importlib
import json
import os
import re
import runpy
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from taichi_ants import commands
from taichi_ants.files import tomllib

ROOT = Path(__file__).resolve().parents[2]
EXPERIMENTS = ROOT / "experiments"
TABLES = tomllib.loads((ROOT / "docs" / "reference" / "columns.toml").read_text("utf-8"))
NAMES = TABLES.pop("names")
STUDIES = ("compare", "colony", "bridge")  # scripts with studies, not commands of the package


def crowding() -> float:
    """Return the recent number of runnable processes per core, at least 1, to scale time limits."""
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def promptly() -> float:
    """Return the seconds in which a stopped process must end; it needs one or two if idle."""
    return 4.0 * crowding()


def environment(kernels: Path, **changes: str | None) -> dict[str, str]:
    """Return environment variables that cache kernels in a folder; changes to None remove names."""
    paths = [str(ROOT), str(EXPERIMENTS), *filter(None, [os.environ.get("PYTHONPATH")])]
    wanted = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        "XDG_CACHE_HOME": str(kernels),
        "COLUMNS": "100",
        **changes,
    }
    return {name: value for name, value in wanted.items() if value is not None}


def command(name: str, arguments: Sequence[object]) -> list[str]:
    """Return the command line of a script or, if there is none, of a command of the package."""
    script = EXPERIMENTS / f"{name}.py"
    what = [str(script)] if script.exists() else ["-m", "taichi_ants", name]
    return [sys.executable, *what, *map(str, arguments)]


def run(
    name: str, arguments: Sequence[object], kernels: Path, folder: Path, **changes: str | None
) -> subprocess.CompletedProcess[str]:
    """Return the completed process of an experiment that ran in a folder."""
    return subprocess.run(
        command(name, arguments),
        cwd=folder,
        env=environment(kernels, **changes),
        capture_output=True,
        text=True,
        timeout=300,
    )


def start(
    name: str, arguments: Sequence[object], kernels: Path, folder: Path, **settings: object
) -> subprocess.Popen[str]:
    """Return the running process of an experiment in a folder, with its output as pipes."""
    return subprocess.Popen(
        command(name, arguments),
        cwd=folder,
        env=environment(kernels),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **settings,
    )


def descendants(pid: int) -> dict[int, str]:
    """Return the command lines of all descendants of a process, by process."""
    rows = []
    for path in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
            rows.append((int(path.name), parent, (path / "cmdline").read_text()))
    found = {pid: ""}
    for _ in range(5):
        found |= {one: line for one, parent, line in rows if parent in found}
    return {one: line for one, line in found.items() if one != pid}


def load(name: str) -> ModuleType:
    """Return the module of a command, or of a script with a study."""
    return importlib.import_module(name if name in STUDIES else f"taichi_ants.commands.{name}")


def call(
    name: str, arguments: Sequence[object], capsys: pytest.CaptureFixture[str]
) -> tuple[int, str, str]:
    """Return exit status, standard output and standard error of a command run in this process."""
    main = load(name).main if name in STUDIES else partial(commands.run, name)
    return _ended(lambda: main([*map(str, arguments)]), capsys)


def call_script(
    name: str, arguments: Sequence[object], capsys: pytest.CaptureFixture[str]
) -> tuple[int, str, str]:
    """Return the outcome of a script of `experiments/` run in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [f"{name}.py", *map(str, arguments)])
        script = str(EXPERIMENTS / f"{name}.py")
        return _ended(lambda: runpy.run_path(script, run_name="__main__"), capsys)


def _ended(work: Callable[[], object], capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        work()
    written = capsys.readouterr()
    return ended.value.code, written.out, written.err


def undeclared(declared: Iterable[str], columns: Iterable[str]) -> list[str]:
    """Return those of the columns that are not declared; `declared` can have `NAMES`."""
    forms = [re.sub("|".join(NAMES), lambda m: NAMES[m[0]]["form"], name) for name in declared]
    return [name for name in columns if not any(re.fullmatch(one, name) for one in forms)]


def read_csv(path: Path | str) -> list[dict[str, str]]:
    """Return the rows of a CSV file, whose columns must be those that a table of its name has."""
    with open(path, newline="", encoding="utf-8") as file:
        table = csv.DictReader(file)
        rows, heads = list(table), table.fieldnames or ()
    of_name = [one[Path(path).name] for one in TABLES.values() if Path(path).name in one]
    assert not of_name or [] in [undeclared(one["columns"], heads) for one in of_name], heads
    return rows


def numbers_in(path: Path | str) -> list[dict[str, Any]]:
    """Return the rows of a CSV file, with numbers as floats, and empty fields as None."""

    def value(text: str) -> Any:
        try:
            return float(text)
        except ValueError:
            return text or None

    return [{name: value(text) for name, text in row.items()} for row in read_csv(path)]


def contents(folder: Path) -> dict[str, bytes]:
    """Return the contents of all files below a folder, by path."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


# The keys of a manifest that depend on when, where and how a command ran.
OF_THE_RUN = ("command", "finished", "seconds", "checksum", "commit", "clean")


def assert_same_results(one: Path | str, other: Path | str, also: Sequence[str] = ()) -> None:
    """Assert that two folders of results have the same bytes, except for facts about the run.

    Ignores how runs were cut into blocks, and the manifests' keys `OF_THE_RUN` and those in `also`.
    """
    first, second = (
        {
            name: content
            for name, content in contents(Path(place)).items()
            if not name.startswith(("blocks/", "sessions/"))
        }
        for place in (one, other)
    )
    manifests = [json.loads(files.pop("manifest.json")) for files in (first, second)]
    for manifest in manifests:
        for name in (*OF_THE_RUN, *also):
            del manifest[name]
    assert manifests[0] == manifests[1]
    assert first == second


def assert_one_sentence(stderr: str) -> None:
    """Assert that an error is a single line, without traceback or usage."""
    assert stderr.startswith("error: ")
    assert stderr.endswith(".\n")
    assert stderr.count("\n") == 1
