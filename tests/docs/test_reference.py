"""The reference: what declarations give, and an example that runs for each public object."""

import doctest
import importlib.util
import inspect
import re
from functools import cached_property

import jedi
import matplotlib
import pytest
from command_lines import ROOT

import taichi_ants
from taichi_ants import Pheromone, Task, TrainingConfig
from taichi_ants.features import FEATURES
from taichi_ants.features.rule import RULES
from taichi_ants.learners.registry import LEARNERS
from taichi_ants.measures.measure import MEASURES
from taichi_ants.settings import declared
from taichi_ants.task.observations.observation import OBSERVATIONS
from taichi_ants.worlds.registry import WORLDS

_PAGE = (ROOT / "docs" / "reference" / "api.md").read_text("utf-8")
# The setup of all examples, and the colony that is made anew for each.
SETUP, COLONY = re.findall(r"```python\n(from dataclasses.*?)(colony = .*?)```", _PAGE, re.S)[0]
SLOW = {"check_observation", "check_rule", "replay"}
# Records, codes and functions of kernels, and the public object in whose example they occur.
SHOWN_BY = {
    "Event": "HexForageEnv",
    "ExpectedEpisode": "EpisodeBounds",
    "LearnerArrays": "Learner",
    "Parameters": "rules.register",
    "Policy": "load_policy",
    "PolicyValues": "importance_sampling",
    "Reason": "HexForageEnv",
    "Recording": "Recorder",
    "Rollout": "HexForageVectorEnv",
    "Rule": "rules.register",
    "RuleCheck": "check_rule",
    "Setting": "Hyperparameters",
    "Snapshot": "colony_snapshots",
    "Status": "Scene",
    "discount_of": "Learner",
    "values_of": "Learner",
}


def generator():
    """The script that writes the reference."""
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    return generate


REGISTRIES = LEARNERS, MEASURES, OBSERVATIONS, RULES, WORLDS
GENERATE = generator()
PUBLIC = {
    f"{module.__name__}.{name}": getattr(module, name)
    for module in map(GENERATE.imported, GENERATE.MODULES)
    for name in GENERATE.public_names(module)
}


def test_the_reference_is_made_from_the_declarations(monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    for registry in REGISTRIES:  # without what other tests have registered
        monkeypatch.setattr(registry, "yours", {})
    pages = GENERATE.pages()
    assert len(pages) > 25
    old = [path.name for path, text in pages.items() if path.read_text("utf-8") != text]
    assert not old, f"run `python docs/generate.py`, which changes {', '.join(old)}"


def test_every_public_object_is_described():
    described = {
        name: GENERATE.DATA.get(name.rpartition(".")[2]) or inspect.getdoc(value) or ""
        for name, value in PUBLIC.items()
    }
    assert len(described) > 150
    assert [name for name, text in described.items() if len(text.split()) < 4] == []
    colony = taichi_ants.Colony
    names = [name for name in dir(colony) if not name.startswith("_")]
    assert len(names) < 50
    bare = [name for name in names if not inspect.getdoc(inspect.getattr_static(colony, name))]
    assert bare == []


def examples_of(value) -> str:
    """The lines of the examples in a docstring."""
    lines = (inspect.getdoc(value) or "").splitlines()
    return "\n".join(line for line in lines if line.startswith((">>> ", "... ")))


def test_every_public_callable_has_an_example():
    of = {name.partition(".")[2]: examples_of(value) for name, value in PUBLIC.items()}
    known = {name.rpartition(".")[2] for name in of}
    for name, other in SHOWN_BY.items():
        assert name in known
        assert any(text for full, text in of.items() if f".{full}".endswith(f".{other}")), other
    without = []
    for name, text in of.items():
        value, last = PUBLIC[f"taichi_ants.{name}"], name.rpartition(".")[2]
        members = GENERATE.public_members(value)
        called = "\n".join([text, *map(examples_of, members.values())])
        if not called.strip() and last not in {*SHOWN_BY, *GENERATE.DATA}:
            without.append(name)
        is_called = (m for m, v in members.items() if not isinstance(v, PROPERTIES))
        without += [f"{name}.{member}" for member in is_called if f".{member}(" not in called]
    assert without == []


def test_every_argument_is_described():
    missing, known = [], {"facts", "path", "more", "named", "title", "values"}
    for full, public in PUBLIC.items():
        members = GENERATE.public_members(public).items()
        for name, value in ((full, public), *((f"{full}.{name}", v) for name, v in members)):
            text = inspect.getdoc(value) or ""
            is_elsewhere = re.search(r"[Aa]rguments\b[^.]* are those of", text)
            if is_elsewhere or isinstance(value, PROPERTIES) or full.rpartition(".")[2] in SHOWN_BY:
                continue
            value = getattr(value, "__func__", value)
            arguments = {*inspect.signature(value).parameters} if callable(value) else set()
            arguments -= {"self", "cls", "args", "kwargs"} | known
            missing += [f"{name}: {a}" for a in arguments if not re.search(rf"\b{a}\b", text)]
    assert missing == []


def test_the_docstrings_of_properties_are_sentences_with_the_right_type(names):
    exec(COLONY, names)
    for public in filter(inspect.isclass, PUBLIC.values()):
        for name, member in GENERATE.public_members(public).items():
            if isinstance(member, PROPERTIES):
                text = inspect.getdoc(member)
                assert ": " not in text.partition("\n\n")[0], name  # which is a type for Sphinx
                kind = re.search(r"\b(u?int\d+|float\d+|bool) \(W", text)
                assert not kind or getattr(names["colony"], name).dtype == kind[1], name


PROPERTIES = property, cached_property
_BY_ID = {
    id(value): (name, value)
    for full, public in reversed(PUBLIC.items())
    for name, value in (
        (full, public),
        *((f"{full}.{name}", value) for name, value in GENERATE.public_members(public).items()),
    )
    if examples_of(value)
}
SHOWN = dict(_BY_ID.values())


@pytest.fixture(scope="module")
def names():
    """The names with which the examples begin."""
    made: dict[str, object] = {}
    exec(SETUP, made)
    return made


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name.split(".")[-1] in SLOW else [])
        for name in SHOWN
    ],
)
def test_the_example_of(name, names, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for registry in REGISTRIES:
        monkeypatch.setattr(registry, "yours", {})  # without what other tests have registered
    made, failures = dict(names), []
    if "colony" in examples_of(SHOWN[name]):
        exec(COLONY, made)
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner(verbose=False)
    example = parser.get_doctest(inspect.getdoc(SHOWN[name]), made, name, None, 0)
    with matplotlib.rc_context():
        runner.run(example, out=failures.append)
    assert not failures, "".join(failures)


@pytest.mark.parametrize("kind", [Task, Pheromone, TrainingConfig])
def test_help_and_editors_know_the_settings(kind):
    settings = declared(kind)
    signature = inspect.signature(kind)
    for one in settings:
        assert f"    {one.name}: {one.rule.help.split()[0]}" in kind.__doc__
        assert "Annotated" not in str(signature.parameters[one.name])
    code = f"from taichi_ants import {kind.__name__}\n{kind.__name__}("
    [seen] = jedi.Script(code).get_signatures()
    assert {one.name for one in settings} <= {one.name for one in seen.params}


def test_editors_know_the_views_of_a_colony():
    code = "from taichi_ants import Colony, worlds\ncolony = Colony(worlds.paper())\ncolony."
    seen = {one.name for one in jedi.Script(code).complete()}
    of_features = {array.view for one in FEATURES for array in one.arrays}
    assert {*GENERATE.public_members(taichi_ants.Colony)} - of_features <= seen
