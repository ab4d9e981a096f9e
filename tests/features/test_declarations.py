"""Features are declared once: unique names, twins with the same points, no names elsewhere."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

import pytest
from command_lines import ROOT

from taichi_ants.engines.colony.layout import COLUMNS, NestRow, WorldRow
from taichi_ants.features import FEATURES
from taichi_ants.features.feature import Feature
from taichi_ants.features.noise import Noise
from taichi_ants.features.points import POINTS
from taichi_ants.reference.features import TWINS

PACKAGE = ROOT / "taichi_ants"
# What only lists features: the groups of settings of a task, and what is public.
LISTS = {"features/__init__.py", "task/task.py", "task/__init__.py", "__init__.py"}


def test_names_in_hooks_mean_one_thing():
    """Arrays of ants and nests, numbers of castes, and what the engine has, share one space."""
    own = [name for f in FEATURES for name in (*(a.name for a in f.arrays), *f.of_castes)]
    core = {*(row.name.lower() for rows in (NestRow, WorldRow) for row in rows), "task", "stream"}
    core |= COLUMNS.keys() - {array.name for f in FEATURES for array in f.arrays}
    assert not [name for name, n in Counter([*own, *core]).items() if n > 1]
    views = [array.view for f in FEATURES for array in f.arrays]
    assert len(set(views)) == len(views)


def test_twins_have_the_points_of_the_hooks():
    for group, twin in TWINS.items():
        hooks = {point for f in FEATURES if f.group == group for point in f.hooks}
        hooks -= {"rests"}  # the intents of the reference say who rests
        assert hooks == {point for point in POINTS if hasattr(twin, point)}, group
        inputs = any(f.inputs for f in FEATURES if f.group == group)
        assert hasattr(twin, "inputs") == inputs, group


def test_a_hook_has_the_arguments_of_its_point():
    feature = Feature(Noise)
    with pytest.raises(
        TypeError, match=r"tremble has \(a action\), but execute needs \(a action stream\)"
    ):

        @feature.at("execute")
        def tremble(a, action):
            return action


def plain_calls(source: str) -> set[str]:
    """Return the plain functions of a file that hooks call; kernels would run them as Python."""
    functions = [node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    in_kernels = [node for node in functions if node.decorator_list]
    plain = {node.name for node in functions} - {node.name for node in in_kernels}
    lines = [line for hook in in_kernels for line in hook.body]
    calls = [node for line in lines for node in ast.walk(line) if isinstance(node, ast.Call)]
    return plain & {ast.unparse(call.func) for call in calls}


def test_hooks_call_no_plain_functions():
    assert plain_calls("def f(x):\n return x\n@F.at('born')\ndef g(a):\n a.x = f(1)") == {"f"}
    files = sorted((PACKAGE / "features").glob("*.py"))
    assert len(files) > 6
    for path in files:
        assert not plain_calls(path.read_text("utf-8")), path.name


def identifiers(path: Path) -> set[str]:
    """Return the names, attributes, arguments and texts of a file."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        for field in ("attr", "id", "arg"):
            found.add(getattr(node, field, None))
        if isinstance(node, ast.Constant):
            found.add(node.value)
    return {name for name in found if isinstance(name, str)}


# The names of a feature that others may not use; what the engine does with castes, and the phases
# of births and food, are algorithms with static tests.
OWN = {
    "castes": {"chances_in", "numbers_in", "pheromones_laid"},
    "labour": {
        *("Threshold", "idle", "thresholds", "stimulus", "stimuli", "ant_idle", "ant_thresholds"),
        *("stop_probability", "demand", "relief"),
    },
    "noise": {"slip", "slip_below", "misread_below"},
    "life": {"ages", "ant_ages"},
}


@pytest.mark.parametrize("group", OWN)
def test_only_its_own_file_names_what_a_feature_declares(group):
    own = {f"features/{group}.py", f"reference/features/{group}.py"} | LISTS
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name not in own and name != "features/castes.py":  # a caste has a line for thresholds
            assert not identifiers(path) & OWN[group], name
