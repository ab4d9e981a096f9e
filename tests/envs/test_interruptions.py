"""Ctrl-C in environments: whether an episode has ended is what the kernel did."""

from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from interrupts import interrupted_after_launch

from taichi_ants.envs.forage import HexForageVectorEnv


def lone(mode: str) -> Any:
    return HexForageVectorEnv(3, max_steps=4, observation_format="index", autoreset_mode=mode)


@pytest.mark.parametrize("rolls", [False, True])
@pytest.mark.parametrize("mode", ["NextStep", "Disabled"])
def test_vector_environments_know_who_has_ended(rolls: bool, mode: str) -> None:
    ours, theirs = lone(mode), lone(mode)
    actions = np.ones((4, ours.num_envs), int)
    for env in (ours, theirs):
        env.reset(seed=3)
        for taken in actions[:3]:
            env.step(taken)
    theirs.step(actions[0])
    with interrupted_after_launch():
        ours.rollout(actions[:1]) if rolls else ours.step(actions[0])
    if mode == "Disabled":
        with pytest.raises(ResetNeeded, match="has ended"):
            ours.step(actions[0])
        return
    for _ in range(6):
        one, two = ours.step(actions[0]), theirs.step(actions[0])
        assert all(np.array_equal(one[k], two[k]) for k in range(4))
