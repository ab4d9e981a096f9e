"""What an ant does instead of delivering: constructed policies, exact cases, and the borders."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_ants import Task, rollout
from taichi_ants.analysis.behaviour import (
    BEHAVIOURS,
    CIRCLES,
    DELIVERS,
    OTHER,
    WALKS,
    classify,
)
from taichi_ants.learners import policies
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, N_STATES, PICK_UP, RIGHT, SEES_CUE
from taichi_ants.task.states import state_from_index, state_name
from taichi_ants.worlds import paper

STATES = [state_name(index) for index in range(N_STATES)]
STILL = Task(evaporation_in_evaluation=False)
STEPS = 600


def policy(choose, base=policies.trail_follower):
    """The base policy, except where `choose` names another action for a state."""
    table = base()
    for index in range(len(table)):
        action = choose(state_from_index(index))
        if action is not None:
            table[index] = 0
            table[index, action] = 1
    return table


def walk_on(state):
    """Without food past all food, along the trail, and round at its ends."""
    if not state[0] and SEES_CUE not in state[1:]:
        return LEFT


def keep(state):
    """With food nearer to the queen where that can be, and round to the left where it cannot."""
    if state[0] and SEES_CUE not in state[1:]:
        return LEFT


def turn_with_food(state):
    return LEFT if state[0] else None


def always(action):
    return policy(lambda state: action, policies.random_policy)


CASES = {
    "follows the trail": (policies.trail_follower(), DELIVERS),
    "never picks up": (policy(walk_on), WALKS),
    "never gives": (policy(keep), CIRCLES),
    "circles far from the queen with food": (policy(turn_with_food), CIRCLES),
    "chooses at random": (policies.random_policy(), OTHER),
    "stands still": (always(GIVE), OTHER),
    "runs against a wall": (always(FORWARD), OTHER),
}


@pytest.mark.parametrize("name", CASES)
def test_constructed_policies(name):
    table, expected = CASES[name]
    trace = rollout(paper(), table, 0, max_steps=STEPS, task=STILL)
    (found,), (earned,) = classify(trace, STEPS)
    assert BEHAVIOURS[found] == BEHAVIOURS[expected]
    assert earned == trace.rewards.sum()


SEEN = "carrying E S E"


def made(n=16, name="foraging E T E", every=4, start=0, delivered=False):
    """n steps in one state, of which every so many go ahead and the others to the left."""
    numbers = np.arange(n)
    ends = numbers == n - 1
    return SimpleNamespace(
        episodes=np.full(n, 5),
        steps=numbers,
        paper_states=np.full(n, STATES.index(name)),
        actions=np.where((numbers - start) % every == 0, FORWARD, LEFT),
        rewards=np.full(n, -7),
        delivered=ends & delivered,
    )


def joined(*parts):
    """Episodes one after the other."""
    fields = [{**vars(part), "episodes": np.full(16, n)} for n, part in enumerate(parts)]
    return SimpleNamespace(
        **{name: np.concatenate([field[name] for field in fields]) for name in fields[0]}
    )


def halves(early, late):
    """The first half of one episode and the second half of another."""
    return SimpleNamespace(
        **{
            name: np.concatenate([getattr(early, name)[:8], getattr(late, name)[8:]])
            for name in vars(early)
        }
    )


@pytest.mark.parametrize(
    ("trace", "expected"),
    [
        (made(), WALKS),
        (made(every=7, start=5), OTHER),  # one step of eight
        (made(name=SEEN), CIRCLES),
        (made(name=SEEN, every=7, start=5), OTHER),
        (made(name="foraging E F E"), OTHER),
        (made(delivered=True), DELIVERS),
        (halves(made(name=SEEN), made()), WALKS),
        (halves(made(), made(name=SEEN)), CIRCLES),
        (halves(made(every=1), made(every=20, start=19)), OTHER),
    ],
)
def test_the_borders(trace, expected):
    """Rewards, here all -7, play no part."""
    (found,), (earned,) = classify(trace, 16)
    assert (BEHAVIOURS[found], earned) == (BEHAVIOURS[expected], -7 * 16)


def test_episodes_are_told_apart():
    trace = joined(made(), made(name=SEEN), made(delivered=True), made(every=20, start=19))
    assert classify(trace, 16)[0].tolist() == [WALKS, CIRCLES, DELIVERS, OTHER]


@pytest.mark.parametrize(
    ("view", "action"), [("T T T", PICK_UP), ("T T T", GIVE), ("E T E", RIGHT), ("F F T", LEFT)]
)
def test_only_moves_onto_what_is_paid_count(view, action):
    trace = made(name=f"foraging {view}")
    trace.actions[:] = action
    assert classify(trace, 16)[0] == [OTHER]
