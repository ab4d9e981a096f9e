"""The observation of the paper's ants: the three cells ahead, four codes each."""

from taichi_ants.task.observations.observation import Observation
from taichi_ants.task.states import state_name


def encode(view):
    """Return the paper's state index."""
    return view.paper_state


PAPER = Observation(
    "paper",
    128,
    encode,
    name_of=state_name,
    summary="the three cells ahead, four codes each",
    shape=(2, 4, 4, 4),
)
