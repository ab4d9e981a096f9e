"""The study of the double bridge: crossings, designs, and shares from known counts."""

from pathlib import Path
from unittest.mock import Mock

import bridge_report
import numpy as np
import pytest
from bridge import crossings, point, task
from bridge_report import BRIDGES, CASES, LATE, WINDOWS, Case, late_shares
from PIL import Image

from taichi_ants import AntsError, Colony, TrainingConfig
from taichi_ants.learners.policies import trail_follower
from taichi_ants.studies.points import ColonyPoint
from taichi_ants.worlds.double_bridge import bridge_paths, double_bridge

TICKS = 100
BRIDGE = {"short": 10, "long": 13, "mirrored": True, "aside": 1}


class Scripted:
    """A colony of ants that stand where a script says: (place, load) of each ant by tick."""

    def __init__(self, script: list[dict[int, tuple[str, int]]]) -> None:
        grid, ((nest, food), branches) = double_bridge(**BRIDGE).grid, bridge_paths(**BRIDGE)
        short, long = (cells[len(cells) // 4] for cells in branches)
        places = {"nest": nest, "food": food, "short": short, "long": long}
        self.places = {name: int(grid.index(cell)) for name, cell in places.items()}
        assert len(set(self.places.values())) == 4
        self.script, self.seeds, self.ticks = script, (7, 8), 0
        self.capacity = len(script) // 2
        self.cells = np.zeros((2, self.capacity), np.int32)
        self.carrying = np.zeros((2, self.capacity), bool)

    def begin_episode(self, length: int) -> None:
        self.ticks = 0
        self._place()

    def tick(self, n: int) -> None:
        self.ticks += n
        self._place()

    def _place(self) -> None:
        for ant, moments in enumerate(self.script):
            name, load = moments[max(tick for tick in moments if tick <= self.ticks)]
            self.cells.flat[ant], self.carrying.flat[ant] = self.places[name], load


def test_an_ant_crosses_when_it_comes_to_the_other_room_by_its_last_branch() -> None:
    there_and_back = {
        **{0: ("nest", 0), 8: ("short", 0), 20: ("food", 0)},
        **{40: ("long", 1), 60: ("short", 1), 72: ("long", 1), 80: ("nest", 1)},
    }
    turns_round = {0: ("nest", 0), 20: ("long", 0), 40: ("nest", 0), 60: ("long", 0)}
    without_food = {0: ("nest", 0), 4: ("long", 0), 24: ("food", 0), 48: ("short", 0)}
    without_food[88] = ("nest", 0)
    with_food = {0: ("nest", 1), 8: ("short", 1), 20: ("food", 1), 48: ("short", 0)}
    colony = Scripted([there_and_back, turns_round, without_food, with_food])
    found = crossings(colony, BRIDGE, TICKS)
    assert found.shape == (WINDOWS, 2, 2, 2)
    # Window, load, branch, world: only useful crossings count.
    counted = [tuple(one) for one in np.argwhere(found).tolist()]
    assert counted == [(1, 0, 0, 0), (2, 0, 1, 1), (7, 1, 1, 0)]
    assert found.sum() == 3


@pytest.mark.parametrize("opens", [0, 301])
def test_nobody_takes_the_short_branch_before_it_opens(opens: int) -> None:
    place, ticks = double_bridge(**BRIDGE), 602
    training = TrainingConfig("sarsa", 0.1, 0.9, epsilon=0.02, epsilon_decay=1.0)
    follow = {"sharing": "frozen", "q_values": trail_follower("queues"), "schedule": "by_world"}
    colony = Colony(place, task(Case()), training, [3], 12, **follow)
    found = crossings(colony, BRIDGE, ticks, opens)
    before, after = found[: WINDOWS // 2].sum(axis=(0, 1, 3)), found[5:].sum(axis=(0, 1, 3))
    assert colony.ticks == ticks
    assert after[0] > 10
    assert (before[0] == 0) == (opens > 0)
    if opens:
        assert before[1] > 10
    short = place.grid.index(bridge_paths(**BRIDGE)[1][0])
    assert not (colony.arrays["walls"][short]).any()


def test_colonies_learn_where_the_short_branch_lies_on_either_side(monkeypatch) -> None:
    one = point(Case(), episodes=60, ticks=10)
    assert one.pool == (double_bridge(aside=1), double_bridge(mirrored=True, aside=1))
    colony = Mock()  # notes the worlds in which it would learn
    monkeypatch.setattr(ColonyPoint, "colony", lambda *_, **__: colony)
    one.tables(range(20), None, None, {})
    worlds = colony.run.call_args.args[3]
    assert 0.4 < np.mean([[world is one.pool[0] for world in each] for each in worlds]) < 0.6
    assert one.training.initial_q > 0
    assert one.training.next_epsilon(one.training.epsilon) < one.training.epsilon


SEEDS = (3, 4, 5)


def counts(seeds: int) -> dict:
    """Each colony sends 3 foragers of 4 and 9 carriers of 10 by the short branch, but the last."""
    crossed = np.zeros((WINDOWS, 2, 2, seeds), np.int64)
    crossed[:, 0] = [[3], [1]]
    crossed[:, 1] = [[9], [1]]
    crossed[..., -1] = 0
    return {design: dict.fromkeys(BRIDGES, crossed) for design in CASES}


@pytest.fixture
def found() -> dict:
    return counts(len(SEEDS))


def test_late_shares_are_of_the_second_half(found: dict) -> None:
    crossed = found[Case()][BRIDGES[0]].copy()
    crossed[: WINDOWS // 2, :, 0] = 1000
    shares = late_shares(crossed)
    np.testing.assert_allclose(shares[:, :2], [[0.75] * 2, [0.9] * 2])
    assert np.isnan(shares[:, 2]).all()


def test_few_seeds_give_no_intervals_and_the_report_says_how_many(found: dict) -> None:
    """Nor do ten of which some had no crossing."""
    text = repr(bridge_report.tables(found, 3000))
    assert text.lower().count("3 seeds, too few for") == 3  # a table each
    for crossed in (found, counts(10)):
        rows = [row for one in bridge_report.tables(crossed, 3000).values() for row in one.rows]
        assert "[" not in "".join(cell for row in rows for cell in row)
    assert len(bridge_report.tables(found, 3000)["settings"].rows) == 13


def test_shares_after_a_late_opening() -> None:
    """Foragers by the short branch: nobody before, 10, 30, 50, 70, 90 % after, in 11 colonies."""
    crossed = np.zeros((WINDOWS, 2, 2, 12), np.int64)
    crossed[:5, :, 1] = 9
    crossed[5:, 0, 0] = np.array([1, 3, 5, 7, 9])[:, None]
    crossed[5:, 0, 1] = 10 - crossed[5:, 0, 0]
    crossed[:, 0, :, 0] = crossed[:, 0, ::-1, 0]  # this one ends with 10 %
    crossed[:, :, :, -1] = 0
    late = bridge_report.tables({Case(): {LATE: crossed}}, 3000)["late"]
    (foragers,) = [row for row in late.rows if row[3] == "foragers"]
    *means, last, colonies = foragers[4:]
    assert means == ["17", "34", "50", "66"]
    mean, low, high = last.split()
    assert float(low[1:-1]) < float(mean) == 83 < float(high[:-1])
    assert colonies == "10 of 11"
    assert "opens after 3000 ticks" in late.title


def test_colonies_in_which_nobody_crosses_are_left_out_of_the_figure(
    found: dict, tmp_path: Path
) -> None:
    path = tmp_path / "bridge.png"
    for draw in (bridge_report.draw, bridge_report.draw_late):
        draw(path, found, 3000)
        with Image.open(path) as image:
            assert np.asarray(image.convert("RGB")).std() > 5
        with pytest.raises(AntsError):
            draw(path / "bridge.png", found, 3000)  # bridge.png is no folder, but a file
