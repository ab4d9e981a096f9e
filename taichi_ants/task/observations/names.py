"""Names of rows that are made of a load and one code for each cell in view."""

from __future__ import annotations

from collections.abc import Callable

from taichi_ants.task.states import TASK_NAMES


def name_of_codes(n_cells: int, foraging: str, carrying: str) -> Callable[[int], str]:
    """A function that names rows, such as "foraging E T O".

    Args:
        n_cells: How many cells are in view; the row is the load, then their codes as digits.
        foraging, carrying: The letter of each code for an ant without and with food.
    """

    def name_of(row: int) -> str:
        codes = []
        for _ in range(n_cells):
            row, code = divmod(row, len(foraging))
            codes.append(code)
        letters = (foraging, carrying)[row]
        return " ".join((TASK_NAMES[row], *(letters[code] for code in reversed(codes))))

    return name_of
