"""Cells with ants that can be entered: each case in a drawn row of ants, worked by hand.

The ants stand in a row and look along it (heading 0), apart from those that look back (3). Every
case runs in the kernels and in the reference.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from taichi_ants import Colony, TrainingConfig, World
from taichi_ants.engines.colony.layout import ANT_GROUND
from taichi_ants.learners.policies import random_policy
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import Pheromone, Rewards, Task, Traffic
from taichi_ants.task.constants import FORWARD, GIVE, PICK_UP, RIGHT

TRAINING = TrainingConfig("q_learning", 0.1, 0.9, 0.0, 1.0)
BEYOND = (9, 3, 0)  # the queen at the end of the row: +1 for each step along it with food
BEHIND = (0, 3, 0)
RIGHT_OF_WAY, FOLLOWING = Traffic.named()["right_of_way"], Traffic.named()["following"]
QUEUES_ONLY = Traffic(follow=True)


@dataclass(frozen=True)
class Standing:
    """An ant of a row: where it stands, where it looks, what it carries and does."""

    x: int
    action: int = FORWARD
    food: bool = False
    heading: int = 0


@dataclass(frozen=True)
class After:
    """What became of an ant."""

    x: int
    reward: int


def after_a_tick(
    traffic: Traffic,
    row: list[Standing],
    queen: tuple[int, int, int] = BEYOND,
    foods: tuple[tuple[int, int, int], ...] = (),
    trails: tuple[tuple[tuple[int, int, int], int], ...] = (),
    rewards: Rewards = Rewards(empty=0, failed=-1, shaping=1),  # noqa: B008
    homing_cue: str = "compass",
) -> list[After]:
    """The ants after one tick, which is the same in both simulators."""
    starts = [((one.x, 3, 0), one.heading) for one in row]
    world = World((12, 8, 1), queen, foods=foods, trails=trails, ants=starts)
    pheromone = Pheromone(deposit="none")
    task = Task(traffic=traffic, rewards=rewards, pheromone=pheromone, homing_cue=homing_cue)
    given = (world, task, TRAINING, 0, len(row))
    options = {"sharing": "frozen", "q_values": random_policy()}
    kernels = Colony(world, task, None, 0, len(row), sharing="frozen")
    plain = ReferenceColony(*given, **options)
    kernels.begin_episode()
    plain.begin_episode()
    arrays = kernels.arrays
    for slot, one in enumerate(row):
        ant = plain.ants[slot]
        ant.carries, ant.chosen = one.food, one.action
        plain.observe(ant)
        arrays["carries"][slot], arrays["paper_state"][slot] = one.food, ant.paper_state
        if one.food:
            arrays["ground"][arrays["cell"][slot]] = ANT_GROUND | 8 << 4
    kernels.act(np.array([[one.action for one in row]]))
    plain.tick()
    cells = kernels.snapshot().grid.cells(arrays["cell"])
    payments = arrays["rewards"][arrays["event"]]
    found = [After(int(x), int(pay)) for (x, *_), pay in zip(cells, payments, strict=True)]
    ants = [plain.ants[slot] for slot in range(len(row))]
    assert found == [After(ant.cell[0], ant.reward) for ant in ants]
    assert arrays["heading"].tolist() == [ant.heading for ant in ants]
    assert int(kernels.outcome().blocked[0, 0]) == plain.record.blocked
    assert np.count_nonzero(arrays["ground"] >> 4) == len(row)
    return found


def test_under_the_papers_rules_an_ant_with_food_is_blocked_by_one_without():
    row = [Standing(3, food=True), Standing(4, GIVE)]
    assert after_a_tick(Traffic(), row) == [After(3, -1), After(4, -1)]


def test_an_ant_with_food_changes_places_with_one_without():
    """It is paid for the step towards the queen; the other one pays nothing for its vain action."""
    row = [Standing(3, food=True), Standing(4, GIVE)]
    assert after_a_tick(RIGHT_OF_WAY, row) == [After(4, 1), After(3, 0)]


def test_a_step_away_from_the_queen_pays_as_on_an_empty_cell():
    row = [Standing(3, food=True), Standing(4, GIVE)]
    assert after_a_tick(RIGHT_OF_WAY, row, BEHIND) == [After(4, 0), After(3, 0)]


@pytest.mark.parametrize("queen", [BEYOND, BEHIND])
@pytest.mark.parametrize(("stronger", "pay"), [(4, 1), (3, 0)])
def test_without_a_compass_a_push_pays_by_the_homing_cue(queen, stronger, pay):
    row = [Standing(3, food=True), Standing(4, GIVE)]
    trails = (((stronger, 3, 0), 9), ((7 - stronger, 3, 0), 8))
    found = after_a_tick(RIGHT_OF_WAY, row, queen, trails=trails, homing_cue="trail")
    assert found == [After(4, pay), After(3, 0)]


def test_a_pushed_ant_is_paid_as_for_an_empty_cell():
    row = [Standing(3, food=True), Standing(4, PICK_UP)]
    paid = Rewards(empty=7, failed=-5, shaping=2)
    assert after_a_tick(RIGHT_OF_WAY, row, rewards=paid) == [After(4, 2), After(3, 7)]


def test_a_pushed_ant_keeps_the_turn_of_its_move():
    """It turned to the ant before it, and was blocked; the helper compares the headings."""
    row = [Standing(3, food=True), Standing(4, RIGHT, heading=5), Standing(5, GIVE)]
    assert after_a_tick(RIGHT_OF_WAY, row) == [After(4, 1), After(3, 0), After(5, -1)]


def test_ants_with_food_are_never_pushed():
    row = [Standing(3, food=True), Standing(4, PICK_UP, food=True)]
    assert after_a_tick(RIGHT_OF_WAY, row) == [After(3, -1), After(4, -1)]


def test_ants_without_food_push_nobody():
    row = [Standing(3), Standing(4, GIVE)]
    assert after_a_tick(RIGHT_OF_WAY, row) == [After(3, -1), After(4, -1)]


@pytest.mark.parametrize("traffic", [RIGHT_OF_WAY, FOLLOWING])
def test_an_ant_that_takes_food_is_not_pushed(traffic):
    row = [Standing(3, food=True), Standing(4, PICK_UP)]
    assert after_a_tick(traffic, row, foods=((5, 3, 0),)) == [After(3, -1), After(4, 3)]


@pytest.mark.parametrize(
    ("traffic", "then"), [(RIGHT_OF_WAY, After(3, -1)), (FOLLOWING, After(4, 1))]
)
def test_an_ant_that_moves_itself_is_not_pushed(traffic, then):
    """Behind it the ant with food is blocked, unless it can follow."""
    row = [Standing(3, food=True), Standing(4)]
    assert after_a_tick(traffic, row) == [then, After(5, 0)]


def test_an_ant_without_food_can_win_the_cell_from_one_with_food_and_nobody_enters():
    """Both want the cell between them, on which a third one stands; the smaller hash decides."""
    outcomes = set()
    for x in range(3, 9):
        row = [Standing(x - 1, food=True), Standing(x, GIVE), Standing(x + 1, heading=3)]
        after = after_a_tick(RIGHT_OF_WAY, row, (0, 7, 0))
        outcomes.add(after[0].x - x)
        assert after[2].x == x + 1
    assert outcomes == {-1, 0}


def test_where_carriers_come_first_an_ant_with_food_wins_the_cell():
    for x in range(3, 9):
        row = [Standing(x - 1, food=True), Standing(x, GIVE), Standing(x + 1, heading=3)]
        after = after_a_tick(FOLLOWING, row, (0, 7, 0))
        assert [one.x for one in after] == [x, x - 1, x + 1]


@pytest.mark.parametrize("traffic", [QUEUES_ONLY, FOLLOWING])
def test_a_queue_moves_as_one(traffic):
    row = [Standing(x) for x in (2, 3, 4)]
    assert [one.x for one in after_a_tick(traffic, row)] == [3, 4, 5]


def test_a_queue_before_a_rock_or_a_waiting_ant_stays():
    row = [Standing(2), Standing(3), Standing(4, GIVE)]
    assert after_a_tick(QUEUES_ONLY, row) == [After(2, -1), After(3, -1), After(4, -1)]


def test_a_pair_that_meets_stays_where_ants_only_follow():
    row = [Standing(3), Standing(4, heading=3)]
    assert after_a_tick(QUEUES_ONLY, row) == [After(3, -1), After(4, -1)]


def test_nobody_follows_into_the_cell_of_an_ant_that_changes_places():
    row = [Standing(2), Standing(3, food=True), Standing(4, GIVE)]
    assert [one.x for one in after_a_tick(FOLLOWING, row)] == [2, 4, 3]


@pytest.mark.parametrize(
    ("traffic", "paid"),
    [(RIGHT_OF_WAY, 0), (replace(FOLLOWING, reward_pushed=False), 0), (FOLLOWING, 1)],
)
def test_an_ant_that_is_pushed_where_it_wanted_to_go_is_paid_for_the_move_if_granted(traffic, paid):
    """They meet; the ant without food wanted to go where the trail is stronger."""
    row = [Standing(3, food=True), Standing(4, heading=3)]
    trails = (((3, 3, 0), 25), ((4, 3, 0), 20))
    assert after_a_tick(traffic, row, trails=trails) == [After(4, 1), After(3, paid)]


@pytest.mark.parametrize("traffic", [QUEUES_ONLY, replace(FOLLOWING, reward_pushed=False)])
def test_a_ring_of_three_ants_stays(traffic):
    """Three cells that touch each other; each ant wants the cell of the next one."""
    cells = [(3, 3, 0), (4, 3, 0), (4, 4, 0)]
    grid = World((12, 8, 1), (0, 7, 0)).grid
    places = [int(grid.index(np.array(cell))) for cell in cells]
    steps = [places[(k + 1) % 3] - places[k] for k in range(3)]
    headings = [grid.offsets.tolist().index(step) for step in steps]
    world = World((12, 8, 1), (0, 7, 0), ants=list(zip(cells, headings, strict=True)))
    colony = Colony(world, Task(traffic=traffic), None, 0, 3, sharing="frozen")
    colony.begin_episode()
    before = colony.arrays["cell"].tolist()
    colony.act(np.full((1, 3), FORWARD))
    assert colony.arrays["cell"].tolist() == before
    assert int(colony.outcome().blocked[0, 0]) == 3


def test_options_that_change_nothing_are_refused():
    from taichi_ants import AntsError

    for options, message in (
        ({"reward_pushed": True}, "leave it out unless `swap` is True"),
        ({"carriers_first": True}, "carriers_first` is True; leave it out"),
        ({"swap": "yes"}, "swap` is 'yes'"),
    ):
        with pytest.raises(AntsError, match=message):
            Traffic(**options)
    with pytest.raises(
        AntsError, match=r"traffic` is 'left'; it must be .* one of blocking, right_of"
    ):
        Task(traffic="left")
