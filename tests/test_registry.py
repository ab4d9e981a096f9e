"""Names of learners, observations, worlds, measures and rules: listed, looked up, and refused."""

import pytest

from taichi_ants import AntsError, learners, measures, rules, worlds
from taichi_ants.features.rule import RULES
from taichi_ants.learners.q_learning import td_error
from taichi_ants.learners.registry import LEARNERS
from taichi_ants.measures.measure import MEASURES
from taichi_ants.task import Observation, observations
from taichi_ants.task.observations.observation import OBSERVATIONS
from taichi_ants.worlds.registry import WORLDS


def encode(view):
    return 0


def level_of(level):
    return level


# By kind: the registry, functions that register a name, look it up and list all, a name of the
# package (which for rules is only reserved), and one that is misspelled.
KINDS = {
    "learner": (
        *(LEARNERS, lambda name: learners.register(learners.td_learner(name, td_error))),
        *(learners.get, learners.names, "sarsa_lambda", "sarsa_lamda"),
    ),
    "observation": (
        *(OBSERVATIONS, lambda name: observations.register(Observation(name, 1, encode))),
        *(observations.get, observations.names, "five_cells", "five_cell"),
    ),
    "world": (
        *(WORLDS, lambda name: worlds.register(name, lambda: worlds.paper())),
        *(worlds.build, worlds.names, "double_bridge", "duble_bridge"),
    ),
    "measure": (
        *(MEASURES, lambda name: measures.register(name, len)),
        *(measures.get, measures.names, "entropy", "entropi"),
    ),
    "rule": (
        *(RULES, lambda name: rules.register("evaporation", name=name)(level_of)),
        *(rules.get, rules.names, "linear", "weakr"),
    ),
}


@pytest.fixture(params=KINDS)
def kind(request, monkeypatch):
    registry = KINDS[request.param][0]
    monkeypatch.setattr(registry, "yours", {})
    return request.param


def test_your_own_name_is_listed_last_and_replaced(kind):
    registry, register, get, names, built_in, _ = KINDS[kind]
    before = names()
    assert (built_in in before) == (kind != "rule")
    for _ in range(2):
        register("mine")
        assert names() == (*before, "mine")
    assert get("mine") is registry.yours["mine"] or kind == "world"


@pytest.mark.parametrize("name", ["two words", "a/b", "", "3rd", 3])
def test_a_name_is_a_word(kind, name):
    _, register, _, names, *_ = KINDS[kind]
    before = names()
    with pytest.raises(AntsError, match=f"^the name of the {kind} is .*; it must be a word"):
        register(name)
    assert names() == before


def test_a_name_of_the_package_cannot_be_replaced(kind):
    _, register, _, _, built_in, _ = KINDS[kind]
    says = f"^'{built_in}' is the name of a built-in {kind}, which cannot be replaced; choose ano"
    with pytest.raises(AntsError, match=says):
        register(built_in)


def test_an_unknown_name_is_answered_with_the_known_ones(kind):
    _, register, get, names, built_in, misspelled = KINDS[kind]
    register("weaker")
    similar = "weaker" if kind == "rule" else built_in
    known = f"(did you mean {similar}?); choose one of {', '.join(names())}, "
    for wrong in (misspelled, misspelled.upper()):
        with pytest.raises(AntsError) as caught:
            get(wrong)
        assert str(caught.value).startswith(f"there is no {kind} {wrong!r} {known}")
        assert str(caught.value).endswith(
            ".register, for commands in a file that you give with --plugin."
        )
    for name in ([built_in], None, "x" * 5000):
        with pytest.raises(AntsError):
            get(name)
