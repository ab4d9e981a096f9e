"""What is drawn of an episode equals its trace and the reference's world at every step."""

import itertools

import numpy as np
import pytest
from plain_runs import follower
from random_worlds import random_world

from taichi_ants import AntsError, Colony, Task, TrainingConfig, World, rollout
from taichi_ants.grid.hexgrid import normal_form
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.rendering import Episode, colony_snapshots, frames
from taichi_ants.task import Caste, Life
from taichi_ants.worlds import open_world, paper

CONFIG = TrainingConfig("sarsa", 0.01, 0.9, 0.5, 0.995)


@pytest.mark.parametrize("seed", range(8))
def test_snapshots_of_an_episode_are_the_worlds_of_the_reference(seed) -> None:
    world, epsilon = paper() if seed > 5 else random_world(seed), 0.6 * (seed % 4 > 0)
    table, task = trail_follower(), Task(evaporation_in_evaluation=bool(seed % 2))
    trace = rollout(world, table, seed, 0, 120, task, epsilon)
    episode = Episode.play(world, table, seed=seed, max_steps=120, task=task, epsilon=epsilon)
    assert episode.trace == trace
    snapshots = list(episode.snapshots())
    assert len(snapshots) == len(trace) + 1
    colony = follower(world, table, seed, 0, task, epsilon)
    colony.begin_episode()
    existing = list(colony.world.ground)
    index = world.grid.index(np.array(existing))
    for snapshot, status in snapshots:
        ant = colony.ants[0]
        assert snapshot.ground[index].tolist() == [colony.world.ground[cell] for cell in existing]
        levels = [colony.world.trail.level(cell) for cell in existing]
        assert snapshot.trail[index].tolist() == levels
        assert snapshot.ant_cells[0] == world.grid.index(normal_form(ant.cell))
        assert snapshot.ant_headings[0] == ant.heading
        assert snapshot.ant_carries[0] == ant.carries
        assert status.state == ant.state
        if not colony.over:
            colony.tick()


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


def colony(ants: int = 30) -> Colony:
    made = Colony(open_world(3), None, CONFIG, 0, ants, sharing="frozen", q_values=trail_follower())
    made.begin_episode()
    return made


def test_a_colony_on_the_move() -> None:
    pictures = list(frames(colony_snapshots(colony(), 7, frame_interval=3), (200, 150)))
    assert len(pictures) == 4
    assert not any((a == b).all() for a, b in itertools.pairwise(pictures))
    other = colony()
    other.tick(7)
    assert (next(frames(colony_snapshots(other), (200, 150))) == pictures[-1]).all()
    for wrong in ({"frame_interval": 0}, {"ticks": -1}):
        with pytest.raises(AntsError, match=next(iter(wrong))):
            list(colony_snapshots(colony(), **{"ticks": 5, **wrong}))


@pytest.mark.parametrize("observation", ["paper", "ants"])
def test_one_ant_of_a_colony_is_followed(observation) -> None:
    """With its state and its action values; as without it once it is dead."""
    table = random_policy(observation)
    table += np.arange(table.shape[0])[:, None]
    task = Task(observation, life=Life(lifespan=9))
    made = Colony(open_world(3), task, CONFIG, 0, 20, sharing="frozen", q_values=table)
    made.begin_episode()
    for _ in range(8):
        snapshot, status = next(colony_snapshots(made, follow=5))
        slot = int(np.flatnonzero(made.numbers[0] == 5)[0])
        assert snapshot.ant_cells[0] == made.cells[0, slot]
        assert sorted(snapshot.ant_cells) == sorted(made.snapshot().ant_cells)
        assert status.q_values[0] == status.state == table[status.state, 0]
        assert ("ant", "5") in status.lines
        assert ("sees", task.sees.name_of(status.state).split(" ", 1)[1]) in status.lines
        made.tick()
    made.tick()
    _, status = next(colony_snapshots(made, follow=5))
    assert status.state is None
    with pytest.raises(AntsError, match="follow is 20; it must lie between 0 and 19"):
        next(colony_snapshots(made, follow=20))


def test_a_followed_ant_has_the_colours_and_the_table_of_its_nest_and_caste() -> None:
    """Each table has its number as its values; the followed ant moves to the front as a whole."""
    world = World((6, 6, 6), queen=[(0, 0, 0), (3, 0, 0)], foods=[(0, 3, 0)])
    task = Task(castes={"a": Caste(share=0.5), "b": Caste(share=0.5)})
    tables = np.broadcast_to(np.arange(4.0).reshape(2, 2, 1, 1), (2, 2, task.n_states, 5))
    made = Colony(world, task, CONFIG, 0, 8, sharing="frozen", q_values=tables[None])
    made.begin_episode()
    before = made.snapshot()
    for number in range(8):
        (at,) = np.flatnonzero(before.ant_numbers == number)
        snapshot, status = next(colony_snapshots(made, follow=number))
        nest, caste = before.ant_nests[at], before.ant_castes[at]
        assert (snapshot.ant_nests[0], snapshot.ant_castes[0]) == (nest, caste)
        assert snapshot.ant_numbers[0] == number
        assert (status.q_values == 2 * nest + caste).all()
    assert len({*zip(before.ant_nests.tolist(), before.ant_castes.tolist(), strict=True)}) == 4
