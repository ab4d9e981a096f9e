"""The reference is independent: it imports nothing of the package but what it may."""

import ast
import dataclasses
from pathlib import Path

import plain_interventions
import plain_measures

from taichi_ants import reference
from taichi_ants.worlds import World

FOLDER = Path(reference.__file__).parent
ALLOWED = {
    "taichi_ants.task",
    "taichi_ants.grid.constants",
    "taichi_ants.task.constants",
    "taichi_ants.errors",
    # Your own rules and observations, and the form of their inputs.
    "taichi_ants.rules",
    "taichi_ants.rules.functions",
    "taichi_ants.rules.inputs",
    "taichi_ants.learners.config",
    "taichi_ants.worlds.world",
    # Records of settings, and the hand-written policies as tables.
    "taichi_ants.interventions",
    "taichi_ants.protocol",
    "taichi_ants.learners.policies",
    # The sentence that refuses what neither engine has.
    "taichi_ants.features.support",
    # The names of the features of the model, in order.
    "taichi_ants.features",
}
OUTSIDE = "__future__ collections copy dataclasses enum functools importlib math numpy types typing"
RULES = "Caste Choice Field Food Labour Life Observation Pheromone Rewards Task Threshold Traffic"


SUPPORT = [Path(module.__file__) for module in (plain_interventions, plain_measures)]
FILES = [*sorted(FOLDER.rglob("*.py")), *SUPPORT]


def imported_by(path: Path) -> set[str]:
    modules = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            modules |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            modules.add(node.module)
            if node.module == "taichi_ants.task":
                assert {name.name for name in node.names} <= {*RULES.split()}
    return modules


def test_the_reference_imports_only_what_it_may():
    assert len(FILES) >= 12
    for path in FILES:
        for module in imported_by(path):
            own = module.startswith("taichi_ants.reference.") or module == "plain_measures"
            plain = module.split(".")[0] in OUTSIDE.split()
            assert own or plain or module in ALLOWED, f"{path.name} imports {module}"


def test_of_the_world_only_fields_are_read():
    # A world's helpers (its grid, ground, closer cells, starts) belong to what is tested.
    fields = {field.name for field in dataclasses.fields(World)}
    looking = 0
    for path in FILES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for function in ast.walk(tree):
            if not isinstance(function, ast.FunctionDef):
                continue
            worlds = {
                argument.arg
                for argument in function.args.args
                if argument.annotation is not None and ast.unparse(argument.annotation) == "World"
            }
            read = {
                node.attr
                for node in ast.walk(function)
                if isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id in worlds
            }
            looking += bool(read)
            assert read <= fields, f"{path.name}: {function.name} reads {read - fields}"
    assert looking >= 4
