"""Edits: colony and reference stay equal to the bit, whatever the interventions; what is wrong
changes nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plain_interventions import Interventions as PlainInterventions
from random_choices import NO_NOISE, NOISE
from random_colonies import random_colony
from random_edits import apply_to_both, random_edit
from same_colonies import assert_equal

from taichi_ants import AntsError, Colony, TrainingConfig, worlds
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.engines.colony.layout import NestRow, Stage, WorldRow
from taichi_ants.interventions import Place
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import foraging
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

# Each entry needs its own kernels, see tests/engines/colony/test_against_reference.py.
KERNELS = [
    ("sarsa", "shared", "ants", False, "right_of_way", "strongest", "ab", ("trail", "b")),
    ("q_learning", "frozen", "queues", False, "following", "strongest_under_carriers"),
    ("double_q", "independent", "ants_seen", True, "blocking", "half", "aB", ("a", "B")),
    ("dyna_q", "shared", "trail_levels", True, "blocking", "half"),
    ("n_step_sarsa", "independent", "paper", False, "blocking", "half"),
]
TRAINING = TrainingConfig("sarsa", 0.2, 0.9, 0.4, 0.9)
MARKED = [pytest.param(one, marks=[pytest.mark.long] * (k > 0)) for k, one in enumerate(KERNELS)]


def assert_sound(interventions: Interventions) -> None:
    """What holds in every colony at the end of a tick."""
    colony = interventions.colony
    arrays, world = colony.arrays, colony.arrays["worlds"][:, 0]
    taken = arrays["stage"] != Stage.VACANT
    cells, numbers = arrays["cell"][taken], arrays["number"][taken]
    assert (arrays["stage"][taken] == Stage.LIVING).all()
    assert len(set(cells.tolist())) == len(set(numbers.tolist())) == world[WorldRow.LIVING]
    assert numbers.max(initial=-1) < world[WorldRow.NEXT_NUMBER]
    assert (np.flatnonzero(arrays["ground"] > 15) == np.sort(cells)).all()
    bare = colony.snapshot().ground
    assert (arrays["walls"] == (bare == OBSTACLE)).all()
    queens = colony.arrays["nests"][NestRow.QUEEN_CELL].tolist()
    assert np.flatnonzero(bare == QUEEN).tolist() == queens
    assert colony.snapshot().trail[bare == OBSTACLE].sum() == 0
    later = interventions.world()
    assert (later.closer() == arrays["closer"]).all()
    assert np.count_nonzero(later.ground() == EMPTY) >= interventions.ants


@pytest.mark.parametrize("kernel", MARKED, ids=lambda kernel: "-".join(map(str, kernel[:4])))
def test_edits_keep_colony_and_reference_equal(kernel):
    learner, sharing, observation, dense, traffic, view, *fields = kernel
    done, refused = {}, 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        drawn = random_colony(
            *(seed, 12, sharing, 5, None, learner, observation, dense),
            traffic=traffic,
            view=view,
            changes=True,
            choice="softmax" if learner == "q_learning" else "greedy",
            noise=NOISE if learner == "q_learning" else NO_NOISE,
            **dict(zip(("fields", "cues"), fields, strict=False)),
        )
        population = {**drawn.population, "ends_at_delivery": False}
        population["capacity"] = population["ants"] + int(rng.integers(0, 9))
        rules = {**population, "sharing": sharing, "q_values": drawn.q_values}
        task = replace(drawn.task, **{f"evaporation_in_{one}": bool(rng.random() < 0.7)
                                      for one in ("training", "evaluation")})  # fmt: skip
        given = (drawn.world, task, drawn.training, drawn.seed)
        try:
            colony = Colony(*given, **rules)
        except AntsError:
            continue
        plain = ReferenceColony(*given, **rules)
        colony.begin_episode()
        plain.begin_episode()
        interventions, twin = Interventions(colony), PlainInterventions(plain)
        for _ in range(30):
            edit = random_edit(rng, interventions)
            before = interventions.state()
            try:
                twin = apply_to_both(edit, interventions, twin)
                (kind,) = edit
                done[kind] = done.get(kind, 0) + 1
            except AntsError as error:
                refused += 1
                assert (interventions.state(), str(error)[-1]) == (before, "."), edit  # noqa: PT017
            assert_equal(colony, plain)
            assert_sound(interventions)
            for _ in range(int(rng.integers(0, 3))):
                colony.tick()
                plain.tick()
                assert_equal(colony, plain)
    assert done.keys() >= {"place", "clear", "trail", "add_ants", "remove_ants", "episode"}
    assert min(done.values()) > 1, done
    assert refused > 3


@pytest.mark.parametrize(("what", "content"), [("rock", OBSTACLE), ("food", FOOD)])
def test_a_wall_across_a_road_of_ants_has_no_hole(what, content):
    """Ants in the way are moved aside, to the nearest empty cells; nothing else of them changes."""
    colony = Colony(worlds.paper(), foraging(), TRAINING, 2, ants=40)
    colony.begin_episode()
    colony.tick(200)
    interventions, before = (
        Interventions(colony),
        {name: colony.arrays[name].copy() for name in colony._columns()},
    )
    cells = np.sort(before["cell"])[::2]
    interventions.apply(Place(what, cells.tolist()))
    assert (colony.snapshot().ground[cells] == content).all()
    for name in before.keys() - {"cell", "state", "paper_state"}:
        assert np.array_equal(colony.arrays[name], before[name]), name
    moved = before["cell"] != colony.arrays["cell"]
    assert np.array_equal(moved, np.isin(before["cell"], cells))
    assert_sound(interventions)


def test_an_ant_without_room_stays_where_it_is():
    colony = Colony(worlds.from_text("Q   0   F\n"), foraging(), TRAINING, ants=1)
    colony.begin_episode()
    interventions, (cell,) = Interventions(colony), colony.snapshot().ant_cells
    interventions.apply(Place("rock", [cell]))
    assert colony.snapshot().ground[cell] == EMPTY
    assert colony.snapshot().ant_cells.tolist() == [cell]
