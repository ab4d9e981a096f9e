"""The shape of the house: who imports whom, who starts Taichi, and how long files are."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from command_lines import ROOT

import taichi_ants

# From the ground up: a part imports parts of lower layers only. Each part stands here.
LAYERS = (
    {"errors", "process_variables"},
    {"files", "grid", "registry", "settings"},
    {"arithmetic"},
    {"kernel_functions"},
    {"features"},
    {"rules"},
    {"task"},
    {"runtime", "worlds", "learners"},
    {"records"},
    {"arguments", "measures"},
    {"interventions"},
    {"protocol"},
    {"engines", "reference"},
    {"analysis", "lab", "rendering", "testing"},
    {"offline"},
    {"viewer", "envs"},
    {"live", "studies"},
    {"report"},
    {"commands"},
    {"__main__"},
)
# Kernels live in these; runtime starts Taichi.
PARTS_WITH_TAICHI = {
    *("arithmetic", "kernel_functions", "task", "learners", "engines", "rendering", "offline"),
    *("envs", "runtime"),
}

FOLDERS = ("taichi_ants", "experiments", "examples")
FILES = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))
PACKAGE = [path for path in FILES if "taichi_ants" in path.relative_to(ROOT).parts]
EXPERIMENTS = [path for path in FILES if path not in PACKAGE or "commands" in path.parts]


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imported(path: Path, types_too: bool = False) -> tuple[str, ...]:
    """The full names of what a file imports; by default without what only type checkers see.

    What it gives to `import_module` counts: a string names a module, and an f-string all modules of
    the package in front of the first braces. Other names are computed, see `COMPUTED`.
    """
    return tuple(_imported(path, types_too))


# The only files that import a module by a computed name, which is not one of the package's.
COMPUTED = {"taichi_ants/errors.py", "taichi_ants/studies/command.py"}


def _imported(path: Path, types_too: bool) -> Iterator[str]:
    for node in _running(tree(path), types_too):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Call):
            yield from _by_string(path, node)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name(path)} imports relatively"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _by_string(path: Path, call: ast.Call) -> Iterator[str]:
    named = [ast.unparse(one).rpartition(".")[2] for one in (call.func, *call.args)]
    if "import_module" not in named or module_of(path) == "taichi_ants":  # that names all parts
        return
    for text in call.args:
        if isinstance(text, ast.Constant):
            yield str(text.value)
        elif isinstance(text, ast.JoinedStr):
            prefix = "".join(
                one.value if isinstance(one, ast.Constant) else module_of(path) + "."
                for one in text.values[:-1]
            ).replace("..", ".")
            yield from (one for one in map(module_of, PACKAGE) if one.startswith(prefix))
        else:
            assert path not in PACKAGE or name(path) in COMPUTED, (
                f"{name(path)} imports {ast.unparse(text)}"
            )


def _running(node: ast.AST, types_too: bool) -> Iterator[ast.AST]:
    yield node
    for child in ast.iter_child_nodes(node):
        only_types = isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"
        if types_too or not only_types:
            yield from _running(child, types_too)


def part_of(module: str) -> str:
    """The part of the package to which a module, or a name in it, belongs."""
    pieces = module.split(".")
    return pieces[1] if len(pieces) > 1 else ""


def layer(part: str) -> int:
    return next(number for number, parts in enumerate(LAYERS) if part in parts)


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def test_every_module_belongs_to_a_layer():
    assert len(PACKAGE) > 60
    assert len(EXPERIMENTS) >= 2
    parts = {part_of(module_of(path)) for path in PACKAGE} - {""}
    listed = [part for layer in LAYERS for part in layer]
    assert sorted(parts) == sorted(listed)


def test_imports_point_one_way():
    modules = {module_of(path) for path in PACKAGE}
    for path in PACKAGE:
        own = part_of(module_of(path))
        if not own:  # the package itself names all of its parts
            continue
        for module in imported(path, types_too=True):
            # A name of the package itself, such as `taichi_ants.train`, comes from any of its
            # parts; only what stands on top of all of them may take it from there.
            owner = module if module in modules else module.rpartition(".")[0]
            other = part_of(owner)
            if (
                not module.startswith("taichi_ants.")
                or other == own
                or module.endswith(("__version__", "PHYSICS"))
            ):
                continue
            assert layer(other or "commands") <= layer(own), f"{name(path)} imports {module}"
            assert layer(other or "commands") < layer(own) or not other, f"{name(path)}: {module}"


def test_no_imports_go_round_in_a_circle():
    """Imports inside of functions, by strings and for type checkers count: they hide no circle."""
    files = {module_of(path): path for path in PACKAGE}
    graph = {}
    for module, path in files.items():
        every = imported(path, types_too=True)
        named = {full if full in files else full.rpartition(".")[0] for full in every}
        graph[module] = (named & files.keys()) - {module, "taichi_ants"}
    graph["taichi_ants"] = set()
    TopologicalSorter(graph).prepare()


def test_only_parts_with_kernels_import_taichi():
    for path in PACKAGE:
        own = part_of(".".join(path.relative_to(ROOT).with_suffix("").parts))
        if own not in PARTS_WITH_TAICHI:
            for module in imported(path):
                assert module.split(".")[0] != "taichi", name(path)


def test_taichi_is_started_in_one_place():
    for path in FILES:
        starts = [
            ast.unparse(node)
            for node in ast.walk(tree(path))
            if isinstance(node, ast.Attribute) and ast.unparse(node) in ("ti.init", "taichi.init")
        ]
        starts += [module for module in imported(path) if module == "taichi.init"]
        assert bool(starts) == (name(path) == "taichi_ants/runtime.py")


# Parts that no other part needs.
EXTRAS = {"offline", "envs"}


def test_the_core_does_not_import_extras():
    for path in PACKAGE:
        if part_of(module_of(path)) in {"", *EXTRAS}:  # the package itself names all of its parts
            continue
        assert not {part_of(module) for module in imported(path)} & EXTRAS, name(path)


LAYOUT = "taichi_ants.engines.colony.layout"


def test_only_the_colony_knows_its_layout():
    """Others use its views, and the engine of runs has arrays of its own."""
    for path in PACKAGE:
        if path.name != "__init__.py" and not module_of(path).startswith(
            "taichi_ants.engines.colony."
        ):
            assert not any(module.startswith(LAYOUT) for module in imported(path))
            texts = {ast.unparse(n) for n in ast.walk(tree(path)) if isinstance(n, ast.Attribute)}
            assert not [text for text in texts if text.endswith("colony.arrays")]


def test_experiments_use_public_names_only():
    for path in EXPERIMENTS:
        every = imported(path, types_too=True)
        modules = [module for module in every if module.startswith("taichi_ants")]
        aliases = {module.split(".")[-1] for module in modules}
        for module in modules:
            private = [piece for piece in module.split(".") if piece.startswith("_")]
            assert not private, f"{name(path)}: {module}"
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                private = node.attr.startswith("_") and not node.attr.startswith("__")
                assert not (private and node.value.id in aliases), (
                    f"{name(path)}: {ast.unparse(node)}"
                )


def test_public_names_are_listed_once_and_found():
    assert len(set(taichi_ants.__all__)) == len(taichi_ants.__all__)
    assert set(dir(taichi_ants)) == set(taichi_ants.__all__)
    with pytest.raises(AttributeError, match="'taichi_ants' has no attribute 'nothing'"):
        taichi_ants.nothing  # noqa: B018


def test_type_checkers_and_python_see_the_same_names():
    """The names that are imported when used stand twice in `__init__`."""
    path = ROOT / "taichi_ants" / "__init__.py"
    lazily = set(imported(path, types_too=True)) - set(imported(path))
    listed = {module.split(".")[-1] for module in lazily}
    assert listed == set(taichi_ants.__all__) - {"__version__"}
