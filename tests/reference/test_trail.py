"""Trails: laid by hand-worked deposits, fallen and spread as closed forms say."""

import numpy as np
import pytest
from colonies import act, begun, load

from taichi_ants.reference.geometry import neighbour
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task import Pheromone, Task
from taichi_ants.task.constants import FORWARD, PICK_UP
from taichi_ants.worlds import World

MIDDLE = (0, 0, 0)
FAR_QUEEN = (0, 0, 4)


def plain_world(level=1000, at=MIDDLE, ranges=(5, 5, 5), obstacles=()):
    return World(ranges, FAR_QUEEN, trails=[(at, level)], obstacles=obstacles)


def trail_of(world, pheromone):
    return WorldState(world, Task(pheromone=pheromone)).trail


def after(trail, ticks):
    for _ in range(ticks):
        trail.tick()
    return trail


@pytest.mark.parametrize("half_life", [1, 7.5, 50])
def test_exponential_evaporation_halves(half_life):
    pheromone = Pheromone("exponential", half_life)
    trail = trail_of(plain_world(level=2**20), pheromone)
    for ticks in range(1, 61):
        trail.tick()
        expected = 2**20 * 0.5 ** (ticks / half_life)
        if expected < 0.999:
            break
        # A rounding of 2**-24 per tick at most, and one of the factor.
        assert float(trail.level(MIDDLE)) == pytest.approx(expected, rel=3e-7 * ticks)
    assert type(trail.level(MIDDLE)) is np.float32


def test_one_tick_of_diffusion_by_hand():
    # A rock at heading 0, the world's end nowhere near: of 768 a share of 0.75 / 6 = 1/8, 96, goes
    # to each of five neighbours; the sixth stays.
    rock = neighbour(MIDDLE, 0)
    world = plain_world(level=768, obstacles=[rock])
    trail = after(trail_of(world, Pheromone("none", diffusion=0.75)), 1)
    assert float(trail.level(MIDDLE)) == 768 - 5 * 96
    assert [float(trail.level(neighbour(MIDDLE, h))) for h in range(6)] == [0, 96, 96, 96, 96, 96]
    assert float(trail.level(neighbour(neighbour(MIDDLE, 2), 2))) == 0


# An ant with heading 0 below three free cells; the queen is beside, out of the way.
LANE = """
trail = 600
.
  .
t
  .
.
  .
0
  Q
"""


@pytest.mark.parametrize(
    ("pheromone", "bare", "trodden"),
    [
        # Levels after the tick: a deposit falls in its own tick already. The trail of 600 is
        # entered in tick 1, when it has fallen once.
        (Pheromone(), 249, 249),
        (Pheromone("none"), 250, 250),
        (Pheromone(level=70), 69, 69),
        (Pheromone(deposit="add"), 249, 848),
        (Pheromone(deposit="add", cap=700), 249, 699),
        (Pheromone(deposit="add", cap=100), 99, 99),
        (Pheromone("none", deposit="add"), 250, 850),
        (Pheromone("none", deposit="add", cap=700), 250, 700),
        (Pheromone(deposit="none"), 0, 598),
        (Pheromone("none", deposit="none"), 0, 600),
        # Dense: half-life 1, so 600 -> 300 in tick 0; in tick 1 set or added to, and halved.
        (Pheromone("exponential", 1), 125, 125),
        (Pheromone("exponential", 1, deposit="add"), 125, 275),
        (Pheromone("exponential", 1, deposit="add", cap=400), 125, 200),
        (Pheromone("exponential", 1, deposit="none"), 0, 150),
    ],
)
def test_the_deposit_of_a_carrying_ant(pheromone, bare, trodden):
    colony = begun(LANE, pheromone=pheromone)
    load(colony, 0)
    start = colony.ants[0].cell
    act(colony, FORWARD)
    first = colony.ants[0].cell
    assert colony.world.trail.level(first) == bare
    assert colony.world.trail.level(start) == 0  # left, not entered
    act(colony, FORWARD)
    second = colony.ants[0].cell
    assert second != first
    assert colony.world.trail.level(second) == trodden


@pytest.mark.parametrize(
    ("pheromone", "levels"),
    [
        # The ant takes the food of the lane's end, turns round and walks back over two cells: 500
        # on the food's cell and its own, then 10 less for each tick that it has carried.
        (Pheromone("none", deposit="fading", level=500), (500, 500, 490, 480)),
        (Pheromone("none", deposit="fading", level=500, slope=100), (500, 500, 400, 300)),
        (Pheromone("none", deposit="fading", level=15), (15, 15, 5, 0)),
        (Pheromone("linear", deposit="fading", level=500), (497, 497, 488, 479)),
        (Pheromone("exponential", 1, deposit="fading", level=512, slope=64), (64, 64, 112, 192)),
    ],
)
def test_trails_that_fade_rise_towards_the_food(pheromone, levels):
    colony = begun(FADING, pheromone=pheromone)
    cells = [neighbour(colony.ants[0].cell, 0)]
    for _ in range(3):
        cells.append(neighbour(cells[-1], 3))
    act(colony, PICK_UP)
    act(colony, FORWARD)
    act(colony, FORWARD)
    assert [float(colony.world.trail.level(cell)) for cell in cells] == list(levels)


# An ant below food; below it two free cells, and the queen beside them.
FADING = """
F
  .
0
  .
.
  .
.
  Q
"""
