"""The registry of worlds."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from typing import Any

from taichi_ants.errors import AntsError, expect, shown, whole
from taichi_ants.files import inputs
from taichi_ants.settings import DeclaredSetting, declared, not_a_setting
from taichi_ants.worlds.double_bridge import double_bridge
from taichi_ants.worlds.open_world import far_piles, open_world
from taichi_ants.worlds.text_map import load_map
from taichi_ants.worlds.world import World

Builder = Callable[..., World]


def paper() -> World:
    """Return the paper's world: 271 cells, one food item, and a trail along the whole x axis."""
    return World(
        ranges=(10, 10, 10),
        queen=(0, 9, 9),
        foods=[(9, 0, 0)],
        trails=[((i, 0, 0), 25) for i in range(-8, 9)],
        ants=[((0, 8, 8), 0)],
    )


BUILT_IN: dict[str, Builder] = {
    "paper": paper,
    "open": open_world,
    "far_piles": far_piles,
    "double_bridge": double_bridge,
}
_BUILDERS = dict(BUILT_IN)


def register(name: str, builder: Builder) -> None:
    """Register a world by a name for `build` and commands; it replaces your own world of that name.

    The builder is called with the settings of the world as keywords and returns a `World`. All its
    arguments except `seed` need defaults. A builder with an argument `seed` gets a whole number and
    must return the same world for the same number. Raises AntsError if the name is not text or
    belongs to a built-in world, or if an argument has no default.
    """
    if not isinstance(name, str) or not name.strip():
        raise AntsError(f"the world name {shown(name)} is not allowed; it must be text.")
    if name in BUILT_IN:
        raise AntsError(
            f"{name!r} is the name of a built-in world, which cannot be replaced; choose another "
            "name."
        )
    if not callable(builder):
        raise AntsError(
            f"the builder of {shown(name)} is {shown(builder)}; it must be a function of a seed."
        )
    for one in inspect.signature(builder).parameters.values():
        if one.default is one.empty and one.name != "seed":
            raise AntsError(
                f"the argument {one.name} of the builder of {name!r} has no default; give it one, "
                "or call it seed."
            )
    _BUILDERS[name] = builder


def names() -> tuple[str, ...]:
    """Return the registered names, sorted."""
    return tuple(sorted(_BUILDERS))


def is_drawn(name_or_path: str | os.PathLike[str]) -> bool:
    """Return whether a world depends on a seed; the paper's, bridges and map files do not."""
    builder = _BUILDERS.get(name_or_path) if isinstance(name_or_path, str) else None
    return builder is not None and "seed" in inspect.signature(builder).parameters


def settings_of(name: str) -> tuple[DeclaredSetting, ...]:
    """Return the declared settings of a registered world."""
    return declared(_BUILDERS[name])


def check_seed_counts(name_or_path: str, option: str = "--world.seed") -> None:
    """Raise AntsError unless the world depends on a seed."""
    if not is_drawn(name_or_path):
        drawn = ", ".join(filter(is_drawn, names()))
        raise AntsError(
            f"{option} has no effect on {shown(name_or_path)}, which is not drawn at random; leave "
            f"it out, or choose one of the worlds {drawn}."
        )


def build(name_or_path: str | os.PathLike[str], seed: int = 0, **given: Any) -> World:
    """Return the world with a registered name or, if there is none, of a map file.

    The seed is any whole number, which only some builders use; `given` are settings of the world.
    Raises AntsError if neither the name nor the file exists, or the builder fails.
    """
    seed = whole("seed", seed)
    expect("the world", name_or_path, str, os.PathLike)
    builder = _BUILDERS.get(name_or_path) if isinstance(name_or_path, str) else None
    allowed = {*inspect.signature(builder).parameters} - {"seed"} if builder else set()
    for name in given:
        if name not in allowed:
            of = f"the world {shown(name_or_path)}"
            raise AntsError(f"`world.{name}` {not_a_setting(name, sorted(allowed), of)}")
    if builder is None:
        if os.path.exists(inputs.place_of(name_or_path)):
            return load_map(name_or_path)
        raise AntsError(
            f"there is no world named {shown(os.fspath(name_or_path))} and no such file; choose "
            f"one of {', '.join(names())}, or give the path of a map file."
        )
    try:
        world = builder(**given, **({"seed": seed} if is_drawn(name_or_path) else {}))
    except AntsError:
        raise
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise AntsError(
            f"the builder of {shown(name_or_path)} failed with {reason}; correct it."
        ) from error
    expect(f"the result of the builder of {shown(name_or_path)}", world, World)
    return world
