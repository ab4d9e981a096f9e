"""Further fields: when and where ants lay them, and ants that follow them, worked by hand."""

from colonies import act, begun, cells_of, load

from taichi_ants.task import Field, Pheromone
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, PICK_UP
from taichi_ants.worlds import World

OPEN = World((9, 9, 1), (8, 8, 0), foods=[(4, 3, 0)], ants=[((2, 3, 0), 0)])


def begun_with(world=OPEN, **fields):
    return begun(world, pheromone=Pheromone("none"), fields=fields)


def levels(colony, name):
    trail = colony.world.pheromones[name]
    return {c: int(trail.level(c)) for c in colony.world.ground if trail.level(c)}


def test_occasions_of_a_walk_to_food():
    """One step, a pick-up, a step back: the fields say where and when."""
    laid = ("with_food", "without_food", "always", "dead_end", "failed_pick_up", "never")
    colony = begun_with(
        **{
            one: Field("none", deposit="fading", level=100, slope=10, deposited_when=one)
            for one in laid
        }
    )
    act(colony, FORWARD)
    assert cells_of(colony) == [(3, 3, 0)]
    assert levels(colony, "without_food") == levels(colony, "always") == {(3, 3, 0): 100}
    act(colony, PICK_UP)
    picked = {(4, 3, 0): 100, (3, 3, 0): 100}
    assert levels(colony, "with_food") == levels(colony, "always") == picked
    act(colony, FORWARD)
    after = {**picked, (2, 3, 0): 90}
    assert levels(colony, "with_food") == levels(colony, "always") == after
    assert levels(colony, "without_food") == {(3, 3, 0): 100}
    for name in ("dead_end", "failed_pick_up", "never"):
        assert levels(colony, name) == {}


def test_time_without_food_counts_from_the_start_and_from_a_delivery():
    fading = Field("none", deposit="fading", level=100, slope=10, deposited_when="without_food")
    colony = begun_with(home=fading)
    act(colony, PICK_UP)  # in vain
    act(colony, FORWARD)
    assert levels(colony, "home") == {(3, 3, 0): 90}
    world = World((9, 9, 1), (3, 3, 0), foods=[(8, 8, 0)], ants=[((2, 3, 0), 0)])
    colony = begun_with(world, home=fading)
    load(colony, 0)
    act(colony, GIVE)
    assert levels(colony, "home") == {(2, 3, 0): 100}
    act(colony, LEFT)
    (cell,) = cells_of(colony)
    assert levels(colony, "home") == {(2, 3, 0): 100, cell: 90}


def test_a_dead_end_is_marked_by_what_the_ant_saw_before_it_turned():
    rocks = [(3, 3, 0), (2, 4, 0), (3, 4, 0), (2, 2, 0)]
    world = World((9, 9, 1), (8, 8, 0), foods=[(0, 8, 0)], obstacles=rocks, ants=[((2, 3, 0), 1)])
    colony = begun_with(world, end=Field(deposited_when="dead_end", evaporation="none"))
    assert colony.ants[0].paper_state == 0b010101
    act(colony, LEFT)
    assert levels(colony, "end") == {(2, 3, 0): 250}


def test_an_ant_with_food_sees_the_homing_field_in_place_of_the_compass():
    """Two thirds of the level of the best cell ahead are S by "half", and E by "strongest"."""
    for view, left in (("half", 2), ("strongest", 0)):
        task = {"fields": {"home": Field("none", view=view)}, "homing_cue": "home"}
        colony = begun(OPEN, **task)
        home = colony.world.pheromones["home"]
        home.lay((3, 3, 0), 90)
        home.lay((2, 2, 0), 60)  # left of the ant
        load(colony, 0)
        assert colony.ants[0].paper_state == 64 + 16 * left + 4 * 2
