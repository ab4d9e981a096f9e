"""Settings as they are declared: what is taken, what is refused, and in which words."""

import math
import pickle
import re
from contextlib import suppress
from copy import deepcopy
from dataclasses import MISSING, asdict, dataclass, field, fields, is_dataclass, replace
from decimal import Decimal
from fractions import Fraction
from itertools import product
from operator import attrgetter
from typing import Annotated, Literal

import numpy as np
import pytest

from taichi_ants import AntsError, TrainingConfig, learners
from taichi_ants.interventions import INTERVENTIONS, Clear
from taichi_ants.protocol import EVENTS as EVENTS_BY_NAME
from taichi_ants.settings import (
    DeclaredSetting,
    Named,
    Setting,
    Settings,
    all_of,
    named_groups,
    nested,
)
from taichi_ants.studies.design import Design
from taichi_ants.task import Task
from taichi_ants.worlds import double_bridge, open_world

KINDS = (Task, TrainingConfig, open_world, double_bridge)
EVERY = {
    one.path: one
    for kind in (*KINDS, *(learners.get(n).hyperparameters for n in learners.names()))
    for one in (*all_of(kind), *(more for n in named_groups(kind) for more in all_of(n.entry)))
}
WRONG = {
    bool: [1, 0, "off", None],
    int: [True, np.True_, 2.0, "3", [4], 1j, Decimal(5)],
    float: [True, np.True_, "0.5", [0.5], 1j, math.nan, math.inf, -math.inf, 10**400, Decimal(1)],
    str: ["no such word", 5, ["set"], {}],
    list: [3, "3", 0.5],
    Named: [3, "home", [("home", {})]],
}


def wrong_values(one: DeclaredSetting) -> list:
    """Values that are not allowed."""
    if one.is_group:
        return ["no such name", [3]]
    rule, wrong = one.rule, list(WRONG[one.kind])
    if not one.allowed_words and one.kind is str:
        wrong.remove("no such word")
    beyond = 1 if one.kind is int else 1e-9
    if rule.least is not None:
        wrong += [rule.least - beyond if rule.least != 1e-37 else 9e-38]
    if rule.most is not None:
        wrong += [rule.most + max(beyond, rule.most * 1e-9)]
    if rule.above is not None:
        wrong += [rule.above]
    return wrong if one.optional else [*wrong, None]


@pytest.mark.parametrize(
    "one", [one for one in EVERY.values() if one.path != "training.learner"], ids=attrgetter("path")
)
def test_a_wrong_value_is_named_with_what_is_allowed(one):
    for value in wrong_values(one):
        with pytest.raises(AntsError) as caught:
            one.checked(value)
        message = str(caught.value)
        assert re.fullmatch(rf"`{re.escape(one.path)}` is .+; it must be .+\.", message), message


@pytest.mark.parametrize("one", EVERY.values(), ids=attrgetter("path"))
def test_defaults_and_bounds_are_allowed_and_plain(one):
    """NumPy's numbers are taken, and kept as Python's, so that equal settings are equal."""
    rule = one.rule
    for value in (one.default, rule.least, rule.most, rule.usual):
        if value not in (None, MISSING):
            assert type(one.checked(value)) is one.kind
    if one.kind is float and rule.least == 0:
        for value in (Fraction(1, 2), np.float32(0.5), 0, np.int8(0)):
            assert type(one.checked(value)) is float
    if one.kind is bool:
        assert one.checked(np.True_) is True
    assert one.rule.help
    assert not one.rule.help.endswith(".")


EVENTS = (*INTERVENTIONS.values(), *EVENTS_BY_NAME.values())
CLASSES = dict.fromkeys(
    cls
    for kind in (Task, TrainingConfig, Design, *EVENTS)
    for cls in (kind, *(one.entry if one.kind is Named else one.kind for one in all_of(kind)))
    if is_dataclass(cls)
)
NEEDED = {
    "learner": "sarsa", "learning_rate": 0.1, "discount": 0.9, "epsilon": 0.1,
    "epsilon_decay": 0.9, "number": 3, "what": "food", "cells": [(0, 0, 0)], "level": 3,
    "value": 0.5, "tick": 3, "ticks": 3, "measure": "ants", "above": 3,
    "values": {"pheromone.level": 5},
}  # fmt: skip
ODD = (
    *(None, True, 2**40, -1, 10**5000, 1.5, math.nan, 1j, "x", b"x", "\ud800", np.array(5)),
    *([], [[1], [1, 2]], {}, {1: 2}, {"": 1}, {"a": {}}, {2}, range(3), object(), int, ...),
    *(np.array([60]), np.array(["a"]), np.zeros((0, 3)), np.datetime64("2020-01-01")),
)


@pytest.mark.parametrize("cls", CLASSES, ids=attrgetter("__qualname__"))
def test_odd_values_are_taken_or_refused_in_a_sentence(cls):
    names = [one.name for one in fields(cls)]
    required = {
        one.name: NEEDED[one.name]
        for one in fields(cls)
        if one.default is MISSING is one.default_factory
    }
    makers = [lambda odd, name=name: cls(**{**required, name: odd}) for name in names]
    refusals = []
    for make, odd in product((*makers, cls.from_dict), ODD):
        with suppress(AntsError):
            make(odd)
            continue
        refusals.append(odd)
    assert refusals


def test_cells_can_be_an_array():
    assert Clear(np.array([60])) == Clear([60])


@dataclass(frozen=True)
class Soup(Settings, path="kitchen.soup"):
    """Settings of a test."""

    kind: Annotated[Literal["thin", "thick"], Setting("how thick it is")] = "thin"
    flour: Annotated[
        float | None, Setting("of flour", unit="g", above=0, usual=20.0, only=("kind", "thick"))
    ] = None
    salt: Annotated[
        int, Setting("of salt", unit="g", least=0, most=20_000), Setting(most=50_000)
    ] = 3
    note: str = ""  # not a setting


@dataclass(frozen=True)
class NamedSoup(Soup, path="kitchen.soups.NAME"):
    """A soup with a name."""


def refused(make) -> str:
    with pytest.raises(AntsError) as caught:
        make()
    return str(caught.value)


def test_what_depends_on_another_setting():
    assert Soup("thick").flour == 20
    assert replace(Soup("thick", 7), salt=5) == Soup("thick", 7, 5)
    assert Soup("thick", 7).replace(kind="thin") == Soup()


@pytest.mark.parametrize("order", [1, -1])
def test_a_group_and_its_settings_are_nested_in_any_order(order):
    named = {"kitchen.soup": "thick", "kitchen.soup.flour": 5}
    assert nested(dict([*named.items()][::order])) == {
        "kitchen": {"soup": {"": "thick", "flour": 5}}
    }


@dataclass(frozen=True)
class Kitchen(Settings, path="kitchen"):
    """Settings of a test, with named ones."""

    soups: Annotated[Named[NamedSoup], Setting("the soups")] = field(default_factory=Named)


def test_named_settings_are_checked_changed_and_compared_by_name_and_order():
    one = Kitchen({"first": {"salt": 5}, "second": NamedSoup(salt=7)})
    assert one.soups == {"first": NamedSoup(salt=5), "second": NamedSoup(salt=7)}
    assert one == Kitchen(one.soups) == pickle.loads(pickle.dumps(one)) == deepcopy(one)
    assert hash(one) == hash(Kitchen(deepcopy(one.soups)))
    assert asdict(one)["soups"]["first"]["salt"] == 5
    assert one != Kitchen(dict(reversed(one.soups.items())))
    more = one.replace(soups={"first": {"kind": "thick"}, "third": {}})
    assert list(more.soups.values()) == [NamedSoup("thick", salt=5), NamedSoup(salt=7), NamedSoup()]
    with pytest.raises(TypeError, match="read-only"):
        one.soups["first"] = NamedSoup()


@pytest.mark.parametrize(("make", "says"), [
    (lambda: Soup("thick", 0), ".soup.flour` is 0; it must be above 0."),
    (lambda: Soup(salt=60_000), ".soup.salt` is 60000; it must be between 0 and 50000."),
    (lambda: Soup(salt="3"),
     ".soup.salt` is '3'; it must be a whole number between 0 and 50000."),
    (lambda: Soup("thik"), ".soup.kind` is 'thik'; it must be one of thin, thick."),
    (lambda: Soup(flour=5), ".soup.flour` is 5.0; leave it out unless `kind` is 'thick'."),
    (lambda: replace(Soup("thick"), kind="thin"),
     ".soup.flour` is 20.0; leave it out unless `kind` is 'thick'."),
    (lambda: Soup.from_dict({"flower": 5}), ".soup.flower` is not a setting; choose flour."),
    (lambda: Kitchen({"first": {"salt": -1}}),
     ".soups.first.salt` is -1; it must be between 0 and 50000."),
    (lambda: Kitchen(3), ".soups` is 3; it must be a table of names, each with a NamedSoup."),
    (lambda: Kitchen({"first": 3}), ".soups.first` is 3; it must be a table of settings."),
    (lambda: Kitchen({"first": {"flower": 3}}),
     ".soups.first.flower` is not a setting; choose flour."),
])  # fmt: skip
def test_sentences(make, says):
    assert refused(make) == f"`kitchen{says}"
