"""Observations of a user's own: compiled for the kernels after a check, or refused."""

import numpy as np
import pytest
from refusals import refused

from taichi_ants import AntsError, Colony, TrainingConfig, rollout, train
from taichi_ants.task import Field, Observation, Task, observations
from taichi_ants.task.observations import observation
from taichi_ants.worlds import World, paper

CONFIG = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.97)


@pytest.fixture(autouse=True)
def _no_observation_stays(monkeypatch):
    monkeypatch.setattr(observation.OBSERVATIONS, "yours", dict(observation.OBSERVATIONS.yours))


def of_trails(view):
    """Which of the cells ahead have more trail than the ant's own, and which are nearer."""
    index = view.carries
    for k in range(3):
        index = 4 * index + 2 * view.nearer[k]
        if view.levels[k] > view.own_level:
            index += 1
    return index


@pytest.mark.parametrize(("levels", "codes"), [((10, 30, 20), (3, 4, 4)), ((9, 30, 19), (2, 4, 3))])
def test_a_third_of_the_strongest_trail_is_middling_and_two_thirds_are_strong(levels, codes):
    ahead = [(3, 2, 0), (3, 3, 0), (2, 3, 0)]
    trails = list(zip(ahead, levels, strict=True))
    world = World((8, 8, 1), (0, 7, 0), trails=trails, ants=[((2, 2, 0), 1)])
    trace = rollout(world, np.zeros((432, 5)), max_steps=1, task=Task("trail_levels"))
    assert trace.states[0] == 36 * codes[0] + 6 * codes[1] + codes[2]


def own_trail(view):
    on_trail = 0
    if view.own_level >= 1:
        on_trail = 1
    return 2 * view.carries + on_trail


def test_a_row_may_leave_any_part_of_a_look_unread():
    """Taichi's compiler drops what computes the parts that nobody reads."""
    task = Task(observations.register(Observation("mine", 4, own_trail)).name)
    assert train(paper(), CONFIG, (0, 1), 20, 80, task).q_values.shape == (1, 2, 4, 5)
    colony = Colony(paper(), task, CONFIG, ants=5)
    colony.run(2, 30)
    assert colony.q_values.shape == (1, 4, 5)
    assert colony.q_values.any()


def beyond_the_table(view):
    return view.paper_state + view.carries


def of_what_there_is_not(view):
    return view.smell


def of_a_cell_too_far(view):
    return view.codes[4]


def of_a_division_by_zero(view):
    return 100 // view.strongest


def with_an_early_return(view):
    if view.carries:
        return 64
    return 0


@pytest.mark.parametrize(
    ("encode", "says"),
    [
        (beyond_the_table, "encode fails (it returns 128, which must lie between 0 and 127"),
        (of_what_there_is_not, "a view has no `smell`; choose one of carries, paper_state, codes,"),
        (of_a_cell_too_far, "there is no entry 4"),
        (of_a_division_by_zero, "divide by zero"),
        (with_an_early_return, "encode fails (its only return must be its last line)"),
    ],
)
def test_what_gives_wrong_rows_is_refused_at_once(encode, says):
    said = refused(says, observations.register, Observation("mine", 128, encode))
    assert said.startswith("observation 'mine' cannot be used: ")
    assert "mine" not in observations.names()


def of_home(view):
    """Which of the cells ahead have a higher level of the field, and whether this one has any."""
    index = 0
    for k in range(3):
        index = 2 * index
        if view.home[k] > view.own_home:
            index += 1
    if view.own_home >= 1:
        index += 8
    return index


def test_a_field_that_the_task_lacks_cannot_be_read():
    observations.register(Observation("homely", 16, of_home, reads=("home",)))
    with pytest.raises(
        AntsError, match="'homely' reads is 'home'; it must be one of trail, or the name of a field"
    ):
        Task("homely")
    task = Task("homely", fields={"home": Field(), "other": Field(), "third": Field()})
    message = r"^`task\.fields` has home, other, third, which a run of .*, or use a Colony\.$"
    with pytest.raises(AntsError, match=message):
        train(paper(), CONFIG, 0, task=task)
    observations.register(Observation("trails", 128, of_trails, reads=("trail",)))
    with pytest.raises(AntsError, match=r"^the observation 'trails' reads trail, which a run"):
        train(paper(), CONFIG, 0, task=Task("trails"))
