"""States by their names."""

from taichi_ants.task.constants import N_STATES
from taichi_ants.task.states import state_name

_NAMES = [state_name(index) for index in range(N_STATES)]


def parse_state(name: str) -> int:
    """The index of a state, such as "foraging E T O"."""
    return _NAMES.index(name)
