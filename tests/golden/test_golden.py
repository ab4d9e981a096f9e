"""Results, kernels and the physics number are those recorded; see record.py and kernels.py."""

import kernels
import pytest
import record
from drawing import GROUPS

from taichi_ants import PHYSICS

AGAIN = "if results should change, see the head of tests/golden/record.py"


def expect_equal(found: dict[str, str]) -> None:
    lines = record.differences(found, record.recorded()[1])
    assert not lines, "\n".join([*lines, AGAIN])


def test_some_colonies():
    """Of one model, with most features; those of `test_by_ant.py` have fields and noise."""
    expect_equal(record.section("labour_nests", 11))


def test_some_trainings():
    for learner in ("q_learning", "sarsa"):
        expect_equal(record.section(learner, 3))


@pytest.mark.long
@pytest.mark.parametrize("name", [*GROUPS, "trainings", "studies", "frames"])
def test_all(name):
    expect_equal(record.section(name))


def test_all_that_is_recorded_is_compared():
    _, hashes = record.recorded()
    colonies = [name for name in hashes if name.rsplit("-", 1)[0] in GROUPS]
    trained = [name for name in hashes if name.split("-")[0] in record.TRAINED]
    assert (len(colonies), len(trained)) == (300, 104)
    assert len({hashes[name] for name in colonies + trained}) == 404


def test_the_physics_number_is_that_of_the_hashes():
    assert record.recorded()[0] == PHYSICS, AGAIN


@pytest.mark.parametrize(
    ("changed", "number", "old", "words"),
    [
        (True, 1, 1, "raise taichi_ants.PHYSICS"),
        (False, 2, 1, "no hash changed"),
        (True, 2, 1, None),
        (False, 1, 1, None),
    ],
)
def test_hashes_change_if_and_only_if_the_physics_number_does(changed, number, old, words):
    refused = record.refusal(changed, number, old)
    assert refused is None if words is None else words in refused


def test_a_difference_names_what_differs():
    lines = record.differences({"a": "0" * 54, "b": "1"}, {"a": "0" * 12 + "1" * 42, "b": "1"})
    assert lines == ["a: differs in part 3 of 9, ticks 21 to 30 of 80"]


@pytest.mark.long
def test_kernels_are_those_recorded():
    expected = kernels.recorded().get(kernels.version())
    if expected is None:
        pytest.skip(f"no names are recorded for {kernels.version()}")
    found = set(kernels.compiled())
    assert found == {*expected}, (
        "if kernels should change, run python tests/golden/kernels.py --write"
    )
