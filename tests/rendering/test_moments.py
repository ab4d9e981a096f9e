"""What is drawn of an episode equals its trace and the reference's world at every step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_worlds import random_world

from taichi_ants import AntsError, Task, World, reference, rollout
from taichi_ants.grid.hexgrid import normal_form
from taichi_ants.grid.randomness import GAMMA
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.rendering import Episode, Scene, frames
from taichi_ants.worlds import paper


def pantry() -> World:
    """Foods side by side, so that an ant has to choose which one to take."""
    return World(
        ranges=(6, 6, 6),
        queen=(0, 0, 0),
        foods=[(1, 4, 0)] + [(x, y, 0) for x in range(2, 6) for y in range(2, 6)],
        trails=[((0, 1, 0), 3)],
        ants=[((1, 3, 0), 1)],
    )


def draws_between(one: int, other: int) -> int:
    """How many draws lead from one state of a random stream to another."""
    return (other - one) * pow(GAMMA, -1, 2**64) % 2**64


def check(world: World, seed: int, number: int, evaporation: bool, epsilon: float) -> int:
    """Compare step by step; the number of choices among several foods."""
    table, task = trail_follower(), Task(evaporation_in_evaluation=evaporation)
    trace = rollout(world, table, seed, number, 120, task, epsilon)
    episode = Episode.play(
        world, table, seed=seed, number=number, max_steps=120, task=task, epsilon=epsilon
    )
    assert episode.trace == trace
    moments = list(episode.moments())
    assert len(moments) == len(trace) + 1

    colony = reference.follower(world, table, seed, number, task, epsilon)
    colony.begin_episode()
    existing = list(colony.world.ground)
    index = world.grid.index(np.array(existing))
    choices = 0
    for step, (snapshot, status) in enumerate(moments):
        ant = colony.ants[0]
        assert snapshot.ground[index].tolist() == [colony.world.ground[cell] for cell in existing]
        assert snapshot.trail[index].tolist() == [colony.world.level(cell) for cell in existing]
        assert snapshot.ant_cells[0] == world.grid.index(normal_form(ant.cell))
        assert snapshot.ant_headings[0] == ant.heading
        assert snapshot.ant_carries[0] == ant.carries
        assert status.state == ant.state
        if step == len(trace):
            break
        assert snapshot.ant_cells[0] == world.grid.index(trace.cells[step])
        assert snapshot.ant_headings[0] == trace.headings[step]
        before = ant.stream.state
        colony.tick()
        assert colony.transitions[0].action == trace.actions[step]
        choices += draws_between(before, ant.stream.state) > 1
    return choices


@pytest.mark.parametrize("evaporation", [True, False])
def test_the_paper_world(evaporation) -> None:
    check(paper(), 0, 0, evaporation, 0.0)
    check(paper(), 1, 2, evaporation, 0.6)


def test_several_foods_in_view() -> None:
    choices = [check(pantry(), seed, seed % 3, True, 0.3) for seed in range(8)]
    assert sum(choices) >= 4


@pytest.mark.parametrize("seed", range(12))
def test_random_worlds(seed) -> None:
    check(random_world(seed), seed, seed % 4, bool(seed % 2), 0.4)


def test_what_the_head_up_lines_say() -> None:
    episode = Episode.play(paper(), trail_follower())
    statuses = [status for _, status in episode.moments()]
    assert len(statuses) == len(episode) == 35
    assert statuses[0].episode_return == 0
    assert [status.step for status in statuses] == list(range(35))
    assert statuses[-1].episode_return == 45
    assert statuses[-1].outcome == "delivered"
    assert episode.delivered
    assert {status.outcome for status in statuses[:-1]} == {""}
    gained = np.diff([status.episode_return for status in statuses])
    assert (gained == episode.trace.rewards).all()
    lost = Episode.play(paper(), random_policy(), max_steps=5)
    assert not lost.delivered
    assert [status.outcome for _, status in lost.moments()][-1] == "step limit"
    begun = replace(lost, whole=False)
    assert [status.outcome for _, status in begun.moments()][-1] == ""


def test_the_moment_of_one_step_is_that_of_all() -> None:
    episode = Episode.play(pantry(), trail_follower(), max_steps=12)
    last = len(episode) - 1
    pictures = list(frames(episode.moments(), (400, 330)))
    scene = Scene(episode.world.grid, (400, 330))
    for step in (0, 1, last):
        assert (scene.draw(*episode.moment(step)) == pictures[step]).all()
    assert not (pictures[0] == pictures[1]).all()
    with pytest.raises(AntsError, match="step"):
        episode.moment(last + 1)


def test_moments_do_not_share_their_arrays() -> None:
    snapshots = [snapshot for snapshot, _ in Episode.play(paper(), trail_follower()).moments()]
    assert (snapshots[0].ground == paper().ground()).all()
    assert not (snapshots[-1].ground == paper().ground()).all()
