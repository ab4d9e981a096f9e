"""Names of worlds, and the paths that stand beside them."""

import pytest

from taichi_ants import worlds
from taichi_ants.errors import AntsError
from taichi_ants.worlds import World, registry


@pytest.fixture(autouse=True)
def _own_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry.WORLDS, "yours", dict(registry.WORLDS.yours))


def tiny(seed: int) -> World:
    return World((3, 3, 3), (0, 0, 0), foods=[(1 + seed, 0, 0)])


@pytest.mark.parametrize("name", worlds.names())
def test_every_registered_world_can_be_used(name: str) -> None:
    world = worlds.build(name, seed=5)
    assert world == worlds.build(name, seed=5)
    assert world.reachable_foods().any()
    cells, _ = world.start(0, 10)
    assert len(set(cells.tolist())) == 10


def test_a_builder_builds_worlds() -> None:
    worlds.register("empty", lambda seed: None)
    with pytest.raises(AntsError, match="builder of 'empty' is None; it must be a World"):
        worlds.build("empty")


@pytest.mark.parametrize("name", ["papr", None, "x" * 5000, "a\0b"])
def test_unknown_names_list_the_known_ones(name: object) -> None:
    known = r"choose one of double_bridge, far_piles, open, paper|must be text or a path"
    with pytest.raises(AntsError, match=known):
        worlds.build(name)
