"""What the paper's ants see: the three cells ahead, four codes each."""

from taichi_ants.task.observations.registry import Observation
from taichi_ants.task.states import state_name


def encode(view):
    """The paper's state itself."""
    return view.percept


PAPER = Observation(
    "paper",
    128,
    encode,
    name_of=state_name,
    summary="the three cells ahead, four codes each",
    shape=(2, 4, 4, 4),
)
