"""The characters of a text map and the cells that they stand for."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from taichi_ants.errors import AntsError, shown
from taichi_ants.grid.hexgrid import axial
from taichi_ants.task.constants import MAX_TRAIL_LEVEL

EMPTY, OBSTACLE, FOOD, QUEEN, TRAIL = ".#FQt"
ANTS = "012345"  # by heading
ANTS_ON_TRAIL = "abcdef"

_CELLS = EMPTY + OBSTACLE + FOOD + QUEEN + TRAIL + ANTS + ANTS_ON_TRAIL
_ALLOWED = ". # F Q t, 0 to 5, a to f and blanks"
_SETTING = re.compile(r"\s*([A-Za-z]\w*)\s*=(.*)", re.DOTALL)


@dataclass(frozen=True)
class Drawing:
    """The characters of a map that are no blanks, in reading order, checked.

    Attributes:
        source: What error messages call the map.
        codes: Code points, int64 (n,).
        rows: Lines of the drawing, comments not counted, int64 (n,).
        columns: Counted from 0, int64 (n,).
        lines: Lines of the text, from 1, int64 (n,).
    """

    source: str
    codes: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    lines: np.ndarray

    def are_any(self, characters: str) -> np.ndarray:
        """bool (n,): which characters are among the given ones."""
        return np.isin(self.codes, [ord(character) for character in characters])

    def axials(self) -> np.ndarray:
        """int64 (n, 2): the axial coordinates (q, r) of the characters, up to a shift.

        Raises:
            AntsError: A character stands between the hexagons that the others form.
        """
        # A column is 2 r, a row r - 2 q, both up to a shift. So the parity of the column, and that
        # of row - r, are the same for all cells; the majority decides which they are.
        odd = self.columns % 2
        r = (self.columns - odd) // 2
        grids = 2 * odd + (self.rows - r) % 2
        grid = np.bincount(grids).argmax()
        stray = np.flatnonzero(grids != grid)
        if len(stray):
            raise AntsError(
                f"{self._found(stray[0])} between the hexagons; the cells of a line are four "
                "columns apart, and neighbouring lines are offset by two."
            )
        return np.stack([(r - self.rows + grid % 2) // 2, r], axis=1)

    def check(self) -> None:
        """Raises AntsError if there are no cells, unknown characters, or not exactly one queen."""
        if not len(self.codes):
            raise AntsError(f"{self.source} draws no cell; draw cells with {_ALLOWED}.")
        unknown = np.flatnonzero(~self.are_any(_CELLS))
        if len(unknown):
            raise AntsError(f"{self._found(unknown[0])}; allowed are {_ALLOWED}.")
        queens = np.flatnonzero(self.are_any(QUEEN))
        if not len(queens):
            raise AntsError(f"{self.source} has no queen; draw one cell as {QUEEN}.")
        if len(queens) > 1:
            raise AntsError(f"{self._found(queens[1])}, a second queen; only one is allowed.")

    def _found(self, i: int) -> str:
        place = f"line {self.lines[i]}, column {self.columns[i] + 1} of {self.source}"
        return f"{place} has {chr(self.codes[i])!r}"


def read(text: str, source: str) -> tuple[dict[str, list[int]], Drawing]:
    """The settings of a map, and its drawing.

    Returns:
        The settings by name, each with its numbers, and the drawing.

    Raises:
        AntsError: A line or a character is not allowed.
    """
    settings: dict[str, list[int]] = {}
    drawn: list[str] = []
    numbers: list[int] = []
    begun = False
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, line in enumerate(lines, start=1):
        if line.lstrip().startswith(";"):
            continue
        if setting := _SETTING.fullmatch(line):
            name, values = _read_setting(f"line {number} of {source}", *setting.groups())
            if begun or name in settings:
                raise AntsError(
                    f"line {number} of {source} sets {name} "
                    f"{'below the drawing' if begun else 'a second time'}; "
                    "settings stand above the drawing, each once."
                )
            settings[name] = values
            continue
        begun = begun or bool(line.strip())
        drawn.append(line)
        numbers.append(number)

    # Lone surrogates are characters that are not allowed, not a reason to fail here.
    encoded = "\n".join(drawn).encode("utf-32-le", errors="surrogatepass")
    codes = np.frombuffer(encoded, dtype="<u4").astype(np.int64)
    breaks = codes == ord("\n")
    rows = np.cumsum(breaks)
    begins = np.concatenate([[0], np.flatnonzero(breaks) + 1])
    columns = np.arange(len(codes)) - begins[rows]
    cells = np.flatnonzero(~breaks & (codes != ord(" ")))
    rows = rows[cells]
    drawing = Drawing(source, codes[cells], rows, columns[cells], np.array(numbers)[rows])
    drawing.check()
    return settings, drawing


def places(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns int64 (n,) of cells (n, 3) in a drawing, both up to a shift."""
    q, r = axial(cells).T
    return r - 2 * q, 2 * r


def _read_setting(where: str, name: str, text: str) -> tuple[str, list[int]]:
    """Name and numbers of a setting."""
    words = text.split()
    whole = all(re.fullmatch("[0-9]{1,10}", word) for word in words)
    values = [int(word) for word in words] if whole else []
    if name == "trail":
        if len(values) != 1 or not 1 <= values[0] <= MAX_TRAIL_LEVEL:
            raise AntsError(
                f"{where} sets trail to {shown(text.strip())}; it must be a whole number "
                f"from 1 to {MAX_TRAIL_LEVEL}."
            )
    elif name == "ants":
        if sorted(values) != list(range(len(values))) or not values:
            raise AntsError(
                f"{where} sets ants to {shown(text.strip())}; it must be the numbers of the drawn "
                "ants in reading order, each from 0 to their number less 1 once."
            )
    else:
        raise AntsError(f"{where} sets {shown(name)}; the settings are trail and ants.")
    return name, values
