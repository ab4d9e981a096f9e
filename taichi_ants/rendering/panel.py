"""The text beside a world: what the ant does, and what the colours mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_ants.rendering import colours, text
from taichi_ants.rendering.marks import ants, cell
from taichi_ants.rendering.rasteriser import draw_marks
from taichi_ants.rendering.state_names import PAPER, Observation
from taichi_ants.task.constants import ACTION_NAMES, N_ACTIONS

# A cell by its letter, whether an ant on it carries food, a letter on it, and what it is called.
_LEGEND = (
    ("E", None, "", "empty (E)"),
    ("O", None, "", "obstacle (O)"),
    ("F", None, "", "food (F)"),
    ("Q", None, "", "queen (Q)"),
    ("E", None, "S", "nearer to the queen"),
    ("E", False, "", "ant"),
    ("E", True, "", "ant with food"),
)

LEGEND_HEIGHT = 14.8  # in sizes of the text


@dataclass(frozen=True, eq=False)
class Status:
    """The text about a snapshot.

    Attributes:
        lines: Names and values, such as ("step", "12").
        state: Number of the state that ant number 0 is in; None if there is none to speak of.
        q_values: float (5,), the action values of the state; None draws no bars.
        action: The chosen action, 0 to 4; None if there is none.
        q_range: The action values at both ends of the bars, the first at most 0, the last above.
        observation: What the state is a state of.
    """

    lines: tuple[tuple[str, str], ...]
    state: int | None = None
    q_values: np.ndarray | None = None
    action: int | None = None
    q_range: tuple[float, float] = (0.0, 1.0)
    observation: Observation = PAPER


def draw_status(
    frame: np.ndarray, status: Status, left: int, top: int, width: int, size: int
) -> None:
    """Draw what is said into a part of a frame, uint8 (height, width, 3), in text of a size."""
    y = top + size
    for label, value in status.lines:
        text.write(frame, label, left, y, size, colours.FAINT_INK)
        room = width - text.width(label + "  ", size)
        text.write(frame, value, left + width, y, size, align="right", room=room)
        y += round(1.45 * size)
    if status.q_values is not None:
        y += round(0.3 * size)
        text.write(frame, "action values Q", left, y, size, colours.FAINT_INK)
        _draw_bars(frame, status, left, y + round(0.5 * size), width, size)


def _draw_bars(
    frame: np.ndarray, status: Status, left: int, top: int, width: int, size: int
) -> None:
    start = left + max(text.width(name, size) for name in ACTION_NAMES) + 0.6 * size
    end = left + width - text.width("-00.00", size) - 0.3 * size
    low, high = status.q_range
    pixels = (end - start) / (high - low)
    zero = start - low * pixels
    pitch, thickness = round(1.4 * size), round(0.75 * size)
    for action, value in enumerate(np.asarray(status.q_values, dtype=float).tolist()):
        y = top + action * pitch
        ends = sorted((zero, zero + min(max(value, low), high) * pixels))
        bar, ink = colours.RULE, colours.INK
        if action == status.action:
            bar = ink = colours.CHOSEN
        fill(frame, ends[0], y + 0.35 * size, ends[1] - ends[0], thickness, bar)
        baseline = y + round(1.05 * size)
        text.write(frame, ACTION_NAMES[action], left, baseline, size, ink)
        number = f"{round(value, 2) + 0.0:.2f}"  # no minus zero
        text.write(frame, number, left + width, baseline, size, ink, align="right")
    fill(frame, zero - 1, top + 0.1 * size, 1, N_ACTIONS * pitch - 0.1 * size, colours.FAINT_INK)


def draw_legend(
    frame: np.ndarray, left: int, top: int, width: int, size: int, hexagon: float, strongest: int
) -> None:
    """Draw what colours, shapes and letters mean, `LEGEND_HEIGHT` sizes of the text high.

    The world's hexagons have `hexagon` pixels, trails of the level `strongest` the darkest colour.
    """
    pitch, radius = round(1.55 * size), 0.82 * size
    for row, (kind, carries, letter, label) in enumerate(_LEGEND):
        x, y = left + 0.85 * size, top + row * pitch + 0.75 * size
        tables = [cell(kind, (x, y), radius)]
        if carries is not None:
            tables.append(ants((x, y), 1, np.array([carries]), hexagon, 0.83 * radius))
        draw_marks(frame, *tables)
        baseline = round(y + 0.36 * size)
        text.write(frame, letter, x, baseline, size, align="middle")
        text.write(frame, label, left + round(2.1 * size), baseline, size)
    y = top + len(_LEGEND) * pitch + round(1.45 * size)
    text.write(frame, "trail (T), by strength", left, y, size)
    y += round(0.45 * size)
    columns = np.linspace(0, len(colours.TRAIL_RAMP) - 1, width).astype(int)
    ramp = colours.channels(colours.TRAIL_RAMP[columns])
    frame[y : y + round(0.7 * size), left : left + width] = ramp
    y += round(1.75 * size)
    text.write(frame, "1", left, y, size, colours.FAINT_INK)
    most = f"{strongest} and more"
    text.write(frame, most, left + width, y, size, colours.FAINT_INK, align="right")


def fill(
    frame: np.ndarray, left: float, top: float, width: float, height: float, colour: int
) -> None:
    """Fill a rectangle, its edges rounded to whole pixels."""
    x, y = max(0, round(left)), max(0, round(top))
    frame[y : round(top + height), x : round(left + width)] = colours.channels(colour)
