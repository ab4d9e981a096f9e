"""Scenes refuse snapshots that kernels could not bear."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from taichi_ants import AntsError
from taichi_ants.rendering import Scene, Snapshot, at_start
from taichi_ants.worlds import open_world, paper


def start() -> Snapshot:
    return at_start(paper())


def test_the_start_of_an_episode() -> None:
    world = open_world(3)
    snapshot = at_start(world, seed=5, n=30)
    cells, headings = world.start(5, 30)
    assert (snapshot.ant_cells == cells).all()
    assert (snapshot.ant_headings == headings).all()
    assert not snapshot.ant_carries.any()
    assert (snapshot.ground == world.ground()).all()


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"ground": np.zeros(3, np.uint8)}, "ground"),
        ({"ground": np.zeros(484, np.float32)}, "ground"),
        ({"trail": [1, 2]}, "trail"),
        ({"ant_cells": np.array([-1])}, "ant_cells"),
        ({"ant_cells": np.array([10**6])}, "ant_cells"),
        ({"ant_cells": np.array([0])}, "ant_cells"),  # a void cell
        ({"ant_cells": np.array([1.5])}, "ant_cells"),
        ({"ant_headings": np.array([6])}, "ant_headings"),
        ({"ant_headings": np.array([0, 1])}, "ant_headings"),
        ({"ant_carries": np.array([1])}, "ant_carries"),
    ],
)
def test_what_is_refused(change, named) -> None:
    with pytest.raises(AntsError, match=named):
        Scene(start().grid).draw(dataclasses.replace(start(), **change))


def test_no_ants_at_all() -> None:
    nobody = dataclasses.replace(
        start(),
        ant_cells=np.zeros(0, np.int32),
        ant_headings=np.zeros(0, np.int32),
        ant_carries=np.zeros(0, bool),
    )
    picture = Scene(nobody.grid, (64, 64)).draw(nobody)
    assert (picture != Scene(nobody.grid, (64, 64)).draw(start())).any()
