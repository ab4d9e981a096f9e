"""Names of worlds, and the paths that stand beside them."""

from pathlib import Path

import numpy as np
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


def test_names_and_seeds() -> None:
    assert worlds.names() == ("double_bridge", "far_piles", "open", "paper")
    worlds.register("tiny", tiny)
    assert worlds.names() == ("double_bridge", "far_piles", "open", "paper", "tiny")
    assert worlds.build("tiny") == tiny(0)
    assert worlds.build("tiny", np.int64(1)) == tiny(1)
    assert worlds.build("open", 3) == worlds.open_world(3)
    assert worlds.build("paper", 3) == worlds.paper()


def test_worlds_of_ones_own_are_replaced_and_built_in_ones_are_not() -> None:
    worlds.register("tiny", lambda seed: worlds.paper())
    worlds.register("tiny", tiny)
    assert worlds.build("tiny") == tiny(0)
    with pytest.raises(AntsError, match="'paper' is the name of a built-in world, which cannot be"):
        worlds.register("paper", tiny)


@pytest.mark.parametrize("name", ["", "  ", None, 3])
def test_a_name_is_text(name: object) -> None:
    with pytest.raises(AntsError, match="must be text"):
        worlds.register(name, tiny)


def test_a_builder_builds_worlds() -> None:
    with pytest.raises(AntsError, match="must be a function of a seed"):
        worlds.register("tiny", worlds.paper())
    worlds.register("empty", lambda seed: None)
    with pytest.raises(AntsError, match="builder of 'empty' is None; it must be a World"):
        worlds.build("empty")
    worlds.register("broken", lambda seed: seed // 0)
    with pytest.raises(AntsError, match=r"'broken' failed with ZeroDivisionError: .*; correct it"):
        worlds.build("broken")


def test_a_path_is_a_world_too(tmp_path: Path) -> None:
    file = tmp_path / "map"
    file.write_text("F\n  .\nQ")
    assert worlds.build(file) == worlds.build(str(file)) == worlds.from_text("F\n  .\nQ")


def test_names_go_before_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("paper").write_text("Q")
    Path("other").write_text("Q")
    assert worlds.build("paper") == worlds.paper()
    assert worlds.build(Path("paper")).grid.count == 1
    assert worlds.build("other").grid.count == 1


@pytest.mark.parametrize("name", ["papr", "", "Paper", None, 4, "x" * 5000, "a\0b"])
def test_unknown_names_list_the_known_ones(name: object) -> None:
    known = r"choose one of double_bridge, far_piles, open, paper|must be text or a path"
    with pytest.raises(AntsError, match=known):
        worlds.build(name)


@pytest.mark.parametrize("path", ["maps/none", "none.txt", Path("none")])
def test_missing_files_are_named(path: object) -> None:
    with pytest.raises(AntsError, match=f"no world '{path}'.*; .* path of a map file that exists"):
        worlds.build(path)


@pytest.mark.parametrize("seed", [1.0, "1", None])
def test_a_seed_is_whole(seed: object) -> None:
    with pytest.raises(AntsError, match="seed is"):
        worlds.build("paper", seed)
