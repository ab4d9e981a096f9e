"""Vector environments for Stable-Baselines3, as its class `VecEnv`."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from taichi_ants.errors import AntsError, missing, shown

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise ImportError(missing("taichi_ants.envs.sb3", "stable_baselines3", "sb3")) from error


class SB3VecEnv(VecEnv):
    """A vector environment of this package as a `VecEnv` of Stable-Baselines3.

        envs = HexForageVectorEnv(64, observation_format="one_hot", autoreset_mode="SameStep")
        PPO("MlpPolicy", SB3VecEnv(envs)).learn(100_000)

    The info of an environment is empty unless its episode has ended. It then has the last
    observation, `terminal_observation`, the `deliveries` of the episode, and `TimeLimit.truncated`,
    True if the step limit ended it. For returns and lengths of episodes, use SB3's wrapper
    `VecMonitor(envs, info_keywords=("deliveries",))`.

    All environments are one object, so they share the attributes of `envs`. The only method of
    single environments is `action_masks`, which MaskablePPO of sb3-contrib calls.

    Attributes:
        envs: The environments, with autoreset_mode "SameStep".
        infos: The infos of the last step or reset, in Gymnasium's format.
    """

    def __init__(self, envs: VectorEnv) -> None:
        if not isinstance(envs, VectorEnv):
            raise AntsError(f"envs is {shown(envs)}; it must be a gymnasium.vector.VectorEnv.")
        mode = envs.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise AntsError(
                f"autoreset_mode of envs is {mode.value if mode else mode!r}; Stable-Baselines3 "
                'requires "SameStep".'
            )
        self.envs, self._actions = envs, np.zeros(0, np.int64)
        self.infos: dict[str, Any] = {}
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> np.ndarray:
        """Return the first observations of new episodes, with the seeds that `seed` has set."""
        seen, self.infos = self.envs.reset(seed=self._seeds[0])  # further seeds are consecutive
        self._reset_seeds()
        return seen

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Return observations, float32 rewards, ends of episodes, and infos after the actions."""
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
        """Return a picture of each environment."""
        pictures: Any = self.envs.render()
        return [None] * self.num_envs if pictures is None else list(pictures)

    def action_masks(self) -> np.ndarray:
        """Return the actions that can succeed now, bool (num_envs, 5)."""
        return self.infos["action_mask"].astype(bool)

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        owner = self if attr_name == "action_masks" else self.envs
        return [getattr(owner, attr_name)] * len([*self._get_indices(indices)])

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of `envs`; AntsError if `indices` are not all environments."""
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise AntsError(
                f"indices is {shown(indices)}; all environments share their attributes, so leave "
                "indices out."
            )
        setattr(self.envs, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Return the result of `action_masks`, the only method, for each environment."""
        if method_name != "action_masks":
            raise AntsError(
                f"method_name is {shown(method_name)}; the only method of a single environment is "
                "action_masks, so call methods of `envs` instead."
            )
        return list(self.action_masks()[[*self._get_indices(indices)]])

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Return False for each environment, because single environments have no wrappers."""
        return [False] * len([*self._get_indices(indices)])
