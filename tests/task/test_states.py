"""State indices and names, worked by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants.task.constants import N_STATES
from taichi_ants.task.states import state_from_index, state_name


@pytest.mark.parametrize(
    ("state", "index", "name"),
    [
        ((False, 0, 0, 0), 0, "foraging E E E"),
        ((False, 0, 2, 1), 9, "foraging E T O"),
        ((False, 3, 1, 2), 54, "foraging F O T"),
        ((False, 3, 3, 3), 63, "foraging F F F"),
        ((True, 0, 0, 0), 64, "carrying E E E"),
        ((True, 2, 3, 1), 109, "carrying S Q O"),
        ((True, 1, 1, 1), 85, "carrying O O O"),
        ((True, 3, 3, 3), 127, "carrying Q Q Q"),
    ],
)
def test_index_and_name_of_a_state(state: tuple, index: int, name: str) -> None:
    assert state_from_index(index) == state
    assert state_name(index) == name


@given(st.integers(0, N_STATES - 1))
def test_every_index_comes_back_from_its_state(index: int) -> None:
    carries, left, forward, right = state_from_index(index)
    assert index == 64 * carries + 16 * left + 4 * forward + right
