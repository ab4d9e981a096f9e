"""Regions of worlds: their forms, files, and their names as cells of interventions."""

import pickle

import pytest

from taichi_ants import AntsError, At, Colony, Task, World, worlds
from taichi_ants.task.constants import EMPTY, OBSTACLE
from taichi_ants.worlds import to_text


def test_copies_and_files_keep_regions():
    plain = worlds.paper()
    world = plain.with_regions({"left": [(3, 0, 0)], "disc": {"centre": (0, 0, 0), "radius": 1}})
    assert {name: len(cells) for name, cells in world.regions.items()} == {"left": 1, "disc": 7}
    again = pickle.loads(pickle.dumps(world))
    assert again == world == World.from_dict(world.as_dict()) != plain
    assert hash(again) == hash(world)
    with pytest.raises(AntsError, match="a map cannot show regions"):
        to_text(world)


def test_interventions_take_the_regions_of_each_world(tmp_path):
    """Worlds of a colony can have different cells in a region of the same name."""
    shared = worlds.open_world(3, (6, 6, 6))
    some = [shared.with_regions({"gate": [cell]}) for cell in ((5, 0, 0), (0, 5, 0))]
    task = Task(choice="deneubourg")
    colony = Colony(some, task, None, (1, 2), ants=3, sharing="frozen")
    protocol = [At(1, place={"what": "rock", "cells": "gate"}), At(2, clear="gate")]
    for ticks, ground in ((2, OBSTACLE), (3, EMPTY)):
        colony.run(1, ticks, protocol=protocol[: ticks - 1])
        for w, world in enumerate(some):
            assert colony.snapshot(w).ground[world.region("gate")] == ground
    colony.save(tmp_path / "colony.npz")
    assert Colony.load(tmp_path / "colony.npz").worlds == tuple(some)
    with pytest.raises(AntsError, match=r"no region 'gte' in the world, whose regions are: gate"):
        colony.run(1, 5, protocol=[At(1, clear="gte")])
