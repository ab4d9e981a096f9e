"""Cells with ants that can be entered: each case in a drawn row of ants, worked by hand.

The ants stand in a row and look along it (heading 0), apart from those that look back (3). Every
case runs in the kernels and in the reference.
"""

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


def after_a_tick(
    traffic: Traffic,
    row: list[Standing],
    queen: tuple[int, int, int] = BEYOND,
    foods: tuple[tuple[int, int, int], ...] = (),
    trails: tuple[tuple[tuple[int, int, int], int], ...] = (),
    rewards: Rewards = Rewards(empty=0, failed=-1, shaping=1),  # noqa: B008
    homing_cue: str = "compass",
) -> list[tuple[int, int]]:
    """The place and the reward of each ant after one tick, the same in both simulators."""
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
    found = [(int(x), int(pay)) for (x, *_), pay in zip(cells, payments, strict=True)]
    ants = [plain.ants[slot] for slot in range(len(row))]
    assert found == [(ant.cell[0], ant.reward) for ant in ants]
    assert arrays["heading"].tolist() == [ant.heading for ant in ants]
    assert int(kernels.outcome().blocked[0, 0]) == plain.record.blocked
    assert np.count_nonzero(arrays["ground"] >> 4) == len(row)
    return found


PAIR = [Standing(3, food=True), Standing(4, GIVE)]  # the one behind carries food
MEETING = [Standing(3, food=True), Standing(4, heading=3)]
UNGRANTED = replace(FOLLOWING, reward_pushed=False)


def trails(first: int, second: int) -> dict:
    """Levels on the cells of a pair."""
    return {"trails": (((3, 3, 0), first), ((4, 3, 0), second))}


RULES = {
    "the paper blocks an ant with food by one without": (Traffic(), PAIR, [(3, -1), (4, -1)], {}),
    "the paper lets no two ants change places":
        (Traffic(), [Standing(3), Standing(4, heading=3)], [(3, -1), (4, -1)], {}),
    "of a queue, the paper moves the first ant":
        (Traffic(), [Standing(x) for x in (2, 3, 4)], [(2, -1), (3, -1), (5, 0)], {}),
    # It is paid for the step towards the queen; the other one pays nothing for its vain action.
    "an ant with food changes places with one without": (RIGHT_OF_WAY, PAIR, [(4, 1), (3, 0)], {}),
    "a step away from the queen pays as on an empty cell":
        (RIGHT_OF_WAY, PAIR, [(4, 0), (3, 0)], {"queen": BEHIND}),
    **{
        f"a push pays {pay} by a homing cue without a compass, {name}": (
            *(RIGHT_OF_WAY, PAIR, [(4, pay), (3, 0)]),
            {"queen": queen, "homing_cue": "trail", **trails(8 + (pay == 0), 8 + pay)},
        )
        for name, queen in (("queen ahead", BEYOND), ("queen behind", BEHIND))
        for pay in (0, 1)
    },
    "a pushed ant is paid as for an empty cell": (
        *(RIGHT_OF_WAY, [PAIR[0], Standing(4, PICK_UP)], [(4, 2), (3, 7)]),
        {"rewards": Rewards(empty=7, failed=-5, shaping=2)},
    ),
    # It turned to the ant before it, and was blocked; the helper compares the headings.
    "a pushed ant keeps the turn of its move": (
        *(RIGHT_OF_WAY, [PAIR[0], Standing(4, RIGHT, heading=5), Standing(5, GIVE)]),
        *([(4, 1), (3, 0), (5, -1)], {}),
    ),
    "ants with food are never pushed":
        (RIGHT_OF_WAY, [PAIR[0], Standing(4, PICK_UP, food=True)], [(3, -1), (4, -1)], {}),
    "ants without food push nobody": (RIGHT_OF_WAY, [Standing(3), PAIR[1]], [(3, -1), (4, -1)], {}),
    **{
        f"an ant that takes food is not pushed, {name}": (
            *(traffic, [PAIR[0], Standing(4, PICK_UP)], [(3, -1), (4, 3)]),
            {"foods": ((5, 3, 0),)},
        )
        for name, traffic in (("right of way", RIGHT_OF_WAY), ("following", FOLLOWING))
    },
    # Behind it the ant with food is blocked, unless it can follow.
    "an ant that moves itself is not pushed":
        (RIGHT_OF_WAY, [PAIR[0], Standing(4)], [(3, -1), (5, 0)], {}),
    "an ant that moves itself is followed":
        (FOLLOWING, [PAIR[0], Standing(4)], [(4, 1), (5, 0)], {}),
    "a queue moves as one":
        (QUEUES_ONLY, [Standing(x) for x in (2, 3, 4)], [(3, 0), (4, 0), (5, 0)], {}),
    "a queue of the strictest rules moves as one":
        (FOLLOWING, [Standing(x) for x in (2, 3, 4)], [(3, 0), (4, 0), (5, 0)], {}),
    "a queue before a waiting ant stays": (
        *(QUEUES_ONLY, [Standing(2), Standing(3), Standing(4, GIVE)]),
        *([(2, -1), (3, -1), (4, -1)], {}),
    ),
    "a pair that meets stays where ants only follow":
        (QUEUES_ONLY, [Standing(3), Standing(4, heading=3)], [(3, -1), (4, -1)], {}),
    "nobody follows into the cell of an ant that changes places":
        (FOLLOWING, [Standing(2), *PAIR], [(2, -1), (4, 1), (3, 0)], {}),
    # They meet; the ant without food wanted to go where the trail is stronger.
    **{
        f"an ant pushed where it wanted to go is paid {pay}, {name}":
            (traffic, MEETING, [(4, 1), (3, pay)], trails(25, 20))
        for name, traffic, pay in (
            *(("right of way", RIGHT_OF_WAY, 0), ("not granted", UNGRANTED, 0)),
            ("granted", FOLLOWING, 1),
        )
    },
}  # fmt: skip


@pytest.mark.parametrize("rule", RULES)
def test_a_row_of_ants_after_a_tick(rule):
    traffic, row, after, options = RULES[rule]
    assert after_a_tick(traffic, row, **options) == after


def test_an_ant_without_food_can_win_the_cell_from_one_with_food_and_nobody_enters():
    """Both want the cell between them, on which a third one stands; the smaller hash decides."""
    outcomes = set()
    for x in range(3, 9):
        row = [Standing(x - 1, food=True), Standing(x, GIVE), Standing(x + 1, heading=3)]
        after = after_a_tick(RIGHT_OF_WAY, row, (0, 7, 0))
        outcomes.add(after[0][0] - x)
        assert after[2][0] == x + 1
    assert outcomes == {-1, 0}


def test_where_carriers_come_first_an_ant_with_food_wins_the_cell():
    for x in range(3, 9):
        row = [Standing(x - 1, food=True), Standing(x, GIVE), Standing(x + 1, heading=3)]
        after = after_a_tick(FOLLOWING, row, (0, 7, 0))
        assert [place for place, _ in after] == [x, x - 1, x + 1]


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
