"""What holds after every tick of any colony: food is conserved, no two ants share a cell."""

from collections import Counter

from colonies import foods_of
from random_choices import NO_NOISE, NOISE
from random_colonies import random_colony, with_nests

from taichi_ants.reference import ReferenceColony
from taichi_ants.reference.geometry import distance, neighbour
from taichi_ants.task.constants import EMPTY, PICK_UP, Event

TICKS = 40


def slots_of(drawn):
    ants = drawn.population["ants"]
    return drawn.population["capacity"] or (2 * ants + 64 if drawn.task.life.births else ants)


def loads_of(colony):
    """The loads in cells and of ants."""
    in_cells = sum(colony.world.of_cells[cell]["loads"] for cell in foods_of(colony))
    return in_cells + sum(ant.carries for ant in colony.ants.values())


def food_is_conserved(drawn, colony, start):
    record = colony.record
    assert loads_of(colony) + record.deliveries == start + record.regrown
    if drawn.task.life.births:
        assert record.births + sum(colony.stores) == record.deliveries
    else:
        assert record.births == 0


def ants_deliver_to_their_own_queen(colony):
    for ant in colony.ants.values():
        if ant.event is Event.DELIVERED:
            assert distance(ant.cell, colony.world.queens[ant.nest]) == 1


def ants_stand_alone_on_empty_cells(drawn, colony):
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


def homes_that_are_full_hold_food(colony):
    full = [
        source.cell for source in colony.food_sources.food_sources if source.waiting_since is None
    ]
    assert len(set(full)) == len(full)
    assert set(full) <= foods_of(colony)


def of_those_that_want_a_free_cell_exactly_one_gets_it(colony, before):
    """Without noise: `before` has the cells and headings before the tick."""
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


def test_after_every_tick():
    """All properties, in 72 colonies, twelve with noise, some with two nests; and much happens."""
    total, losses = Counter(), 0
    counted = ("deliveries", "moves", "blocked", "births", "deaths", "regrown")
    for seed, noise in [*((k, NO_NOISE) for k in range(60)), *((k, NOISE) for k in range(12))]:
        drawn = random_colony(seed, noise=noise)
        if seed % 4 == 3:
            drawn = with_nests(drawn, seed, 2, 2, loads=True)
        colony = ReferenceColony(*drawn.model, **drawn.options)
        for _ in range(1 + (seed < 12)):
            colony.begin_episode()
            start = loads_of(colony)
            while not colony.over and colony.record.ticks < TICKS:
                before = {slot: (ant.cell, ant.heading) for slot, ant in colony.ants.items()}
                colony.tick()
                food_is_conserved(drawn, colony, start)
                ants_deliver_to_their_own_queen(colony)
                ants_stand_alone_on_empty_cells(drawn, colony)
                homes_that_are_full_hold_food(colony)
                if noise == NO_NOISE:
                    of_those_that_want_a_free_cell_exactly_one_gets_it(colony, before)
            colony.end_episode()
            total.update({name: getattr(colony.record, name) for name in counted})
            losses += colony.record.blocked > 0
    assert losses > 20
    assert min(total[name] for name in ("deliveries", "births", "deaths", "regrown")) > 25, total
