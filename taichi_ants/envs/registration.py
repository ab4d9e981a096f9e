"""Registers the environments with Gymnasium, as soon as it is imported and not before.

Gymnasium takes a tenth of a second to import, which `import taichi_ants` alone does not need.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any

IDS = {
    # id: (one environment if there is such, many at once)
    "taichi_ants/HexForage-v0": (
        "taichi_ants.envs.forage:HexForageEnv",
        "taichi_ants.envs.forage:HexForageVectorEnv",
    ),
    "taichi_ants/HexColony-v0": (None, "taichi_ants.envs.colony_vector:HexColonyVectorEnv"),
}


def register() -> None:
    """Register what is not registered yet."""
    import gymnasium

    for name, (one, many) in IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, entry_point=one, vector_entry_point=many)


def register_in_time() -> None:
    """Register now if Gymnasium is imported, else when it is."""
    if "gymnasium.envs.registration" in sys.modules:
        register()
    elif not any(isinstance(finder, _Watch) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Watch())


class _Watch:
    """Waits until Gymnasium is imported."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is not None and spec.loader is not None:
            spec.loader = _ThenRegister(spec.loader)  # type: ignore[assignment]
        return spec


class _ThenRegister:
    """Loads Gymnasium as another loader does, then registers."""

    def __init__(self, loader: Any) -> None:
        self._loader = loader

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        self._loader.exec_module(module)
        register()

    def __getattr__(self, name: str) -> object:
        return getattr(self._loader, name)  # resources, source code ...
