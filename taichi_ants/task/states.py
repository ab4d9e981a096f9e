"""The states of an ant: what it carries and what it sees, their indices and their names.

An ant sees three cells, in the order left, forward, right. Each is one of four letters: E (empty),
O (obstacle), then T (trail) or F (food) for an ant without food, S (nearer to the queen) or
Q (queen) for an ant with food. A state is written as the ant's task and the three letters, for
example "foraging E T O" or "carrying S E O".
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from numbers import Integral

from taichi_ants.errors import AntsError, shown
from taichi_ants.grid.constants import HEADING_STEPS, N_HEADINGS
from taichi_ants.task.constants import N_STATES, SEES_EMPTY, SEES_GOAL, SEES_LURE, SEES_OBSTACLE

# Indexed by `carries`, then by code.
TASK_NAMES: tuple[str, str] = ("foraging", "carrying")
CELL_LETTERS: tuple[str, str] = ("EOTF", "EOSQ")


@dataclass(frozen=True)
class State:
    """What an ant knows.

    Attributes:
        carries: Whether it carries food.
        left: Code 0..3 of the cell at heading - 1.
        forward: Code 0..3 of the cell at its heading.
        right: Code 0..3 of the cell at heading + 1.
    """

    carries: bool
    left: int
    forward: int
    right: int

    @property
    def view(self) -> tuple[int, int, int]:
        """The three codes in the order of the moves: left, forward, right."""
        return self.left, self.forward, self.right


def state_index(carries: bool, left: int, forward: int, right: int) -> int:
    """The index 64 * carries + 16 * left + 4 * forward + right, in 0..127.

    Raises:
        AntsError: A code is not 0, 1, 2 or 3.
    """
    for name, code in (("left", left), ("forward", forward), ("right", right)):
        if not isinstance(code, Integral) or not 0 <= code <= 3:
            raise AntsError(
                f"the code of the cell {name} is {shown(code)}; it must be 0, 1, 2 or 3."
            )
    return 64 * bool(carries) + 16 * int(left) + 4 * int(forward) + int(right)


def state_from_index(index: int) -> State:
    """The state of an index in 0..127, the inverse of `state_index`.

    Raises:
        AntsError: The index lies outside 0..127.
    """
    if not isinstance(index, Integral) or not 0 <= index < N_STATES:
        raise AntsError(
            f"the state index is {shown(index)}; it must be a whole number from 0 to "
            f"{N_STATES - 1}."
        )
    index = int(index)
    return State(bool(index >> 6), (index >> 4) & 3, (index >> 2) & 3, index & 3)


def state_name(index: int) -> str:
    """The name of a state, for example "foraging E T O"; raises as `state_from_index` does."""
    state = state_from_index(index)
    letters = CELL_LETTERS[state.carries]
    return " ".join((TASK_NAMES[state.carries], *(letters[code] for code in state.view)))


def parse_state(name: str) -> int:
    """The index of a state's name, the inverse of `state_name`; case does not matter.

    Raises:
        AntsError: The text is not the name of a state.
    """
    words = name.split() if isinstance(name, str) else []
    if len(words) == 4 and words[0].lower() in TASK_NAMES:
        carries = TASK_NAMES.index(words[0].lower())
        codes = [CELL_LETTERS[carries].find(word.upper()) for word in words[1:]]
        if all(len(word) == 1 for word in words[1:]) and -1 not in codes:
            return state_index(bool(carries), *codes)
    raise AntsError(
        f"{shown(name)} is not a state; write the ant's task and the three cells it sees, left, "
        "forward, right, as in 'foraging E T O' (letters E, O, T, F) or 'carrying S E O' "
        "(letters E, O, S, Q)."
    )


def _foraging_indices() -> set[int]:
    """Any cell in view can be empty, blocked, food or (equally strong, so all seen) a trail."""
    codes = (SEES_EMPTY, SEES_OBSTACLE, SEES_LURE, SEES_GOAL)
    return {state_index(False, *view) for view in product(codes, repeat=3)}


def _carrying_indices() -> set[int]:
    """What an ant with food can see, from where it can stand and turn.

    The pattern of nearer neighbours depends only on the direction of the queen, so the cells
    within distance 2 of her show every pattern. Each cell but hers may be empty or blocked.
    """
    indices = set()
    for x, y in product(range(-2, 3), repeat=2):
        own = _distance((x, y, 0))
        if not 1 <= own <= 2:
            continue
        around = [_distance((x + dx, y + dy, dz)) for dx, dy, dz in HEADING_STEPS]
        for heading in range(N_HEADINGS):
            seen = [around[(heading + turn) % N_HEADINGS] for turn in (-1, 0, 1)]
            choices = [
                (SEES_GOAL,)
                if distance == 0
                else (SEES_OBSTACLE, SEES_LURE if distance < own else SEES_EMPTY)
                for distance in seen
            ]
            indices |= {state_index(True, *view) for view in product(*choices)}
    return indices


def _distance(cell: tuple[int, int, int]) -> int:
    """Distance to the origin: the largest coordinate of the normal form."""
    return max(cell) - min(cell)


# The 100 indices that the rules can produce, ascending.
REACHABLE_STATES: tuple[int, ...] = tuple(sorted(_foraging_indices() | _carrying_indices()))
