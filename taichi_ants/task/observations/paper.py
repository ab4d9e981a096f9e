"""The observation of the paper's ants: the three cells ahead, four codes each."""

from taichi_ants.task.observations.observation import of_codes


def encode(view):
    """Return the paper's state index."""
    return view.paper_state


PAPER = of_codes("paper", encode, summary="the three cells ahead, four codes each")
