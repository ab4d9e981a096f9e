"""Every action of one ant, where it succeeds and where it fails.

The drawing is that of the vision's tests: ranges (5, 5, 5), the ant A at the origin with heading 1,
in its view L (heading 0), M (heading 1), R (heading 2). Trails do not evaporate.
"""

import pytest
from colonies import GAMMA, act, begun, load

from taichi_ants.task import Pheromone, Rewards
from taichi_ants.task.constants import EMPTY, FOOD, FORWARD, GIVE, LEFT, PICK_UP, RIGHT, Event
from taichi_ants.worlds.world import World

A, L, M, R = (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)
BEHIND = (0, 0, 1)  # heading 4
FAR = (0, 0, 4)


class Scene:
    """A world with one ant, which acts once."""

    def __init__(
        self, carries=False, cell=A, heading=1, queen=FAR, rng_state=0, rewards=None, **contents
    ):
        world = World((5, 5, 5), queen, ants=[(cell, heading)], **contents)
        rules = {"pheromone": Pheromone("none"), "rewards": rewards or Rewards()}
        self.colony = begun(world, **rules)
        self.world, self.ant = self.colony.world, self.colony.ants[0]
        self.ant.stream.state = rng_state
        if carries:
            load(self.colony, 0)

    def act(self, action):
        act(self.colony, action)
        [step] = self.colony.transitions
        return step.reward, step.event

    @property
    def ends(self):
        return self.ant.cell, self.ant.heading, self.ant.carries


@pytest.mark.parametrize(
    ("action", "heading", "cell"), [(LEFT, 0, L), (FORWARD, 1, M), (RIGHT, 2, R)]
)
def test_a_move_onto_an_empty_cell_turns_and_goes(action, heading, cell):
    scene = Scene()
    assert scene.act(action) == (0, Event.ENTERED_EMPTY)
    assert scene.ends == (cell, heading, False)
    assert scene.world.trail.level(cell) == 0  # without food, no deposit


def test_a_move_onto_a_trail_that_is_seen_pays_one():
    trails = [(L, 10), (M, 4)]  # M has less than half of L, so it looks E
    assert Scene(trails=trails).act(LEFT) == (1, Event.ENTERED_CUE)
    assert Scene(trails=trails).act(FORWARD) == (0, Event.ENTERED_EMPTY)


@pytest.mark.parametrize("action", [LEFT, FORWARD, RIGHT])
@pytest.mark.parametrize("carries", [False, True])
def test_a_blocked_move_only_turns(action, carries):
    # L is food, M an obstacle, R the queen.
    scene = Scene(carries, queen=R, foods=[L], obstacles=[M])
    assert scene.act(action) == (-1, Event.BLOCKED)
    assert scene.ends == (A, action, carries)  # headings 0, 1, 2
    assert [scene.world.trail.level(cell) for cell in (A, L, M, R)] == [0, 0, 0, 0]


def test_with_food_a_move_nearer_pays_one_and_deposits_on_the_new_cell():
    scene = Scene(carries=True, queen=(4, 0, 0))  # sees S E E
    assert scene.act(LEFT) == (1, Event.ENTERED_CUE)
    assert scene.ends == (L, 0, True)
    assert scene.world.trail.level(L) == 250
    assert scene.world.trail.level(A) == 0


def test_pick_up_takes_the_food_turns_round_and_deposits_on_both_cells():
    scene = Scene(foods=[R])
    assert scene.act(PICK_UP) == (3, Event.PICKED_UP)
    assert scene.ends == (A, 4, True)  # heading 1 + 3, wherever the food was
    assert scene.world.content(R) == EMPTY
    assert [scene.world.trail.level(cell) for cell in (A, R, L, M)] == [250, 250, 0, 0]
    assert scene.ant.stream.state == 0  # one food: no draw


@pytest.mark.parametrize(
    ("foods", "rng_state", "taken"),
    [
        # The first draw from state 0 is 0xE220A839..., 0.88 of the range: of two the second, of
        # three the third. From state GAMMA it is 0x6E789E6A..., 0.43: the first, the second.
        ([L, M], 0, M),
        ([L, R], 0, R),
        ([M, R], 0, R),
        ([R, M, L], 0, R),  # in the order of the view, not of the world's list
        ([L, M], GAMMA, L),
        ([M, R], GAMMA, M),
        ([R, M, L], GAMMA, M),
    ],
)
def test_of_several_foods_the_draw_decides(foods, rng_state, taken):
    scene = Scene(foods=foods, rng_state=rng_state)
    assert scene.act(PICK_UP) == (3, Event.PICKED_UP)
    left_over = {cell for cell in foods if scene.world.content(cell) == FOOD}
    assert left_over == set(foods) - {taken}
    assert {cell for cell in (L, M, R) if scene.world.trail.level(cell) == 250} == {taken}
    assert scene.ant.stream.state == (rng_state + GAMMA) % 2**64  # one draw


@pytest.mark.parametrize(
    ("action", "contents"),
    [
        (PICK_UP, {}),  # nothing to take
        (PICK_UP, {"foods": [BEHIND]}),  # not in view
        (PICK_UP, {"queen": M}),  # without food she looks O
        (PICK_UP, {"carries": True, "foods": [M]}),  # already carries
        (PICK_UP, {"carries": True, "queen": M}),  # Q shares its code with F
        (GIVE, {"carries": True}),  # no queen in view
        (GIVE, {"carries": True, "queen": BEHIND}),
        (GIVE, {"queen": M}),  # nothing to give
        (GIVE, {"foods": [M]}),  # F shares its code with Q
    ],
)
def test_pick_up_and_give_fail(action, contents):
    scene = Scene(**contents)
    carries = scene.ant.carries
    assert scene.act(action) == (-1, Event.FAILED)
    assert scene.ends == (A, 1, carries)
    assert scene.ant.stream.state == 0
    assert all(scene.world.content(cell) == FOOD for cell in contents.get("foods", []))
    assert scene.world.trail.level(A) == 0


@pytest.mark.parametrize(("queen", "state"), [(L, 16), (M, 4), (R, 1)])
def test_give_pays_ten_and_keeps_the_heading(queen, state):
    scene = Scene(carries=True, queen=queen)
    assert scene.act(GIVE) == (10, Event.DELIVERED)
    assert scene.ends == (A, 1, False)
    assert scene.ant.paper_state == state  # the queen looks O again
    assert scene.world.trail.level(A) == 0
