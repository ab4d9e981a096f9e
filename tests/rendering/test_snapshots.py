"""What is drawn of an episode equals its trace and the reference's world at every step."""

from __future__ import annotations

import numpy as np
import pytest
from random_worlds import random_world

from taichi_ants import Task, World, reference, rollout
from taichi_ants.grid.hexgrid import normal_form
from taichi_ants.grid.randomness import GAMMA
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.rendering import Episode, at_start
from taichi_ants.worlds import open_world, paper


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


def check(world: World, seed: int, evaporation: bool, epsilon: float) -> int:
    """Compare step by step; the number of choices among several foods."""
    table, task = trail_follower(), Task(evaporation_in_evaluation=evaporation)
    trace = rollout(world, table, seed, 0, 120, task, epsilon)
    episode = Episode.play(world, table, seed=seed, max_steps=120, task=task, epsilon=epsilon)
    assert episode.trace == trace
    snapshots = list(episode.snapshots())
    assert len(snapshots) == len(trace) + 1

    colony = reference.follower(world, table, seed, 0, task, epsilon)
    colony.begin_episode()
    existing = list(colony.world.ground)
    index = world.grid.index(np.array(existing))
    choices = 0
    for step, (snapshot, status) in enumerate(snapshots):
        ant = colony.ants[0]
        assert snapshot.ground[index].tolist() == [colony.world.ground[cell] for cell in existing]
        assert snapshot.trail[index].tolist() == [
            colony.world.trail.level(cell) for cell in existing
        ]
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
    check(paper(), 0, evaporation, 0.0)
    check(paper(), 1, evaporation, 0.6)


def test_several_foods_in_view() -> None:
    choices = [check(pantry(), seed, True, 0.3) for seed in range(8)]
    assert sum(choices) >= 4


@pytest.mark.parametrize("seed", range(12))
def test_random_worlds(seed) -> None:
    check(random_world(seed), seed, bool(seed % 2), 0.4)


def test_moments_do_not_share_their_arrays() -> None:
    snapshots = [snapshot for snapshot, _ in Episode.play(paper(), trail_follower()).snapshots()]
    assert (snapshots[0].ground == paper().ground()).all()
    assert not (snapshots[-1].ground == paper().ground()).all()


def test_what_the_lines_say() -> None:
    episode = Episode.play(paper(), trail_follower())
    said = [dict(status.lines) for _, status in episode.snapshots()]
    assert len(said) == len(episode) == 35
    assert [one["step"] for one in said] == [str(step) for step in range(35)]
    assert [said[0]["return"], said[-1]["return"]] == ["0", "45"]
    assert (np.diff([int(one["return"]) for one in said]) == episode.trace.rewards).all()
    assert [said[0]["task"], said[0]["sees"]] == ["foraging", "E T E"]
    assert [said[-2]["action"], said[-1]["outcome"]] == ["give", "delivered"]
    assert not any("outcome" in one for one in said[:-1])
    lost = Episode.play(paper(), random_policy(), max_steps=5)
    assert not lost.delivered
    *_, (_, last) = lost.snapshots()
    assert {"outcome", "action"}.isdisjoint(dict(last.lines))


def test_the_start_of_an_episode() -> None:
    world = open_world(3)
    snapshot = at_start(world, seed=5, n=30)
    cells, headings = world.start(5, 30)
    assert (snapshot.ant_cells == cells).all()
    assert (snapshot.ant_headings == headings).all()
    assert not snapshot.ant_carries.any()
    assert (snapshot.ground == world.ground()).all()
