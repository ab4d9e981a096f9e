"""Ants can rest with food, and after drawing their next action; no built-in feature does so."""

from same_colonies import every_tick

from taichi_ants import Colony, TrainingConfig, worlds
from taichi_ants.engines.colony import kernels
from taichi_ants.features.labour import LABOUR
from taichi_ants.kernel_functions import bits, kernel_function, ti
from taichi_ants.reference import ReferenceColony
from taichi_ants.reference.features import labour as twin
from taichi_ants.task import foraging

CASTES = {"all": {"threshold": {"distribution": "fixed", "value": 5.0}}}
TASK = foraging().replace(delivery="truncates", labour={"rule": "thresholds"}, castes=CASTES)


def doze(a, stream):
    """Rest in half of all ticks, whatever the ant is doing."""
    after = bits.advance(stream)
    rests = ti.cast(bits.high_word(bits.bits_of(after)) < ti.u64(2**31), ti.i32)
    a.idle = ti.cast(rests, ti.i8)
    return rests, after


def plain_doze(colony, ant):
    high, _ = ant.stream.draw()
    ant.own["idle"] = high < 2**31
    return ant.own["idle"]


def test_a_resting_ant_keeps_its_food_and_drops_its_next_action(monkeypatch):
    monkeypatch.setitem(LABOUR.hooks, "choose", kernel_function(doze))
    monkeypatch.setattr(twin, "choose", plain_doze)
    monkeypatch.setattr(kernels, "variant", kernels.Variant)  # the cache knows the true hook
    training = TrainingConfig("sarsa", 0.1, 0.9, 0.5, 1.0)
    world = worlds.open_world(3, (6, 6, 6))
    model, options = (world, TASK, training), {"seeds": 3, "ants": 12}
    colony, plain = Colony(*model, **options), ReferenceColony(*model, 3, 12)
    rested = 0
    for _ in every_tick(colony, plain, (150, None)):
        rested += sum(ant.own["idle"] and ant.carries for ant in plain.ants.values())
    assert rested > 20
    assert plain.records[0].deliveries > 3
