"""Ants that are given their actions do what those of the plain reference do, event by event."""

import numpy as np
import pytest
from colonies import act, training
from random_choices import NOISE
from random_colonies import RandomColony, random_colony
from random_rewards import random_rewards
from same_colonies import assert_equal
from same_steps import likely

from taichi_ants.envs.colony import ColonyWorlds
from taichi_ants.envs.vector import Arguments
from taichi_ants.reference import ReferenceColony
from taichi_ants.task.constants import N_ACTIONS, PICK_UP, Event
from taichi_ants.worlds import paper

N_WORLDS = 3
SUCCESSES = (Event.ENTERED_EMPTY, Event.ENTERED_CUE, Event.PICKED_UP, Event.DELIVERED)


def several(drawn: RandomColony) -> ColonyWorlds:
    population = drawn.population
    given = Arguments(drawn.world, drawn.task, 30, "index", None)
    which = population["ants"], population["start"], population["capacity"]
    return ColonyWorlds(N_WORLDS, given, *which)


def plain_one(worlds: ColonyWorlds, seed: int) -> ReferenceColony:
    ours = worlds.colony
    return ReferenceColony(
        *(ours.worlds[0], ours.task, training(), seed, ours.ants, ours.capacity, ours.start),
        sharing="frozen",
        q_values=np.zeros((ours.task.n_states, N_ACTIONS), np.float32),
    )


def compare_step(worlds: ColonyWorlds, world: int, plain: ReferenceColony, actions) -> None:
    """Do the tick in the reference, and compare what the step has said of each ant."""
    slots = sorted(plain.ants)
    act(plain, *actions[world, slots].tolist())
    assert np.flatnonzero(worlds.acted[world]).tolist() == slots
    for step in plain.transitions:
        assert worlds.rewards[world, step.slot] == step.reward
        assert worlds.events[world, step.slot] == step.event
    assert not worlds.rewards[world, ~worlds.acted[world]].any()


@pytest.mark.parametrize(
    "rules",
    [
        {"observation": "ants", "traffic": "right_of_way", "view": "strongest"},
        pytest.param(
            {"observation": "queues", "traffic": "following", "view": "strongest_under_carriers"},
            marks=pytest.mark.slow,
        ),
        {"noise": NOISE},
    ],
    ids=["foraging", "queueing", "noise"],
)
def test_each_ant_of_each_world_at_every_tick(rules):
    """Ants and food come and go; now and then a world begins anew, at times with another seed."""
    happened = dict.fromkeys((*Event, "begun", "seeded", "born", "dead"), 0)
    for seed in range(5):
        rng = np.random.default_rng([seed, 11])
        drawn = random_colony(
            seed, rewards=random_rewards(seed), dense=False, changes=True, **rules
        )
        worlds = several(drawn)
        seeds = [seed + 100 * w for w in range(N_WORLDS)]
        plains = [plain_one(worlds, one) for one in seeds]
        worlds.begin(np.ones(N_WORLDS, bool), seeds)
        for plain in plains:
            plain.begin_episode()
        for _ in range(25):
            for world, plain in enumerate(plains):
                assert_equal(worlds.colony, plain, world)
            masks = worlds.action_masks()
            actions = likely(rng, masks)
            worlds.step(actions)
            for world, plain in enumerate(plains):
                compare_step(worlds, world, plain, actions)
                for step in plain.transitions:
                    happened[step.event] += 1
                    # What the mask rules out never succeeds.
                    assert step.event not in SUCCESSES or masks[world, step.slot, step.executed]
            happened["born"] += sum(plain.record.births for plain in plains)
            happened["dead"] += sum(plain.record.deaths for plain in plains)
            begins = rng.random(N_WORLDS) < 0.1
            new = [int(rng.integers(99)) if rng.random() < 0.5 else None for _ in plains]
            if begins.any():
                worlds.begin(begins, new)
            for world in np.flatnonzero(begins):
                happened["begun" if new[world] is None else "seeded"] += 1
                if new[world] is not None:
                    plains[world] = plain_one(worlds, new[world])
                else:
                    plains[world].end_episode()
                plains[world].begin_episode()
    rare = [Event.PUSHED] if "traffic" in rules else []
    expected = [one for one in happened if one not in (Event.NONE, Event.PUSHED)] + rare
    assert all(happened[event] > 2 for event in expected), happened


def test_what_the_mask_allows_succeeds_where_an_ant_is_alone():
    """And what it forbids fails."""
    worlds = ColonyWorlds(1, Arguments(paper(), None, 100, "index", None), 1, "spread")
    seen = np.zeros((2, N_ACTIONS), int)
    rng = np.random.default_rng(4)
    worlds.begin(np.ones(1, bool), [0])
    for tick in range(400):
        if tick % 100 == 0:
            worlds.begin(np.ones(1, bool), [tick])
        mask = worlds.action_masks()[0, 0]
        action = likely(rng, mask[None])[0]
        worlds.step(np.array([[action]]))
        succeeds = worlds.events[0, 0] in SUCCESSES
        if worlds.events[0, 0] != Event.BLOCKED or not mask[:PICK_UP].all():  # no dead end
            assert succeeds == mask[action]
            seen[mask[action], action] += 1
    assert (seen[0] > 0).all()
    assert (seen[1, :3] > 0).all()
