"""Comparison of a colony with its plain reference."""

from collections.abc import Iterator

import numpy as np
from plain_interventions import Protocol

from taichi_ants import Colony, World, features
from taichi_ants.engines.colony.layout import FoodSourceRow, NestRow, WorldRow
from taichi_ants.engines.colony.timetable import Timetable
from taichi_ants.features.feature import ANT, CELL, NEST
from taichi_ants.protocol import ProtocolEvent
from taichi_ants.reference import ReferenceColony
from taichi_ants.task.constants import FOOD


def every_tick(
    colony: Colony, plain: ReferenceColony, *episodes: tuple[int, World | None]
) -> Iterator[None]:
    """Yield after each tick of episodes (ticks, world), in which a colony equals the reference."""
    for ticks, world in episodes:
        colony.begin_episode(ticks, world)
        plain.begin_episode(world)
        assert_equal(colony, plain)
        for tick in range(ticks):
            if not plain.over:
                colony.tick()
                plain.tick(last=tick == ticks - 1)
                assert_equal(colony, plain)
                yield
        colony.end_episode()
        plain.end_episode()


def every_tick_of_protocol(
    colony: Colony, protocol: list[ProtocolEvent], plains: list[ReferenceColony], ticks: int
) -> Iterator[None]:
    """Yield after each tick of two episodes, in which each world equals a reference colony."""
    timetable, twins = Timetable(colony, protocol, ticks), [Protocol(p, protocol) for p in plains]
    for _ in range(2):
        colony.begin_episode(ticks)
        for twin in twins:
            twin.begin_episode()
        with timetable:
            for tick in range(ticks):
                for _ in timetable.pieces(Colony._pieces, 1):
                    pass
                for w, (plain, twin) in enumerate(zip(plains, twins, strict=True)):
                    twin.before_tick()
                    plain.tick(last=tick == ticks - 1)
                    assert_equal(colony, plain, w)
                yield
        colony.end_episode()
        for twin in twins:
            twin.end_episode()


def assert_equal(colony: Colony, plain: ReferenceColony, world: int = 0) -> None:
    """Assert that world number `world` of a colony equals the reference, between two ticks."""
    ours = colony.snapshot(world)
    grid, arrays = ours.grid, colony.arrays
    of_world = slice(world * colony.capacity, (world + 1) * colony.capacity)
    (slots,) = np.nonzero(colony.living[world])
    assert slots.tolist() == sorted(plain.ants)
    theirs = [plain.ants[slot] for slot in slots.tolist()]
    mine = {name: arrays[name][of_world][slots].tolist() for name in colony._columns()}
    assert grid.cells(colony.cells[world, slots]).tolist() == [list(ant.cell) for ant in theirs]
    for name in ("heading", "carries", "number", "paper_state", "action", "event"):
        assert mine[name] == [getattr(ant, name) for ant in theirs], name
    assert mine["streams"] == [ant.stream.state for ant in theirs]
    for name in ("state", "nest", "caste"):
        column = getattr(colony, f"{name}s")[world, slots]
        assert column.tolist() == [getattr(ant, name) for ant in theirs], name
    for _, array in features.arrays(ANT):
        column = getattr(colony, array.view)[world, slots]
        of_ants = [ant.own.get(array.name, getattr(ant, array.name, 0)) for ant in theirs]
        expected = np.array(of_ants, column.dtype)
        assert np.array_equal(column, expected), array.name
    executed, rewards = colony.executed[world, slots], colony.rewards[world, slots]
    for action, reward, ant in zip(executed.tolist(), rewards.tolist(), theirs, strict=True):
        assert ant.action < 0 or (action, reward) == (ant.executed, ant.reward)
    existing = np.array(list(plain.world.ground), dtype=np.int64).reshape(-1, 3)
    places = grid.index(existing)
    assert ours.ground[places].tolist() == list(plain.world.ground.values())
    ants = {ant.number: ant for ant in theirs}
    in_order = [ants[number] for number in ours.ant_numbers.tolist()]
    assert ours.ant_nests.tolist() == [ant.nest for ant in in_order]
    kinds = [ant.own["kind"] if ant.carries else -1 for ant in in_order]
    assert ours.ant_foods.tolist() == kinds
    assert ours.queens.tolist() == [int(grid.index(cell)) for cell in plain.world.queens]
    food = np.flatnonzero(ours.ground == FOOD)
    at = world * grid.size + food
    their_foods = [tuple(cell) for cell in grid.cells(food).tolist()]
    kinds = [plain.world.of_cells[cell]["kind_of"] for cell in their_foods]
    assert ours.food_kinds[food].tolist() == kinds
    for feature, array in features.arrays(CELL):
        if feature.is_used(colony.task):
            held = [plain.world.of_cells[cell][array.name] for cell in their_foods]
            assert arrays[array.name][at].tolist() == held, array.name
    levels = np.array([plain.world.trail.level(cell) for cell in plain.world.ground])
    assert np.array_equal(ours.trail[places], levels.astype(ours.trail.dtype))
    assert list(ours.fields) == [*plain.world.pheromones]
    for name, field in ours.fields.items():
        levels = np.array([plain.world.pheromones[name].level(cell) for cell in plain.world.ground])
        assert np.array_equal(field[places], levels.astype(field.dtype)), name
    assert np.array_equal(colony.q_values[world], plain.q_values)
    assert int(arrays["queen_streams"][world]) == plain.queen_stream.state
    _assert_equal_records(colony, plain, world)


def _assert_equal_records(colony: Colony, plain: ReferenceColony, world: int) -> None:
    """Compare the episode's counters, the store, the food sources, and the size of the model."""
    outcome, record, row = colony.outcome(), plain.record, colony.arrays["worlds"][:, world]
    assert outcome.returns[0, world] == record.episode_return
    names = ("ticks", "deliveries", "first_delivery", "moves", "blocked", "births", "deaths")
    for name in (*names, "carried"):
        assert getattr(outcome, name)[0, world] == getattr(record, name), name
    assert outcome.regrown[0, world] == record.regrown
    stores = colony.arrays["nests"][NestRow.STORE].reshape(-1, colony.n_nests)[world]
    assert stores.tolist() == plain.stores
    apart = outcome.deliveries_by_nest_and_kind[0, world]
    assert {(int(n), int(k)): int(apart[n, k]) for n, k in np.argwhere(apart)} == record.delivered
    by_caste = dict(enumerate(outcome.caste_deliveries[0, world].tolist()))
    assert {caste: n for caste, n in by_caste.items() if n} == record.by_caste
    for _, array in features.arrays(NEST):
        of_nests = [values.get(array.name, 0.0) for values in plain.world.of_nests]
        assert getattr(colony, array.view)[world].tolist() == of_nests, array.name
    first = world * colony.n_food_sources
    food_sources = colony.arrays["food_sources"][:, first : first + row[WorldRow.FOOD_SOURCES]]
    theirs = plain.food_sources.food_sources[: food_sources.shape[1]]
    assert food_sources[FoodSourceRow.TAKEN].tolist() == [
        -1 if source.waiting_since is None else source.waiting_since for source in theirs
    ]
    cells = colony.grid.cells(food_sources[FoodSourceRow.CELL]).tolist()
    assert cells == [list(source.cell) for source in theirs]
    assert food_sources[FoodSourceRow.KIND].tolist() == [source.kind for source in theirs]
    if colony.sharing == "shared" and colony.training.learner == "dyna_q":
        assert colony.arrays["integers"][0] == len(plain.learners[0].model)
