"""Worlds as drawings in plain text.

Hexagons are flat-topped. The cell straight up of a cell stands two lines above it in the same
column; the one up and to the right one line above and two columns to the right. So the cells of one
line are four columns apart, and neighbouring lines are offset by two.

    .  empty          Q  the queen      0 to 5  an ant with that heading
    #  obstacle       F  food           a to f  an ant with heading 0 to 5 on a trail
    t  trail                            (blanks are no cells)

Lines that start with `;` are comments. Above the drawing may stand `trail = 25`, the level of all
trails, and `ants = 2 0 1`, the numbers of the ants in reading order, if these are not 0, 1, 2.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from taichi_ants.errors import AntsError, shown
from taichi_ants.grid.hexgrid import AxialGrid, cube
from taichi_ants.worlds import drawing as marks
from taichi_ants.worlds.map_fit import smallest_world
from taichi_ants.worlds.world import World

DEFAULT_TRAIL_LEVEL = 25
MAX_MAP_CHARACTERS = 1 << 22


def load_map(path: str | os.PathLike[str]) -> World:
    """The world drawn in a text file (UTF-8), see `from_text`.

    Raises:
        AntsError: The file is missing, unreadable, too large or not text, or its map is damaged.
    """
    try:
        file = Path(path)
        if not file.is_file():
            # Devices and pipes may never end, so they are no map files either.
            what = "is no ordinary file" if file.exists() else "does not exist"
            raise AntsError(f"{file} {what}; give the path of a map file.")
        if file.stat().st_size > MAX_MAP_CHARACTERS:
            raise AntsError(_too_long(str(file), file.stat().st_size))
        text = file.read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        raise AntsError(f"{path} is no text file; give the path of a map file.") from None
    except (OSError, TypeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise AntsError(f"the map file {shown(path)} cannot be read: {reason}.") from None
    if "\0" in text:
        raise AntsError(f"{path} is no text file; give the path of a map file.")
    return from_text(text, str(path))


def from_text(text: str, source: str = "the map") -> World:
    """The world drawn in `text`, in the form that the module's docstring describes.

    The ranges are those of the smallest world that holds the drawn cells; cells of it that are not
    drawn become obstacles. Ants are numbered in reading order unless the map says otherwise.

    Args:
        text: The map, at most `MAX_MAP_CHARACTERS` characters.
        source: What error messages call it.

    Raises:
        AntsError: The map is damaged; names line, column, what stands there and what is allowed.
    """
    if not isinstance(text, str):
        raise AntsError(f"{source} is {type(text).__name__}; it must be text.")
    if len(text) > MAX_MAP_CHARACTERS:
        raise AntsError(_too_long(source, len(text)))
    text = text.removeprefix("\ufeff")  # the byte-order mark with which some editors begin a file
    settings, drawing = marks.read(text, source)
    axials = drawing.axials()
    ranges, origin = smallest_world(axials)
    cells = cube(axials - origin)
    grid = AxialGrid(ranges)
    undrawn = grid.exists.copy()
    undrawn[grid.index(cells)] = False

    on_trail = cells[drawing.are_any(marks.TRAIL + marks.ANTS_ON_TRAIL)]
    (level,) = settings.get("trail", [DEFAULT_TRAIL_LEVEL])
    is_ant = drawing.are_any(marks.ANTS + marks.ANTS_ON_TRAIL)
    codes = drawing.codes[is_ant]
    headings = codes - np.where(codes < ord("a"), ord("0"), ord("a"))
    ants = np.column_stack([cells[is_ant], headings])
    numbers = settings.get("ants", range(len(ants)))
    if len(numbers) != len(ants):
        raise AntsError(
            f"{source} sets the numbers of {len(numbers)} ants but draws {len(ants)}; "
            "give as many numbers as ants, or none."
        )
    return World(
        ranges,
        cells[drawing.are_any(marks.QUEEN)][0],
        foods=cells[drawing.are_any(marks.FOOD)],
        obstacles=np.concatenate(
            [cells[drawing.are_any(marks.OBSTACLE)], grid.cells(np.flatnonzero(undrawn))]
        ),
        trails=np.column_stack([on_trail, np.full(len(on_trail), level)]),
        ants=ants[np.argsort(numbers)],
    )


def to_text(world: World) -> str:
    """The map of a world; `from_text` gives an equal world back.

    Raises:
        AntsError: The world has trails of several levels, or under food or the queen, which a map
            cannot show; or its map would have more than `MAX_MAP_CHARACTERS` characters.
    """
    if not isinstance(world, World):
        raise AntsError(f"world is {shown(world)}; it must be a World.")
    grid = world.grid
    if grid.count > MAX_MAP_CHARACTERS:
        raise AntsError(_too_long("the map", grid.count))
    existing = np.flatnonzero(grid.exists)
    rows, columns = marks.places(grid.cells(existing))
    rows, columns = rows - rows.min(), columns - columns.min()
    height, width = int(rows.max()) + 1, int(columns.max()) + 1
    if height * (width + 1) > MAX_MAP_CHARACTERS:
        raise AntsError(_too_long("the map", height * (width + 1)))
    page = np.full((height, width), ord(" "), dtype=np.uint8)
    page[rows, columns] = _marks(world)[existing]
    drawn = [row.tobytes().decode("ascii").rstrip() for row in page]
    return "\n".join(_settings(world) + drawn) + "\n"


def _marks(world: World) -> np.ndarray:
    """uint8 (grid.size,): the characters of a world's cells."""
    index = world.grid.index
    page = np.full(world.grid.size, ord(marks.EMPTY), dtype=np.uint8)
    page[index(world.trails[:, :3])] = ord(marks.TRAIL)
    covered = np.concatenate([[world.queen], world.foods])
    hidden = covered[page[index(covered)] == ord(marks.TRAIL)]
    if len(hidden):
        raise AntsError(
            f"a trail lies on {tuple(hidden[0].tolist())} under the queen or food, which a map "
            "cannot show; take it out of the trails."
        )
    page[index(world.obstacles)] = ord(marks.OBSTACLE)
    page[index(world.foods)] = ord(marks.FOOD)
    page[index(world.queen)] = ord(marks.QUEEN)
    places = index(world.ants[:, :3])
    bare = page[places] == ord(marks.EMPTY)
    page[places] = world.ants[:, 3] + np.where(
        bare, ord(marks.ANTS[0]), ord(marks.ANTS_ON_TRAIL[0])
    )
    return page


def _settings(world: World) -> list[str]:
    """The lines above the drawing."""
    settings = []
    levels = np.unique(world.trails[:, 3])
    if len(levels) > 1:
        raise AntsError(
            f"the trails have {len(levels)} levels from {levels[0]} to {levels[-1]}, but a map can "
            "show one only; give all trails the same level."
        )
    if len(levels):
        settings.append(f"trail = {levels[0]}")
    rows, columns = marks.places(world.ants[:, :3])
    numbers = np.lexsort((columns, rows))
    if (np.diff(numbers) < 0).any():
        settings.append("ants = " + " ".join(str(number) for number in numbers))
    return settings


def _too_long(source: str, length: int) -> str:
    return (
        f"{source} has {length} characters; a map may have at most {MAX_MAP_CHARACTERS}, "
        "so choose a smaller one."
    )
