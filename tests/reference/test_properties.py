"""What holds after every tick of any colony: food is conserved, no two ants share a cell."""

from __future__ import annotations

from collections import Counter

import numpy as np
from colonies import foods_of
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_runs import run
from random_choices import NO_NOISE, NOISE
from random_colonies import random_colony

from taichi_ants.reference import ReferenceColony
from taichi_ants.reference.geometry import neighbour
from taichi_ants.task.constants import EMPTY, PICK_UP

SEEDS = st.integers(0, 2**32 - 1)
TICKS = 40


def made(drawn):
    return ReferenceColony(
        drawn.world,
        drawn.task,
        drawn.training,
        drawn.seed,
        **drawn.population,
        sharing=drawn.sharing,
        q_values=drawn.q_values,
    )


def slots_of(drawn):
    ants = drawn.population["ants"]
    return drawn.population["capacity"] or (2 * ants + 64 if drawn.task.life.births else ants)


def colonies_of(seed, ticks=TICKS, episodes=2, noise=NO_NOISE):
    """Yield the colony of a seed after each tick, and the cells and headings before it."""
    drawn = random_colony(seed, noise=noise)
    colony = made(drawn)
    for _ in range(episodes):
        colony.begin_episode()
        while not colony.over and colony.record.ticks < ticks:
            before = {slot: (ant.cell, ant.heading) for slot, ant in colony.ants.items()}
            colony.tick()
            yield drawn, colony, before
        colony.end_episode()


@given(SEEDS)
@settings(max_examples=30, deadline=None, derandomize=True)
def test_food_is_conserved(seed):
    for drawn, colony, _ in colonies_of(seed, noise=NOISE if seed % 2 else NO_NOISE):
        carried = sum(ant.carries for ant in colony.ants.values())
        record = colony.record
        there = len(foods_of(colony)) + carried + record.deliveries
        assert there == len(drawn.world.foods) + record.regrown
        if drawn.task.life.births:
            assert record.births + sum(colony.stores) == record.deliveries
        else:
            assert record.births == 0


@given(SEEDS)
@settings(max_examples=30, deadline=None, derandomize=True)
def test_ants_stand_alone_on_empty_cells(seed):
    for drawn, colony, _ in colonies_of(seed, noise=NOISE if seed % 2 else NO_NOISE):
        cells = [ant.cell for ant in colony.ants.values()]
        assert len(set(cells)) == len(cells)
        assert set(cells) == set(colony.world.ants)
        assert all(colony.world.ground[cell] == EMPTY for cell in cells)
        record = colony.record
        assert len(cells) == drawn.population["ants"] + record.births - record.deaths
        slots = slots_of(drawn)
        assert len(cells) <= slots
        assert max(colony.ants, default=0) < slots
        numbers = [ant.number for ant in colony.ants.values()]
        assert len(set(numbers)) == len(numbers)


@given(SEEDS)
@settings(max_examples=30, deadline=None, derandomize=True)
def test_of_those_that_want_a_free_cell_exactly_one_gets_it(seed):
    for _, colony, before in colonies_of(seed, episodes=1):
        wanting, getting = Counter(), Counter()
        for step in colony.transitions:
            code = [step.state >> 4 & 3, step.state >> 2 & 3, step.state & 3, 1, 1][step.action]
            if step.action >= PICK_UP or code not in (0, 2):
                continue
            cell, heading = before[step.slot]
            target = neighbour(cell, heading + step.action - 1)
            assert target not in {cell for cell, _ in before.values()}
            wanting[target] += 1
            getting[target] += step.reward >= 0
        assert getting == Counter(dict.fromkeys(wanting, 1))


@given(SEEDS)
@settings(max_examples=20, deadline=None, derandomize=True)
def test_homes_that_are_full_hold_food(seed):
    for _, colony, _ in colonies_of(seed):
        full = [
            source.cell
            for source in colony.food_sources.food_sources
            if source.waiting_since is None
        ]
        assert len(set(full)) == len(full)
        assert set(full) <= foods_of(colony)


@given(SEEDS)
@settings(max_examples=20, deadline=None, derandomize=True)
def test_a_run_depends_on_its_seed_alone(seed):
    runs = []
    for _ in range(2):
        colony = made(random_colony(seed))
        run(colony, 2, 30)
        runs.append(colony)
    first, second = runs
    assert first.records == second.records
    assert first.ants == second.ants
    assert first.queen_stream == second.queen_stream
    np.testing.assert_array_equal(first.q_values, second.q_values)


def test_the_colonies_drawn_here_do_everything():
    """So that the properties above are not true for want of deeds."""
    total, losses = Counter(), 0
    for seed in range(60):
        for _, colony, _ in colonies_of(seed, episodes=1):
            last = colony.record
        total.update(
            {
                name: getattr(last, name)
                for name in ("deliveries", "moves", "blocked", "births", "deaths", "regrown")
            }
        )
        losses += last.blocked > 0
    assert losses > 20
    assert min(total[name] for name in ("deliveries", "births", "deaths", "regrown")) > 25
