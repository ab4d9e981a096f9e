"""The form of a new session has every setting, and makes the tasks that have names."""

import pytest

from taichi_ants import TrainingConfig
from taichi_ants.commands import watch
from taichi_ants.live.choices import TASKS, Choices, fields
from taichi_ants.settings import Named, all_of
from taichi_ants.task import Labour, Task
from taichi_ants.worlds import double_bridge


@pytest.mark.parametrize("name", TASKS)
def test_the_form_makes_the_tasks_that_have_names(name):
    settings = Choices({}).as_dict()["tasks"][name]["settings"]
    setup = Choices({}).setup({**watch.START, "settings": settings})
    assert setup.task == Task.named()[name]


def test_the_form_has_every_setting_with_its_bounds():
    offered = {one["path"]: one for one in fields()}
    declared = [*all_of(Task), *all_of(TrainingConfig), *all_of(double_bridge)]
    shown = [one for one in declared if not one.is_group and one.kind is not Named]
    paths = {one.path for one in shown} - {
        "training.learner",
        "task.outbound_cue",
        "task.homing_cue",
        "task.choice.carriers_follow",  # of a field, which the page does not have
        *(one.path for one in all_of(Labour)),  # without castes, ants have no thresholds
    }
    assert paths < offered.keys()
    half_life = offered["task.pheromone.half_life"]
    assert (half_life["above"], half_life["default"], half_life["unit"]) == (0, 50.0, "ticks")
    assert half_life["only"] == ["task.pheromone.evaporation", "exponential"]
    assert offered["training.planning_steps"]["learner"] != ""
    assert offered["world.aside"]["world"] == "double_bridge"
