"""Adapt the vector environments of this package to Stable-Baselines3; see `sb3_ppo.py`.

Requires Stable-Baselines3: `pip install "stable-baselines3>=2.4"`. The info of an environment is
empty unless its episode has ended. It then has the last observation, `terminal_observation`, the
`deliveries` of the episode, and `TimeLimit.truncated`. For returns and lengths of episodes, use
SB3's wrapper `VecMonitor(envs, info_keywords=("deliveries",))`.
"""

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from stable_baselines3.common.vec_env import VecEnv


class SB3VecEnv(VecEnv):
    """A vector environment as a `VecEnv`; `envs` must have autoreset_mode "SameStep".

    All environments are one object, so they share its attributes. The only method of single
    environments is `action_masks`, which MaskablePPO of sb3-contrib calls.
    """

    def __init__(self, envs: VectorEnv) -> None:
        if envs.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
            raise ValueError('Stable-Baselines3 requires autoreset_mode="SameStep".')
        self.envs, self._actions = envs, np.zeros(0, np.int64)
        self.infos: dict[str, Any] = {}  # of the last step or reset, as in Gymnasium
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> np.ndarray:
        seen, self.infos = self.envs.reset(seed=self._seeds[0])  # further seeds are consecutive
        self._reset_seeds()
        return seen

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        seen, rewards, terminated, truncated, self.infos = self.envs.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = terminated | truncated
        for number in np.flatnonzero(ended):
            infos[number] = {
                "terminal_observation": self.infos["final_obs"][number],
                "TimeLimit.truncated": bool(truncated[number] and not terminated[number]),
                "deliveries": int(self.infos["final_info"]["deliveries"][number]),
            }
        return seen, rewards.astype(np.float32), ended, infos

    def close(self) -> None:
        self.envs.close()

    def get_images(self) -> list[np.ndarray | None]:
        pictures: Any = self.envs.render()
        return [None] * self.num_envs if pictures is None else list(pictures)

    def action_masks(self) -> np.ndarray:
        """Return the actions that can succeed now, bool (num_envs, 5)."""
        return self.infos["action_mask"].astype(bool)

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        owner = self if attr_name == "action_masks" else self.envs
        return [getattr(owner, attr_name)] * len([*self._get_indices(indices)])

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        setattr(self.envs, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **how: Any) -> list:
        if method_name != "action_masks":
            raise AttributeError(f"single environments have no {method_name}")
        return list(self.action_masks()[[*self._get_indices(indices)]])

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        return [False] * len([*self._get_indices(indices)])
