"""Python files of users: plugins, and the modules of studies. They travel to workers as bytes."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from taichi_ants.errors import AntsError

Code = Mapping[str, bytes]  # a file by its path, and then the files in its folder that it imports

_imports: dict[str, ModuleSpec | None] = {}  # files that plugins import from their folders
_finder: Any = SimpleNamespace(find_spec=lambda name, *_: _imports.get(name))  # see `sys.meta_path`
_loaded: dict[str, list[bytes]] = {}  # what `load_code` has loaded, by the name of the file
_UNREADABLE = "cannot read the plugin {!r}; name a Python file (.py)."
_folders: list[tempfile.TemporaryDirectory[str]] = []  # of loaded code, until this process ends


def read_plugin(path: str | None) -> dict[str, bytes]:
    """Return the contents of a plugin, if any, and then of the files that it needs.

    These are the modules and packages of its folder that it imports, and `NAME*.toml` and
    `NAME*.html` for NAME.py. AntsError if one cannot be read, or has an installed module's name.
    """
    if path is None:
        return {}
    code, waiting, folder = dict[str, bytes](), [Path(path)], Path(path).parent
    for file in waiting:  # which grows
        if str(file) in code:
            continue
        try:
            code[str(file)] = file.read_bytes()
        except (OSError, ValueError) as error:
            raise AntsError(_UNREADABLE.format(path)) from error
        if file.suffix == ".py" or file == Path(path):
            waiting += _needed(folder, file, code[str(file)])
    return code


def _needed(folder: Path, path: Path, content: bytes) -> Iterator[Path]:
    """Yield the files of a folder that one of its modules needs."""
    for suffix in (".toml", ".html") if path.parent == folder else ():
        yield from sorted(folder.glob(f"{path.stem}*{suffix}"))
    try:
        nodes = [*ast.walk(ast.parse(content, path))]
    except SyntaxError:
        return  # which `load_plugin` reports
    names = [name.name for node in nodes if isinstance(node, ast.Import) for name in node.names]
    names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
    installed = [path for path in sys.path if path.endswith(("site-packages", "dist-packages"))]
    for name in dict.fromkeys(name.partition(".")[0] for name in names if name):
        module, package = folder / f"{name}.py", folder / name / "__init__.py"
        needed = [module] if module.is_file() else []
        if package.is_file():
            inside = sorted(package.parent.rglob("*"))
            needed = [package, *(p for p in inside if p.suffix in (".py", ".toml", ".html"))]
        if needed and (name in sys.stdlib_module_names or PathFinder.find_spec(name, installed)):
            raise AntsError(f"{str(needed[0])!r} has an installed module's name; rename it.")
        yield from needed


def load_plugin(path: str | None, code: Code | None = None) -> Any:
    """Return the module of a Python file, after running it, or None; `code` is as read before.

    AntsError if the file cannot be read, raises or exits.
    """
    if path is None:
        return None
    spec: Any = importlib.util.spec_from_file_location(f"plugin_{Path(path).stem}", path)
    if spec is None:
        raise AntsError(_UNREADABLE.format(path))
    if _finder not in sys.meta_path:
        sys.meta_path.insert(0, _finder)
    module = importlib.util.module_from_spec(spec)
    try:
        for file in [*map(Path, code or read_plugin(path))][1:]:
            is_package = file.stem == "__init__"
            if file.suffix == ".py" and (is_package or file.parent == Path(path).parent):
                _let_import(file, file.parent.name if is_package else file.stem)
        sys.modules[spec.name] = module  # Taichi reads the source of functions by their module
        spec.loader.exec_module(module)
    except AntsError:
        raise
    except (Exception, SystemExit) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".splitlines())
        lacks = isinstance(error, ModuleNotFoundError)
        remedy = "install it, or save it in the plugin's folder" if lacks else "correct the file"
        raise AntsError(f"the plugin {path!r} failed with {reason}; {remedy}.") from error
    return module


def _let_import(path: Path, name: str) -> None:
    """Let Python find the module or package of a file by its name alone."""
    _imports[name] = importlib.util.spec_from_file_location(name, path)
    before = getattr(sys.modules.get(name), "__file__", None)
    if before and Path(before).resolve() != path.resolve():  # that of another plugin
        for loaded in [*sys.modules]:
            if loaded == name or loaded.startswith(f"{name}."):
                del sys.modules[loaded]


def load_code(codes: Iterable[Code]) -> None:
    """Load code that came as bytes, if it is new; AntsError if another file has its name."""
    for code in codes:
        name, contents = Path(next(iter(code))).name, [*code.values()]
        if _loaded.setdefault(name, contents) != contents:
            raise AntsError(f"a worker has loaded another file {name!r}; start new workers.")
        if f"plugin_{Path(name).stem}" in sys.modules:
            continue
        _folders.append(tempfile.TemporaryDirectory())
        for path, content in placed(code, Path(_folders[-1].name)).items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)  # because Taichi reads the source of functions
        load_plugin(str(Path(_folders[-1].name, name)))


def placed(code: Code, folder: Path) -> dict[Path, bytes]:
    """Return the contents of code by the paths that its files would have in another folder."""
    before = Path(next(iter(code), "")).parent
    return {folder / Path(path).relative_to(before): content for path, content in code.items()}


def checksum_of(code: Code) -> str:
    """Return the hexadecimal SHA-256 of the contents of code."""
    return hashlib.sha256(b"\0".join(code.values())).hexdigest()
