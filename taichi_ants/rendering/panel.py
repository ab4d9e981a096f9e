"""The text beside a world: what the ant does, and what the colours mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.observed import PAPER, Observation
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.snapshot import Snapshot
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.task.constants import ACTION_NAMES, EMPTY, FOOD, N_ACTIONS, OBSTACLE, QUEEN

# What a cell holds, what an ant on it carries, a letter on it, and what it is called.
_LEGEND = (
    (EMPTY, None, "", "empty (E)"),
    (OBSTACLE, None, "", "obstacle (O)"),
    (FOOD, None, "", "food (F)"),
    (QUEEN, None, "", "queen (Q)"),
    (EMPTY, None, "S", "nearer to the queen"),
    (EMPTY, False, "", "ant"),
    (EMPTY, True, "", "ant with food"),
)

# Heights in sizes of the text.
STATUS_HEIGHT = 18.2
LEGEND_HEIGHT = 14.8


@dataclass(frozen=True, eq=False)
class Status:
    """What the head-up lines say.

    Attributes:
        step: Number of the step in its episode, from 0; for a colony, of the tick.
        episode_return: Sum of the rewards so far; None leaves it out.
        episode: What kind of episode it is, or its number; empty leaves it out.
        state: Number of the state that ant number 0 is in; None if there is none to speak of.
        action: The chosen action, 0 to 4; None if there is none.
        q_values: float (5,), the action values of the state; None draws no bars.
        q_range: The action values at both ends of the bars, the first at most 0, the last above;
            None takes those of `q_values`.
        outcome: How the episode ended; empty while it goes on.
        more: Further lines, (name, value), for example of a colony.
        step_name: What a step is called.
        observation: What the state is a state of.
    """

    step: int
    episode_return: int | None = None
    episode: str = ""
    state: int | None = None
    action: int | None = None
    q_values: np.ndarray | None = None
    q_range: tuple[float, float] | None = None
    outcome: str = ""
    more: tuple[tuple[str, str], ...] = ()
    step_name: str = "step"
    observation: Observation = PAPER


def range_with_zero(q_values: np.ndarray) -> tuple[float, float]:
    """The lowest and the highest of action values and 0, never the same."""
    low, high = float(np.min(q_values, initial=0.0)), float(np.max(q_values, initial=0.0))
    return (low, high) if high > low else (0.0, 1.0)


def draw_status(frame: np.ndarray, status: Status, place: tuple[int, int, int], size: int) -> None:
    """Draw the head-up lines.

    Args:
        frame: uint8 (height, width, 3).
        status: What they say.
        place: Left, top and width in pixels; `STATUS_HEIGHT` sizes of the text high.
        size: Of the text, in pixels.
    """
    left, top, width = place
    y = top + size
    for label, value in _lines(status):
        text.write(frame, label, left, y, size, colours.FAINT_INK)
        room = width - text.width(label + "  ", size)
        value = text.shortened(value, size, room)
        text.write(frame, value, left + width, y, size, align="right")
        y += round(1.45 * size)
    if status.q_values is not None:
        y += round(0.8 * size)
        text.write(frame, "action values Q", left, y, size, colours.FAINT_INK)
        place = left, y + round(0.5 * size), width
        q_range = status.q_range or range_with_zero(status.q_values)
        _draw_bars(frame, status.q_values, status.action, place, size, q_range)


def _lines(status: Status) -> list[tuple[str, str]]:
    lines = [("episode", status.episode)] if status.episode else []
    lines.append((status.step_name, str(status.step)))
    if status.episode_return is not None:
        lines.append(("return", str(status.episode_return)))
    if status.state is not None:
        task, _, seen = status.observation.name_of(status.state).partition(" ")
        lines += [("task", task), ("sees", seen)]
    if status.outcome:
        lines.append(("outcome", status.outcome))
    elif status.action is not None:
        lines.append(("action", ACTION_NAMES[status.action]))
    return [*lines, *status.more]


def _draw_bars(
    frame: np.ndarray,
    q_values: np.ndarray,
    taken: int | None,
    place: tuple[int, int, int],
    size: int,
    q_range: tuple[float, float],
) -> None:
    left, top, width = place
    start = left + max(text.width(name, size) for name in ACTION_NAMES) + 0.6 * size
    end = left + width - text.width("-00.00", size) - 0.3 * size
    low, high = q_range
    pixels = (end - start) / (high - low)
    zero = start - low * pixels
    pitch, thickness = round(1.4 * size), round(0.75 * size)
    for action in range(N_ACTIONS):
        y = top + action * pitch
        value = float(np.clip(q_values[action], low, high))
        ends = sorted((zero, zero + value * pixels))
        chosen = action == taken
        colour = colours.CHOSEN if chosen else colours.RULE
        fill(frame, ends[0], y + 0.35 * size, ends[1] - ends[0], thickness, colour)
        ink = colours.CHOSEN if chosen else colours.INK
        baseline = y + round(1.05 * size)
        text.write(frame, ACTION_NAMES[action], left, baseline, size, ink)
        number = f"{round(float(q_values[action]), 2) + 0.0:.2f}"  # no minus zero
        text.write(frame, number, left + width, baseline, size, ink, align="right")
    fill(frame, zero - 1, top + 0.1 * size, 1, N_ACTIONS * pitch - 0.1 * size, colours.FAINT_INK)


def draw_legend(
    frame: np.ndarray, place: tuple[int, int, int], size: int, full_level: float, hexagon: float
) -> None:
    """Draw what colours, shapes and letters mean.

    Args:
        frame: uint8 (height, width, 3).
        place: Left, top and width in pixels; `LEGEND_HEIGHT` sizes of the text high.
        size: Of the text, in pixels.
        full_level: The trail level of the last colour of the ramp.
        hexagon: Size of the world's hexagons in pixels, on which the look of its ants depends.
    """
    left, top, width = place
    pitch, side = round(1.55 * size), round(1.5 * size)
    for row, (ground, carries, letter, label) in enumerate(_LEGEND):
        y = top + row * pitch
        baseline = y + round(0.5 * side + 0.36 * size)
        draw_swatch(frame, (left, y, side), ground, carries, hexagon)
        text.write(frame, letter, left + 0.59 * side, baseline, size, align="middle")
        text.write(frame, label, left + round(2.1 * size), baseline, size)
    y = top + len(_LEGEND) * pitch + round(1.45 * size)
    text.write(frame, "trail (T), by strength", left, y, size)
    y += round(0.45 * size)
    ramp = colours.channels(colours.TRAIL_RAMP)
    columns = np.linspace(0, len(ramp) - 1, width).astype(int)
    frame[y : y + round(0.7 * size), left : left + width] = ramp[columns]
    y += round(1.75 * size)
    text.write(frame, "1", left, y, size, colours.FAINT_INK)
    strongest = f"{full_level:g} and more"
    text.write(frame, strongest, left + width, y, size, colours.FAINT_INK, align="right")


def draw_swatch(
    frame: np.ndarray,
    place: tuple[int, int, int],
    ground: int,
    carries: bool | None,
    hexagon: float,
    trail: int = 0,
) -> None:
    """Draw a single cell as the world shows it, for a legend.

    Args:
        frame: uint8 (height, width, 3).
        place: Left, top and height in pixels.
        ground: What the cell holds.
        carries: Whether the ant on it carries food; None draws no ant.
        hexagon: Size of the world's hexagons in pixels, on which the look of its ants depends.
        trail: Level of its trail.
    """
    left, top, side = place
    grid = AxialGrid((1, 1, 1))
    held = np.full(grid.size, OBSTACLE, dtype=np.uint8)
    cell = grid.index((0, 0, 0))
    held[cell] = ground
    n = 0 if carries is None else 1
    snapshot = Snapshot(
        grid=grid,
        ground=held,
        trail=np.full(grid.size, trail, dtype=np.int32),
        ant_cells=np.full(n, cell, dtype=np.int32),
        ant_headings=np.full(n, 1, dtype=np.int32),
        ant_carries=np.full(n, bool(carries)),
    )
    viewport = Viewport.fit(grid, round(1.18 * side), side, margin=1)
    picture = Rasteriser(grid, viewport, ants_like=hexagon).draw(snapshot)
    frame[top : top + viewport.height, left : left + viewport.width] = picture


def fill(
    frame: np.ndarray, left: float, top: float, width: float, height: float, colour: int
) -> None:
    """Fill a rectangle, its edges rounded to whole pixels."""
    x, y = max(0, round(left)), max(0, round(top))
    frame[y : round(top + height), x : round(left + width)] = colours.channels(colour)
