"""Indices of states by name."""

from taichi_ants.task.constants import N_STATES
from taichi_ants.task.states import state_name

_NAMES = [state_name(index) for index in range(N_STATES)]


def parse_state(name: str) -> int:
    """Return the index of a state from its name, for example "foraging E T O"."""
    return _NAMES.index(name)
