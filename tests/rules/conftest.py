"""The rules of tests are registered while a file of this folder runs, and forgotten after it."""

import importlib

import own_rules
import pytest

from taichi_ants.features.rule import RULES

RULES.yours.clear()


@pytest.fixture(scope="module", autouse=True)
def _registered():
    importlib.reload(own_rules)
    yield
    RULES.yours.clear()
