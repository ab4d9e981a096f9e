"""Environments for your own agents: Gymnasium, vector environments, PettingZoo.

Importing this package registers them with Gymnasium.
"""

from gymnasium.envs.registration import register

from taichi_ants.task.constants import Event, Reason

__all__ = ["Event", "Reason"]
__dir__ = __all__.copy  # completion lists only public names

register(
    "taichi_ants/HexForage-v0",
    entry_point="taichi_ants.envs.forage:HexForageEnv",
    vector_entry_point="taichi_ants.envs.forage:HexForageVectorEnv",
    order_enforce=False,  # instead of Gymnasium's wrappers, the environment checks its calls
    disable_env_checker=True,
)
register(
    "taichi_ants/HexColony-v0", vector_entry_point="taichi_ants.envs.colony:HexColonyVectorEnv"
)
