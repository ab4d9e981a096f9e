"""The reference: what declarations give, and an example that runs for each public object."""

from __future__ import annotations

import doctest
import importlib.util
import inspect

import jedi
import pytest
from command_lines import ROOT

import taichi_ants
from taichi_ants import Pheromone, Task, TrainingConfig
from taichi_ants.features.rule import RULES
from taichi_ants.learners.registry import LEARNERS
from taichi_ants.measures.measure import MEASURES
from taichi_ants.settings import declared
from taichi_ants.task.observations.observation import OBSERVATIONS
from taichi_ants.worlds.registry import WORLDS

_PAGE = (ROOT / "docs" / "reference" / "api.md").read_text("utf-8")
SETUP = next(
    code for code in _PAGE.split("```python\n") if code.startswith("from taichi_ants import *")
)


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
OF_THE_PACKAGE = GENERATE.public_names(taichi_ants)


def test_the_reference_is_made_from_the_declarations(monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    for registry in REGISTRIES:  # without what other tests have registered
        monkeypatch.setattr(registry, "yours", {})
    pages = GENERATE.pages()
    assert len(pages) > 25
    old = [path.name for path, text in pages.items() if path.read_text("utf-8") != text]
    assert not old, f"run `python docs/generate.py`, which changes {', '.join(old)}"


def test_every_public_object_is_described():
    described = {name: inspect.getdoc(value) or "" for name, value in PUBLIC.items()}
    assert len(described) > 150
    assert [name for name, text in described.items() if len(text.split()) < 4] == []
    colony = taichi_ants.Colony
    names = [name for name in dir(colony) if not name.startswith("_")]
    assert len(names) < 50
    bare = [name for name in names if not inspect.getdoc(inspect.getattr_static(colony, name))]
    assert bare == []


@pytest.mark.parametrize("name", OF_THE_PACKAGE)
def test_every_object_of_the_package_has_an_example(name):
    assert ">>> " in inspect.getdoc(PUBLIC[f"taichi_ants.{name}"])


@pytest.fixture(scope="module")
def names():
    """The names with which the examples begin."""
    made: dict[str, object] = {}
    exec(SETUP.split("```")[0], made)
    return made


_SHOWN = {
    id(value): name for name, value in reversed(PUBLIC.items()) if ">>> " in (value.__doc__ or "")
}


@pytest.mark.parametrize("name", _SHOWN.values())
def test_the_example_of(name, names, monkeypatch):
    for registry in REGISTRIES:
        monkeypatch.setattr(registry, "yours", dict(registry.yours))
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner(verbose=False)
    text, failures = inspect.getdoc(PUBLIC[name]), []
    example = parser.get_doctest(text, dict(names), name, None, 0)
    names["colony"].begin_episode()
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
