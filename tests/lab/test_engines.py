"""Kernels and WebAssembly have the same colonies, and the page sees them."""

from typing import Any

import numpy as np
import pytest

from taichi_ants import lab


def row(q: int, r: int, heading: int, n: int, radius: int = 32) -> list[int]:
    """The cells of a straight row in a world of the lab."""
    a, b = lab.STEPS[heading]
    return [(r + b * k + radius) * (2 * radius + 1) + q + a * k + radius for k in range(n)]


def drawn(tick: int, does: str, reach: int, cells: list[int]) -> list[dict[str, Any]]:
    """A stroke of a visitor who draws some cells per tick."""
    parts = [cells[k : k + 3] for k in range(0, len(cells), 3)]
    return [{"tick": tick + k, "do": does, "reach": reach, "path": p} for k, p in enumerate(parts)]


def busy(ticks: int, radius: int = 32, ants: int = 200) -> list[dict[str, Any]]:
    """A visit with each kind of change, at shares of these ticks."""
    when = [ticks * k // 12 for k in range(13)]
    settings = {"epsilon": 0.1, "learns": 0, "shaping": -2, "rate": 0.2, "discount": 0.8}
    return [
        *drawn(when[1], "rock", 1, row(3, -6, 2, 15, radius)),
        {"tick": when[4], "do": "ants", "value": ants},
        *drawn(when[5], "food", 2, row(-7, -7, 0, 2, radius)),
        *drawn(when[6], "scent", 1, row(-5, -5, 1, 9, radius)),
        *({"tick": when[7] + k, "do": n, "value": v} for k, (n, v) in enumerate(settings.items())),
        {"tick": when[9], "do": "learns", "value": 1},
        {"tick": when[9], "do": "level", "value": 300},
        *drawn(when[10], "erase", 1, row(3, -2, 2, 6, radius)),
        {"tick": when[11], "do": "ants", "value": ants - 60},
        {"tick": when[11] + 3, "do": "ants", "value": ants - 50},
    ]


def scene(rules: int, learner: int, **more: Any) -> dict[str, Any]:
    return {"rules": rules, "learner": learner, "level": 600 if rules & 1 else 250, **more}


def test_the_package_replays_a_link(ask):
    visit = ask("visit", scene=scene(15, 0), changes=busy(240), ticks=240)
    replayed = lab.replay(visit["link"])
    assert replayed.hash == visit["hash"] == visit["again"]
    assert not visit["grown"]  # memory, after which no view would be valid
    assert len(visit["link"]) < 500  # characters
    assert replayed.equal
    assert [replayed.tick, replayed.deliveries] == [240, visit["counts"][1]]
    code, tick, told = visit["link"].split(";")
    assert not lab.replay(f"https://example.org/lab.html#{code};{tick};{int(told, 16) ^ 1:x}").equal


# Each rule with one learner; the other pairs take a minute.
PAIRS = [
    pytest.param(rules, n, marks=pytest.mark.slow if n == k % 3 else pytest.mark.long)
    for k, rules in enumerate(lab.RULES)
    for n in range(3)
]


@pytest.mark.parametrize(("rules", "learner"), PAIRS)
def test_kernels_agree(rules, learner, ask):
    more = {"regrowth": -1} if rules == 7 else {"regrowth": 30} if rules == 15 else {}
    visit = ask("visit", scene=scene(rules, learner, **more), changes=busy(900), ticks=900)
    assert lab.replay(visit["link"]).equal


@pytest.mark.slow
@pytest.mark.parametrize(
    ("world", "ants", "ticks"),
    [(1, 1000, 600), pytest.param(2, 10_000, 120, marks=pytest.mark.long), (5, 64, 900)],
)
def test_kernels_agree_about_crowds_and_drawn_worlds(world, ants, ticks, ask):
    radius = lab.WORLDS[world]["radius"]
    for rules in (0, 7, 15):
        first = scene(rules, rules & 1, world=world, ants=ants, seed=2**40 + 20261127)
        changes = busy(ticks, radius, ants - 30)
        visit = ask("visit", scene=first, changes=changes, ticks=ticks)
        assert lab.replay(visit["link"]).equal
        assert visit["counts"][1] > 0 or ants > 1000


def test_a_frame_has_what_the_package_has(ask):
    first = scene(15, 0)
    visit = ask("visit", scene=first, changes=busy(240), ticks=240)
    colony = lab.played(*lab.decoded(visit["link"].split(";")[0]), 240)
    slots = np.argsort(colony.numbers[0, : len(visit["cells"])])
    assert visit["cells"] == colony.cells[0, slots].tolist()
    assert visit["headings"] == colony.headings[0, slots].tolist()
    looks = np.array(visit["looks"])
    assert np.array_equal(looks & 1, colony.carrying[0, slots])
    assert np.array_equal(looks >> 4, colony.actions[0, slots])
    delivered = np.count_nonzero(looks >> 1 & 7 == 4)
    assert delivered == np.count_nonzero(colony.events[0, slots] == 5)
    assert visit["ground"] == (colony._part("ground", 0) & 15).tolist()
    stored, clock = colony._stored_pheromone(0, 0)
    levels = np.clip(stored - clock, 0, None)
    shown = np.where(levels >= 300, 255, (levels > 0) * (1 + levels * 254 // 300))
    assert visit["levels"] == shown.tolist()
    steps = np.array(visit["cells"]) - visit["before"]
    assert set(steps.tolist()) <= {0, *colony.grid.offsets.tolist()}
    assert len(set(steps.tolist())) == 7


@pytest.mark.parametrize("learner", range(3))
def test_a_mind_says_what_its_ant_does_next(learner, ask):
    for rules in (0, 3, 7, 15):
        found = ask("minds", scene=scene(rules, learner, epsilon=0.2, ants=90), ticks=80)
        assert found == {"right": 90 * 80, "wrong": 0}
