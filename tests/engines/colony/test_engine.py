"""Clear errors of colonies, episodes that end, other worlds for episodes, and memory."""

import numpy as np
import pytest
from refusals import refused

from taichi_ants import Colony, TrainingConfig, World, worlds
from taichi_ants.learners.policies import trail_follower
from taichi_ants.task import Life, Pheromone, Task, foraging
from taichi_ants.task.constants import FORWARD

TRAINING = TrainingConfig("q_learning", 0.1, 0.9, 1.0, 1.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"ants": 5000}, "5000"),
        ({"ants": 0}, "ants is 0; it must lie between 1"),
        ({"ants": 8, "capacity": 7}, "because 8 ants start"),
        ({"start": "queen"}, "start is 'queen'; it must be one of nest, spread"),
        ({"ends_at_delivery": True, "ants": 2}, "ends_at_delivery is True with 2 ants"),
        ({"ends_at_delivery": True, "task": Task(life=Life(births=True))}, "births True"),
        ({"task": Task("trail_levels"), "q_values": np.zeros((128, 5))}, "(432, 5)"),
        ({"sharing": "frozen"}, "sharing is 'frozen', but q_values is None; give the action"),
        ({"world": World((3, 3, 3), (0, 0, 0))}, "the world has no food"),
        ({"seeds": [1, 1]}, "1"),
        ({"world": [worlds.paper()] * 2, "seeds": [1]}, "2 worlds"),
        ({"world": [worlds.paper(), worlds.open_world(0, (5, 5, 5))], "seeds": [1, 2]}, "ranges"),
        ({"training": [TRAINING, TRAINING]}, "it must be a TrainingConfig"),
        ({"training": None}, "training is None"),
    ],
)
def test_wrong_arguments_are_named(arguments, said):
    usual = {"world": worlds.paper(), "task": None, "training": TRAINING}
    refused(said, Colony, **{**usual, **arguments})


@pytest.mark.parametrize(
    "schedule", ["by_world", "by_ant", pytest.param("by_chunk", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("pheromone", [Pheromone(), Pheromone(diffusion=0.5)])
def test_a_world_whose_episode_has_ended_stays_as_it_is(schedule, pheromone):
    """Trails too stand still, whatever the other worlds do."""
    task = Task(pheromone=pheromone, evaporation_in_evaluation=True)
    colony = Colony(
        *(worlds.paper(), task, TRAINING, (1, 2)),
        sharing="frozen",
        q_values=trail_follower(),
        ends_at_delivery=True,
        schedule=schedule,
    )
    colony.begin_episode()
    while not (ticks := colony.outcome().first_delivery[0, 0]) > 0:
        colony.tick()
    ended = colony.snapshot(0)
    assert ended.trail.any()
    assert colony.outcome().ticks[0, 0] == ticks
    colony.tick(7)
    assert colony.snapshot(0) == ended


def test_episodes_may_take_place_in_other_worlds():
    """Each in a world of its own gives what moving it does, and goes on with one table."""
    places = [worlds.open_world(seed, ranges=(7, 7, 7)) for seed in range(3)]
    task = Task(life=Life(regrowth=1))
    listed, moved = (Colony(places[0], task, TRAINING, 4, ants=9) for _ in range(2))
    outcome = listed.run(3, 40, worlds=places)
    for episode, place in enumerate(places):
        moved.begin_episode(40, place)
        moved.tick(40)
        assert moved.outcome().returns[0, 0] == outcome.returns[episode, 0]
        moved.end_episode()
    assert moved == listed
    assert len(set(outcome.returns[:, 0].tolist())) > 1


@pytest.mark.parametrize(("task", "most"), [(Task(), 44), (foraging(), 49)])
def test_an_ant_and_a_cell_take_few_bytes(task, most):
    """Of all that a colony keeps, with the start of an episode."""

    def size(side: int, ants: int) -> int:
        world = worlds.open_world(1, (side, side, side))
        settings = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)
        colony = Colony(world, task, settings, ants=ants, schedule="by_chunk")
        return colony.nbytes

    assert (size(60, 2000) - size(60, 1000)) / 1000 < most
    cells = [worlds.open_world(1, (side,) * 3).grid.size for side in (50, 60)]
    assert (size(60, 1000) - size(50, 1000)) / (cells[1] - cells[0]) < 10


def test_a_steep_deposit_after_long_carrying_leaves_nothing():
    """Slope times ticks does not fit into 32 bits."""
    world = World((8, 8, 1), (0, 7, 0), ants=[((2, 2, 0), 0)])
    task = Task(pheromone=Pheromone(deposit="fading", level=250, slope=100))
    colony = Colony(world, task, None, ants=1, sharing="frozen")
    colony.begin_episode()
    colony.arrays["carries"][:] = 1
    colony.arrays["carried"][:] = 30_000_000
    colony.arrays["paper_state"][:] = 64  # with food, and three empty cells ahead
    colony.act(np.array([[FORWARD]]))
    assert colony.grid.cells(colony.cells[0]).tolist() == [[3, 2, 0]]
    assert not colony.snapshot().trail.any()
