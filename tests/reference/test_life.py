"""Births and deaths in a colony, worked out by hand."""

import pytest
from colonies import act, begun, cells_of, foods_of, load, n_draws

from taichi_ants.grid.constants import STREAM_BORN, STREAM_QUEEN
from taichi_ants.reference.geometry import neighbour
from taichi_ants.reference.observations import observe
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.task.constants import FOOD, FORWARD, GIVE
from taichi_ants.worlds import World

QUEEN = (0, 0, 0)
RANGES = (4, 4, 4)


def around(*headings, ranges=RANGES, **contents):
    """A world whose ants stand around the queen, at these headings from her, and face her."""
    ants = [(neighbour(QUEEN, heading), (heading + 3) % 6) for heading in headings]
    return World(ranges, QUEEN, ants=ants, **contents)


def queens_choice(seed, *free):
    """The heading that her draws give, one after the other, each among all but those taken."""
    stream = RandomStream(stream_state(seed, STREAM_QUEEN, 0))
    free = list(free)
    return [free.pop(stream.draw()[0] * len(free) >> 32) for _ in range(len(free))]


@pytest.mark.parametrize("seed", range(5))
def test_a_food_given_becomes_an_ant_that_faces_away(seed):
    colony = begun(around(3), births=True, seed=seed)
    load(colony, 0)
    act(colony, GIVE)
    heading = queens_choice(seed, 0, 1, 2, 4, 5)[0]
    born = colony.ants[1]
    assert (born.slot, born.number, born.cell, born.heading) == (
        1,
        1,
        neighbour(QUEEN, heading),
        heading,
    )
    assert (born.carries, born.own.get("age", 0), born.action, born.reward) == (False, 0, -1, 0)
    assert born.state == observe(colony.world, born)
    assert born.stream.state == stream_state(seed, STREAM_BORN, 1)
    assert colony.stores[0] == 0
    assert n_draws(colony.queen_stream.state, stream_state(seed, STREAM_QUEEN, 0)) == 1
    assert (colony.record.births, colony.record.deliveries) == (1, 1)
    # It did not act in the tick of its birth; in the next one it draws its first action.
    assert [step.slot for step in colony.transitions] == [0]
    colony.tick()
    assert [step.slot for step in colony.transitions] == [0, 1]
    assert n_draws(born.stream.state, stream_state(seed, STREAM_BORN, 1)) == 1


def test_the_food_waits_while_no_neighbour_is_free():
    colony = begun(around(*range(6)), births=True)
    load(colony, *range(6))
    act(colony, *[GIVE] * 6)
    assert (len(colony.ants), colony.stores[0], colony.record.births) == (6, 6, 0)
    assert colony.queen_stream.state == stream_state(0, STREAM_QUEEN, 0)  # no draw in vain
    # The ant at heading 2 turns round and goes: its cell is free in this very tick, for one.
    colony.ants[2].heading = 2
    colony.observe(colony.ants[2])
    act(colony, GIVE, GIVE, FORWARD, GIVE, GIVE, GIVE)
    assert (len(colony.ants), colony.stores[0], colony.record.births) == (7, 5, 1)
    assert (colony.ants[6].cell, colony.ants[6].heading) == (neighbour(QUEEN, 2), 2)


# Ant 0 heads up to ant 1, who looks at the queen.
COLUMN = """
Q
  .
0
  .
0
"""


def test_an_ant_dies_at_its_lifespan():
    colony = begun(COLUMN, lifespan=2)
    front, rear = cells_of(colony)
    act(colony, GIVE, GIVE)
    assert [ant.own["age"] for ant in colony.ants.values()] == [1, 1]
    assert colony.record.deaths == 0
    colony.ants[1].own["age"] = 0  # the one behind lives on
    act(colony, GIVE, FORWARD)
    # Blocked, since the cell was taken at the start of the tick; but now it looks empty.
    assert cells_of(colony) == [rear]
    assert (colony.ants[1].reward, colony.ants[1].state >> 2 & 3) == (-1, 0)
    assert colony.record.deaths == 1
    assert len(colony.ants) == 1
    assert [step.truncated for step in colony.transitions] == [True, False]
    act(colony, FORWARD)
    assert cells_of(colony) == []  # it has got there, and died of age 2
    assert front not in colony.world.ants
    assert not colony.ants
    colony.tick()  # an empty world goes on
    assert colony.record.ticks == 4
    assert colony.transitions == []


def test_a_carrying_ant_leaves_its_food_where_it_dies():
    colony = begun(COLUMN, lifespan=2)
    load(colony, 0)
    front, _ = cells_of(colony)
    colony.ants[0].own["age"] = 1
    act(colony, FORWARD, GIVE)  # blocked by the queen
    assert foods_of(colony) == {front}
    assert colony.world.ground[front] == FOOD
    assert sorted(colony.ants) == [1]
    assert colony.ants[1].state >> 2 & 3 == 3  # F ahead
    # The one that died saw its last with food: the queen ahead, the world's end to its left.
    [last, _] = colony.transitions
    assert last.next_state == 64 + 16 + 4 * 3 + last.next_state % 4
    assert last.truncated
