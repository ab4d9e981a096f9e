"""The registry of worlds: functions that return a `World`, by name; the paper's world."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from typing import Any

from taichi_ants.errors import AntsError, expect, shown, whole
from taichi_ants.files import place_of
from taichi_ants.registry import Registry
from taichi_ants.settings import DeclaredSetting, declared, not_a_setting
from taichi_ants.worlds.double_bridge import double_bridge
from taichi_ants.worlds.open_world import far_piles, open_world
from taichi_ants.worlds.text_map import load_map
from taichi_ants.worlds.world import World


def paper() -> World:
    """Return the paper's world: 271 cells, one food item, and a trail along the whole x axis.

    >>> worlds.paper().foods.tolist()
    [[9, 0, 0]]
    """
    return World(
        ranges=(10, 10, 10),
        queen=(0, 9, 9),
        foods=[(9, 0, 0)],
        trails=[((i, 0, 0), 25) for i in range(-8, 9)],
        ants=[((0, 8, 8), 0)],
    )


Builder = Callable[..., World]
BUILT_IN: dict[str, Builder] = {
    "double_bridge": double_bridge,
    "far_piles": far_piles,
    "open": open_world,
    "paper": paper,
}
WORLDS: Registry[Builder] = Registry("world", "taichi_ants.worlds.register", BUILT_IN)
names = WORLDS.names


def register(name: str, builder: Builder) -> None:
    """Register a world by a name for `build` and commands; it replaces your own world of that name.

    The builder is called with the settings of the world as keywords and returns a `World`. All its
    arguments except `seed` need defaults. A builder with an argument `seed` gets a whole number and
    must return the same world for the same number. Raises AntsError if the name is not a word or
    belongs to a built-in world, or if an argument has no default.

    >>> worlds.register("small", lambda seed=0: worlds.open_world(seed, ranges=(8, 8, 8)))
    >>> worlds.build("small", seed=3).ranges
    (8, 8, 8)
    """
    WORLDS.check_new(name)
    for argument in _arguments(builder).values():
        if argument.default is argument.empty and argument.name != "seed":
            raise AntsError(
                f"the argument {argument.name} of the builder of {name!r} has no default; give it "
                "one, or call it seed."
            )
    WORLDS.add(name, builder)


def is_drawn(name_or_path: str | os.PathLike[str]) -> bool:
    """Return whether a world depends on a seed; the paper's, bridges and map files do not."""
    return name_or_path in names() and "seed" in _arguments(WORLDS.get(str(name_or_path)))


def _arguments(builder: Builder) -> dict[str, inspect.Parameter]:
    return dict(inspect.signature(builder).parameters)


def settings_of(name: str) -> tuple[DeclaredSetting, ...]:
    """Return the declared settings of a registered world."""
    return declared(WORLDS.get(name))


def check_seed_counts(name_or_path: str, option: str = "--world.seed") -> None:
    """Raise AntsError unless the world depends on a seed."""
    if not is_drawn(name_or_path):
        build(name_or_path)  # the name may be wrong
        drawn = ", ".join(filter(is_drawn, names()))
        raise AntsError(
            f"{option} has no effect on {shown(name_or_path)}, which is not drawn at random; leave "
            f"it out, or choose one of the worlds {drawn}."
        )


def build(name_or_path: str | os.PathLike[str], seed: int = 0, **settings: Any) -> World:
    """Return the world with a registered name or, if there is none, of a map file.

    Args:
        name_or_path: A name, see `names`, or the path of a map file, see `load_map`.
        seed: Any whole number; only worlds that are drawn at random use it.
        settings: The settings of the world by name, such as `ranges`.

    Raises:
        AntsError: Neither the name nor the file exists, or a setting is not allowed.

    >>> worlds.build("open", seed=3).ranges
    (10, 18, 53)
    """
    seed = whole("seed", seed)
    expect("the world", name_or_path, str, os.PathLike)
    builder = WORLDS.get(name_or_path) if name_or_path in names() else None
    allowed = _arguments(builder).keys() - {"seed"} if builder else set()
    for name in settings:
        if name not in allowed:
            of = f"the world {shown(name_or_path)}"
            raise AntsError(f"`world.{name}` {not_a_setting(name, sorted(allowed), of)}")
    if builder is None:
        if os.path.exists(place_of(name_or_path)):
            return load_map(name_or_path)
        raise WORLDS.unknown(os.fspath(name_or_path), "give the path of a map file that exists, ")
    world = builder(**settings, **({"seed": seed} if is_drawn(name_or_path) else {}))
    expect(f"the result of the builder of {shown(name_or_path)}", world, World)
    return world
