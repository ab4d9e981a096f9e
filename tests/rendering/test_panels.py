"""The panel, marks of the view and text: what is there, and where it may be."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_ants import AntsError
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import Scene, Status, at_start, frames
from taichi_ants.rendering.colours import CHOSEN
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.task import observations
from taichi_ants.worlds import paper

WORLD = paper()
Q_VALUES = np.array([0.5, 7.0, -1.0, 0.0, 2.0], dtype=np.float32)


def picture(size=(640, 400), status: Status | None = None, **look: object) -> np.ndarray:
    return Scene(WORLD.grid, size, **look).draw(at_start(WORLD), status)


def blue_columns(frame: np.ndarray, rows: slice = slice(None)) -> np.ndarray:
    """How many pixels of each column are exactly in the colour of the chosen action."""
    blue = (frame[rows] == (CHOSEN >> 16, CHOSEN >> 8 & 255, CHOSEN & 255)).all(axis=2)
    return blue.sum(axis=0)


def status(action: int) -> Status:
    bars = {"q_values": Q_VALUES, "q_range": (-1.0, 10.0)}
    return Status((("step", "3"), ("return", "4")), state=8, action=action, **bars)


def test_the_bar_of_the_chosen_action_is_as_long_as_its_value() -> None:
    def length(action: int) -> int:
        return int((blue_columns(picture(status=status(action))) >= 5).sum())

    # Numbers in blue have columns as well, the same few for all.
    assert length(1) > 3 * length(4) > 0
    assert length(1) - length(4) == pytest.approx(2.5 * (length(4) - length(0)) * 4 / 3, abs=12)


@pytest.mark.parametrize("size", [(640, 400), (400, 700), (500, 500), (342, 1200), (1280, 720)])
def test_text_keeps_off_the_edges(size) -> None:
    """A margin of white around it tells that nothing was cut off."""
    lines = (("step", "10000"), ("return", "-9999"), ("episode", "epsilon 0.25 " * 9))
    state = Status(lines, state=8, action=3, q_values=Q_VALUES, q_range=(-1.0, 7.0))
    frame = picture(size, state, title="a title that is much longer than there is room for it" * 3)
    assert (frame[:2] == 255).all()
    assert (frame[-2:] == 255).all()
    assert (frame[:, -2:] == 255).all()


@pytest.mark.parametrize("size", [(320, 320), (320, 200), (200, 320), (1280, 720)])
def test_no_cell_in_view_is_cut_off_by_the_edge(size) -> None:
    """An ant at each cell of the world that sees all six around; the page stays white behind."""
    six, scene = observations.get("six_cells"), Scene(WORLD.grid, size, view=True)
    start = at_start(WORLD)
    for cell in np.flatnonzero(WORLD.grid.exists)[::5]:
        status = Status((), state=0, observation=six)
        frame = scene.draw(replace(start, ant_cells=np.array([cell])), status)
        for edge in (frame[0], frame[-1], frame[:, 0], frame[:, -1]):
            assert (edge == 255).all()
    (drawn,) = frames([(start, status)], size)
    assert (drawn == scene.draw(start, status)).all()


def test_pictures_without_a_panel_are_the_world_alone() -> None:
    """Where text would not fit, or without the overlay."""
    for size in ((64, 64), (320, 322)):
        assert (picture(size, title="x") == picture(size, overlay=False)).all()
    plain, whole = picture(overlay=False, title="x"), picture(title="x")
    assert (plain == Rasteriser(WORLD.grid, 640, 400, 7).draw(at_start(WORLD))).all()
    assert (whole[:, 480:] != 255).any()


SNAPSHOT = at_start(WORLD)
REFUSED = {
    "a small size": (lambda: Scene(WORLD.grid, (63, 100)), "from 64 to 4096|64 and 4096"),
    "a large size": (lambda: Scene(WORLD.grid, (100, 4097)), "64 and 4096"),
    "half a pixel": (lambda: Scene(WORLD.grid, (100.5, 100)), "size"),
    "one side": (lambda: Scene(WORLD.grid, (100,)), "a width and a height"),
    "no grid": (lambda: Scene(WORLD), "grid"),
    "no task": (lambda: Scene(WORLD.grid, task="paper"), "task"),
    "no snapshot": (lambda: Scene(WORLD.grid).draw(WORLD), "snapshot"),
    "no status": (lambda: Scene(WORLD.grid).draw(SNAPSHOT, 7), "status"),
    "another grid": (lambda: Scene(AxialGrid((3, 3, 3))).draw(SNAPSHOT), "has ranges"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused(name) -> None:
    call, message = REFUSED[name]
    with pytest.raises(AntsError, match=message):
        call()
