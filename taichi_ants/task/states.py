"""The states of the paper's ants: their codes, indices and names.

An ant sees three cells: left, forward and right. Each is one of four letters: E (empty) or O
(obstacle); T (trail) or F (food) for an ant without food; S (nearer to the queen) or Q (queen) for
an ant with food. The name of a state is the ant's load and the three letters, for example
"foraging E T O" or "carrying S E O".
"""

from __future__ import annotations

from collections.abc import Callable

from taichi_ants.errors import checked_whole
from taichi_ants.task.constants import N_STATES, SEES_CUE, SEES_GOAL

__all__ = ["CELL_LETTERS", "REACHABLE_STATES", "TASK_NAMES", "state_from_index", "state_name"]
# Indexed by `carries`; letters are then indexed by code.
TASK_NAMES: tuple[str, str] = ("foraging", "carrying")
CELL_LETTERS: tuple[str, str] = ("EOTF", "EOSQ")


def state_from_index(index: int) -> tuple[bool, int, int, int]:
    """Return the load and the codes left, forward and right of a state, by its index, 0 to 127.

    >>> states.state_from_index(8)
    (False, 0, 2, 0)
    """
    index = checked_whole("the state index", index, 0, N_STATES - 1)
    return bool(index >> 6), (index >> 4) & 3, (index >> 2) & 3, index & 3


def name_of_codes(n_cells: int, foraging: str, carrying: str) -> Callable[[int], str]:
    """Return a function that names states of n cells in view by the letters of their codes."""

    def name_of(row: int) -> str:
        """Return the name of a state by its index, which is the row of a table.

        >>> states.state_name(8)
        'foraging E T E'
        """
        row, codes = checked_whole("a state", row, 0, 2 * len(foraging) ** n_cells - 1), []
        for _ in range(n_cells):
            row, code = divmod(row, len(foraging))
            codes.append(code)
        letters = (foraging, carrying)[row]
        return " ".join((TASK_NAMES[row], *(letters[code] for code in reversed(codes))))

    return name_of


state_name = name_of_codes(3, *CELL_LETTERS)


def _can_occur(carries: bool, *view: int) -> bool:  # see section 1.5 of the paper
    queens, nearer = view.count(SEES_GOAL), view.count(SEES_CUE)
    if not carries:
        return True
    if queens:  # there is only one, and no cell is nearer to her than her neighbours
        return queens == 1 and nearer == 0
    return not view[0] == view[2] == SEES_CUE


# The 100 indices that can occur under the rules, ascending.
REACHABLE_STATES: tuple[int, ...] = tuple(
    index for index in range(N_STATES) if _can_occur(*state_from_index(index))
)
