"""Features are declared once: unique names, twins with the same points, no names elsewhere."""

import ast
from collections import Counter
from functools import cache
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
    views = [array.view for f in FEATURES for array in f.arrays if array.view]
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
    bodies = [line for hook in in_kernels for line in hook.body]
    calls = [node for line in bodies for node in ast.walk(line) if isinstance(node, ast.Call)]
    return plain & {ast.unparse(call.func) for call in calls}


def test_hooks_call_no_plain_functions():
    assert plain_calls("def f(x):\n return x\n@F.at('born')\ndef g(a):\n a.x = f(1)") == {"f"}
    files = sorted((PACKAGE / "features").glob("*.py"))
    assert len(files) > 6
    for path in files:
        assert not plain_calls(path.read_text("utf-8")), path.name


@cache
def identifiers(path: Path) -> set[str]:
    """Return the names, attributes, arguments and texts of a file, without `loads` of modules."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) in MODULES:
            continue
        for field in ("attr", "id", "arg"):
            found.add(getattr(node, field, None))
        if isinstance(node, ast.Constant):
            found.add(node.value)
    return {name for name in found if isinstance(name, str)}


MODULES = {"json", "pickle", "tomllib", "files.tomllib"}  # which have a function `loads`
# The names of a feature that others may not use. Castes, births and the growth of food have more,
# in the phases of the engine, which have static tests.
OWN = {
    "castes": {"chances_in", "numbers_in", "pheromones_laid", "caste_deliveries"},
    "choice": {"softmax", "deneubourg", "temperature", "carriers_follow", "choice_numbers"},
    "fields": {"deposited_when", "counts_without_food", "Occasion", "OCCASIONS"},
    "foods": {"kind_of", "loads", "food_numbers", "ant_foods"},
    "labour": {
        *("Threshold", "idle", "thresholds", "stimulus", "stimuli", "ant_idle", "ant_thresholds"),
        *("stop_probability", "demand", "relief"),
    },
    "noise": {"slip", "slip_below", "misread_below"},
    "life": {"ages", "ant_ages"},
}
# Files that use some of these names nevertheless.
EXCEPT = {
    # A caste has a line for numbers of other features, and its cues are static in the engine.
    "features/castes.py": {"Threshold", "temperature"},
    "task/model.py": {"carriers_follow"},
    "task/task.py": {"carriers_follow", "pheromones_laid"},
    # The laying of fields is static in both engines.
    "engines/colony/kernels.py": {"deposited_when"},
    "engines/colony/stepping.py": {"counts_without_food"},
    "engines/colony/steps.py": {"OCCASIONS", "counts_without_food", "deposited_when"},
    "engines/colony/trail.py": {"Occasion", "deposited_when"},
    "reference/actions.py": {"deposited_when"},
    # Rules of choice are functions of one file in kernels, where the engine looks them up.
    "task/rules/policy.py": {"deneubourg", "softmax", "temperature"},
    "features/rule.py": {"deneubourg", "softmax"},  # the names that rules of yours cannot have
    # Deliveries by caste are counted in the phases of the engine.
    "engines/colony/episodes.py": {"caste_deliveries"},
    "engines/colony/life.py": {"caste_deliveries"},
    # Snapshots of worlds without a colony have kinds of food, too.
    "records.py": {"ant_foods"},
    "rendering/rasteriser.py": {"ant_foods"},
    "viewer/recorder.py": {"ant_foods"},
    "reference/interventions.py": {"kind_of"},  # food that is moved keeps its kind
    "testing.py": {"OCCASIONS", "deposited_when"},  # rules are tried in drawn tasks with fields
}


@pytest.mark.parametrize("group", OWN)
def test_only_its_own_file_names_what_a_feature_declares(group):
    own = {f"features/{group}.py", f"reference/features/{group}.py"} | LISTS
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name not in own or name in ("task/task.py",):
            assert identifiers(path) & OWN[group] == EXCEPT.get(name, set()) & OWN[group], name


def test_the_state_of_a_colony_names_no_feature():
    """Its arrays, starts, views, results and files are those that features declare."""
    names = {name for f in FEATURES for array in f.arrays for name in (array.name, array.view)}
    names |= {*OWN} - {"fields", "foods"}  # of snapshots, and of worlds
    assert identifiers(PACKAGE / "engines" / "colony" / "state.py") & names <= {"", "kind"}
