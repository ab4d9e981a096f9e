"""Learning made visible, the policy sheet, and colonies."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest
from named_states import parse_state
from PIL import Image

from taichi_ants import AntsError, Colony, TrainingConfig, World, train
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.rendering import (
    Checkpoint,
    Episode,
    colony_snapshots,
    frames,
    learning_checkpoints,
    learning_frames,
    policy_sheet,
    save_animation,
    text,
    typical_seed,
)
from taichi_ants.rendering.colours import CELL_FOOD, CHOSEN
from taichi_ants.rendering.scene import PAPER
from taichi_ants.rendering.sheet import clarity, learned, usual_spread
from taichi_ants.task import Caste, Life, Observation, Rewards, Task, observations
from taichi_ants.task.constants import ACTION_NAMES, PICK_UP, RIGHT
from taichi_ants.task.states import REACHABLE_STATES
from taichi_ants.worlds import open_world, paper

CONFIG = TrainingConfig("sarsa", 0.01, 0.9, 0.5, 0.995)


def coloured(picture: np.ndarray, colour: int) -> np.ndarray:
    return (picture == (colour >> 16, colour >> 8 & 255, colour & 255)).all(axis=2)


def test_stages_are_those_of_one_training() -> None:
    checkpoints = learning_checkpoints(
        paper(), CONFIG, seed=2, checkpoints=(0, 3, 20), max_steps=60
    )
    assert [checkpoint.episodes for checkpoint in checkpoints] == [0, 3, 20]
    assert [checkpoint.title for checkpoint in checkpoints] == [
        "before learning",
        "after 3 episodes",
        "after 20 episodes",
    ]
    for checkpoint in checkpoints:
        table = np.zeros((128, 5), dtype=np.float32)
        if checkpoint.episodes:
            table = train(paper(), CONFIG, 2, checkpoint.episodes).q_values[0, 0]
        trace = checkpoint.episode.trace
        assert (trace.q_values == table[trace.states]).all()
        assert len(trace) <= 60


def test_the_account_says_where_the_return_comes_from() -> None:
    """The shortest delivery earns 16 on the trail, 16 on the way back, 3 for the food and 10."""
    follower = Checkpoint(500, Episode.play(paper(), trail_follower()))
    account = follower.account()
    assert account[-1].tolist() == [16, 16, 3, 10, 0]
    assert account[0].tolist() == [0] * 5
    for seed, checkpoints in ((2, (0, 10)), (7, (10, 30))):
        for checkpoint in learning_checkpoints(
            paper(), CONFIG, seed=seed, checkpoints=checkpoints, max_steps=80
        ):
            returns = np.concatenate([[0], checkpoint.episode.trace.rewards.cumsum()])
            assert (checkpoint.account().sum(axis=1) == returns).all()
            assert (checkpoint.account()[:, :4] >= 0).all()
            assert (checkpoint.account()[:, 4] <= 0).all()


def test_the_typical_seed_is_the_one_nearest_to_the_middle_rank_at_every_stage() -> None:
    seeds, checkpoints, steps = (3, 14, 15, 92, 65, 35, 89, 79), (0, 1, 3), 80
    chosen, deliver = typical_seed(
        paper(), CONFIG, seeds=seeds, checkpoints=checkpoints, max_steps=steps
    )
    played = {
        seed: learning_checkpoints(
            paper(), CONFIG, seed=seed, checkpoints=checkpoints, max_steps=steps
        )
        for seed in seeds
    }
    for n, told in enumerate(deliver):
        assert told == sum(several[n].episode.delivered for several in played.values())
    assert deliver[0] < deliver[-1]

    def values(seed: int) -> list[int]:
        traces = [checkpoint.episode.trace for checkpoint in played[seed]]
        return [one for trace in traces for one in (int(trace.rewards.sum()), len(trace))]

    def farthest(seed: int) -> int:
        own = values(seed)
        return max(
            abs(sum((a > b) - (a < b) for b in others))
            for a, *others in zip(own, *map(values, seeds), strict=True)
        )

    assert chosen == min(seeds, key=farthest)


@pytest.mark.parametrize("checkpoints", [(), (3, 2), (0, 5, 5), (-1, 5)])
def test_stages_that_are_refused(checkpoints) -> None:
    for function in (learning_checkpoints, typical_seed):
        with pytest.raises(AntsError, match="checkpoints"):
            function(paper(), CONFIG, checkpoints=checkpoints)


def test_stages_of_several_worlds_are_refused() -> None:
    checkpoints = [
        Checkpoint(1, Episode.play(world, trail_follower())) for world in (paper(), open_world(3))
    ]
    with pytest.raises(AntsError, match="in 2 worlds; give checkpoints of one"):
        next(learning_frames(checkpoints))


def test_a_stage_that_has_ended_stays() -> None:
    checkpoints = learning_checkpoints(paper(), CONFIG, seed=2, checkpoints=(0, 50), max_steps=60)
    short, long = sorted(checkpoints, key=lambda checkpoint: len(checkpoint.episode))
    assert len(short.episode) < len(long.episode) == 61
    frames = list(learning_frames(checkpoints, (640, 400), "a title"))
    assert len(frames) == 61
    halves = [(frame[:, :320], frame[:, 320:]) for frame in frames]
    ended = checkpoints.index(short)
    last = len(short.episode) - 1
    assert all((half[ended] == halves[last][ended]).all() for half in halves[last:])
    assert not (halves[last - 1][ended] == halves[last][ended]).all()
    assert not (halves[-1][1 - ended] == halves[last][1 - ended]).all()


@pytest.mark.parametrize("size", [(1280, 720), (400, 900), (64, 64), (4096, 200)])
def test_all_stages_fit(size, tmp_path) -> None:
    checkpoints = learning_checkpoints(paper(), CONFIG, checkpoints=(0, 1, 2, 3), max_steps=3)
    save_animation(tmp_path / "a.gif", learning_frames(checkpoints, size), 10)
    with Image.open(tmp_path / "a.gif") as image:
        assert image.size == size
        picture = np.asarray(image.convert("RGB")).astype(int)
    # The columns and the rows of worlds, told by their queens; there is one in the legend too.
    letters = round(min(size[0] / 60, size[1] / 26))
    picture = picture[: size[1] - round(2.6 * letters) * (letters >= text.SMALLEST)]
    purple = (picture[..., 0] - picture[..., 1] > 90) & (picture[..., 2] - picture[..., 1] > 90)
    groups = [(np.diff(np.flatnonzero(purple.any(axis=axis))) > 8).sum() + 1 for axis in (0, 1)]
    assert groups == {(1280, 720): [4, 1], (400, 900): [2, 2], (64, 64): [2, 2]}.get(size, [4, 1])


def test_how_clear_a_choice_is() -> None:
    """Worked by hand: the gap to the second best over the spread that is usual in the table."""
    assert clarity(np.array([0.0, 4.0, 3.0, -1.0, 0.0]), 4.0) == pytest.approx(0.25)
    assert clarity(np.array([1.0, 0.0, 0.0, 0.0, 0.0]), 1.0) == 1.0
    assert clarity(np.array([9.0, 0.0, 0.0, 0.0, 0.0]), 3.0) == 1.0
    assert clarity(np.array([2.0, 2.0, 0.0, 0.0, 0.0]), 2.0) == 0.0


def test_the_usual_spread() -> None:
    """Worked by hand: the mean over states that can occur and whose values differ."""
    table = random_policy()
    assert usual_spread(table, PAPER) == 0.0
    table[parse_state("foraging E E E")] = (0.0, 4.0, 3.0, -1.0, 0.0)
    table[parse_state("foraging E F E")] = (2.0, 2.0, 2.0, 3.0, 2.0)
    table[parse_state("foraging F F F")] = 7.0
    assert usual_spread(table, PAPER) == pytest.approx((5 + 1) / 2)
    unreachable = next(index for index in range(128) if index not in REACHABLE_STATES)
    table[unreachable] = (100.0, 0.0, 0.0, 0.0, 0.0)
    assert usual_spread(table, PAPER) == pytest.approx(3.0)


HARDLY_VISITED = [
    (0.0, 0.0, 1.97e-5, 0.0, 0.0),
    (2.6e-6, 0.0, 0.0, 0.0, 0.0),
    (-0.002, 0.0, -0.001, -0.001, -0.001),  # the best is the one that was never tried
]


@pytest.mark.parametrize("values", HARDLY_VISITED)
def test_a_hairline_is_no_clear_choice(values) -> None:
    assert clarity(np.array(values), 0.4) < 0.01
    assert not learned(np.array(values), 0.4)
    assert learned(np.array(values), 100 * 2.5e-6)
    table = random_policy()
    table[parse_state("foraging E F E")] = (0.0, 0.0, 0.0, 0.8, 0.0)
    blank = policy_sheet(table)
    place = parse_state("foraging O O O")
    table[place] = values
    hardly = policy_sheet(table)
    table[place] = (0.0, 0.8, 0.0, 0.0, 0.0)
    clear = policy_sheet(table)
    assert (hardly == blank).all()
    assert coloured(clear, CHOSEN).sum(axis=1).max() > 60


def test_a_sheet_without_any_visited_state() -> None:
    sheet = policy_sheet(random_policy())
    assert sheet.shape[1] == 1280
    assert sheet.dtype == np.uint8
    assert not coloured(sheet, CHOSEN).any()


def all_known() -> np.ndarray:
    """A table in which something was learned in each state that an ant can come into."""
    table = random_policy()
    table[list(REACHABLE_STATES), RIGHT] = 1.0
    return table


@cache
def sheet_of_all_known() -> np.ndarray:
    return policy_sheet(all_known())


def changed_place(name: int | str) -> list[int]:
    """Left, right, top and bottom of what differs where the best action of a state does."""
    table = all_known()
    table[parse_state(name) if isinstance(name, str) else name] = (1.0, 0.0, 0.0, 0.0, 0.0)
    rows, columns = np.nonzero((policy_sheet(table) != sheet_of_all_known()).any(axis=2))
    return [columns.min(), columns.max(), rows.min(), rows.max()]


def test_a_state_has_its_place(monkeypatch) -> None:
    found = {}
    for name in ("foraging E E E", "foraging F E E", "foraging E E F", "foraging E F E"):
        left, right, top, bottom = changed_place(name)
        assert right - left < 155
        assert bottom - top < 140
        found[name] = np.array([left + right, top + bottom]) / 2
    # By the cell ahead, two rows each, then by the one to the left, then by the one to the right.
    first = found["foraging E E E"]
    assert found["foraging E E F"] - first == pytest.approx([3 * 155, 0], abs=20)
    assert found["foraging F E E"] - first == pytest.approx([4 * 155, 138], abs=20)
    assert found["foraging E F E"][0] == pytest.approx(first[0], abs=20)
    assert found["foraging E F E"][1] > first[1] + 6 * 130


def test_the_bar_of_a_state_is_as_long_as_its_choice_is_clear() -> None:
    table = random_policy()
    table[parse_state("foraging E E E")] = (0.0, 4.0, 3.0, -1.0, 0.0)
    assert 15 <= coloured(policy_sheet(table), CHOSEN).sum(axis=1).max() < 40  # a fifth of 112


@pytest.mark.slow
def test_only_states_that_can_occur_are_on_a_sheet() -> None:
    table = all_known()
    table[[index for index in range(128) if index not in REACHABLE_STATES]] = (1, 0, 0, 0, 0)
    assert (policy_sheet(table) == sheet_of_all_known()).all()
    seen = {tuple(place // 20 for place in changed_place(row)) for row in REACHABLE_STATES[::9]}
    assert len(seen) == len(REACHABLE_STATES[::9])


def test_a_sheet_shows_only_what_was_learned() -> None:
    table = random_policy()
    table[list(REACHABLE_STATES[:30]), RIGHT] = 1.0
    one = random_policy()
    one[parse_state("foraging E F E"), PICK_UP] = 1.0
    heights = [policy_sheet(one).shape[0], policy_sheet(table).shape[0]]
    heights.append(policy_sheet(all_known()).shape[0])
    assert heights == sorted(set(heights))


def test_text_on_a_sheet_says_what_it_shows(monkeypatch) -> None:
    lines = []
    monkeypatch.setattr(text, "write", lambda frame, line, *_, **__: lines.append(line))
    table = random_policy()
    table[parse_state("foraging E F E"), PICK_UP] = 1.0
    policy_sheet(table, "a title")
    assert lines[0] == "a title"
    assert "1 of 64 states learned" in lines
    assert "nothing was learned here" in lines  # with food
    assert lines.count("pick up") == 1
    assert max(map(len, lines)) < 125


FIVE = observations.get("five_cells")


def test_the_sheet_of_an_observation_of_more_cells(monkeypatch) -> None:
    """One state is visited: foraging T E F O E, with food ahead and a trail behind to the left."""
    table = np.zeros((FIVE.n_states, 5), dtype=np.float32)
    row = next(row for row in range(FIVE.n_states) if FIVE.name_of(row) == "foraging T E F O E")
    table[row, PICK_UP] = 1.0
    sheet = policy_sheet(table, task=Task(observation="five_cells"))
    assert coloured(sheet, CELL_FOOD).sum() > 60
    lines: list[str] = []
    monkeypatch.setattr(text, "write", lambda frame, line, *_, **__: lines.append(line))
    policy_sheet(table, task=Task(observation="five_cells"))
    assert "1 of 1024 states learned" in lines
    assert [line for line in lines if len(line) == 1] == list("TEOE")
    with pytest.raises(AntsError, match=r"\(2048, 5\)"):
        policy_sheet(random_policy(), task=Task(observation="five_cells"))


def test_of_very_many_states_a_sheet_shows_the_first_and_says_so(monkeypatch) -> None:
    lines: list[str] = []
    monkeypatch.setattr(text, "write", lambda frame, line, *_, **__: lines.append(line))
    table = np.zeros((FIVE.n_states, 5), dtype=np.float32)
    table[:300, RIGHT] = 1.0
    policy_sheet(table, task=Task(observation="five_cells"))
    assert "300 of 1024 states learned; 128 are shown" in lines
    assert lines.count("right") == 128


def test_states_with_names_of_another_form_are_written_out(monkeypatch) -> None:
    own = Observation("own", 4, lambda view: 0, name_of=lambda row: f"carrying crumb number {row}")
    monkeypatch.setattr(Task, "sees", own)
    monkeypatch.setattr(Task, "n_states", 4)
    lines: list[str] = []
    monkeypatch.setattr(text, "write", lambda frame, line, *_, **__: lines.append(line))
    policy_sheet(np.eye(4, 5))
    assert {f"crumb number {row}" for row in range(4)} <= set(lines)
    assert "4 of 4 states learned" in lines


def test_states_without_names_are_told_by_their_numbers_and_not_split_by_load(monkeypatch) -> None:
    episode = Episode.play(paper(), random_policy(), max_steps=1)
    monkeypatch.setattr(Task, "sees", Observation("own", 4, lambda view: 0))
    monkeypatch.setattr(Task, "n_states", 4)
    lines: list[str] = []
    monkeypatch.setattr(text, "write", lambda frame, line, *_, **__: lines.append(line))
    policy_sheet(np.eye(4, 5))
    assert {"0", "1", "2", "3", "States"} <= set(lines)
    assert not any("orag" in line or "arry" in line or "trail" in line for line in lines)
    status = episode._status(0, 0)
    assert ("state", str(status.state)) in status.lines
    assert not {"task", "sees"} & dict(status.lines).keys()


@pytest.mark.parametrize("name", ["ants_seen", "trail_levels", "paper"])
def test_letters_of_their_own_are_explained_on_the_sheet_and_in_the_panel(
    name, monkeypatch
) -> None:
    task, lines = Task(name), []
    table = np.zeros((task.n_states, 5), np.float32)
    names = {task.sees.name_of(row) for row in range(task.n_states)}
    strange = set("".join(one.partition(" ")[2] for one in names)) - set(" -EOTSFQ")
    monkeypatch.setattr(text, "write", lambda frame, line, *_, **__: lines.append(line))
    policy_sheet(table, task=task)
    (legend,) = (line for line in lines if line.startswith("E empty"))
    beside = dict(Episode.play(paper(), table, max_steps=1, task=task)._status(0, 0).lines)
    assert task.sees.letters in legend
    assert beside.get("", "") == task.sees.letters
    assert {word.strip(",") for word in task.sees.letters.split()} >= strange
    assert bool(strange) == (name != "paper")


@pytest.mark.parametrize("best", [(0, 1, 3), (0, 1, 2, 4), (0, 1, 2, 3)])
def test_no_tie_is_cut_off(best, monkeypatch) -> None:
    table, written = random_policy(), []
    table[parse_state("foraging E F E"), list(best)] = 1.0
    monkeypatch.setattr(text, "write", lambda *given, **more: written.append((given, more)))
    policy_sheet(table)
    (found,) = ((given, more) for given, more in written if " / " in given[1])
    (tile, words, _, _, size, *_), more = found
    assert words == " / ".join(ACTION_NAMES[action] for action in best)
    assert size >= text.SMALLEST
    assert text.width(words, size) <= more.get("room", tile.shape[1])


def test_sheets_that_are_refused() -> None:
    for wrong in (np.zeros((5, 128)), np.full((128, 5), "a")):
        with pytest.raises(AntsError, match="q_values"):
            policy_sheet(wrong)
    with pytest.raises(AntsError, match="must be finite"):
        policy_sheet(np.full((128, 5), np.nan))


def colony(ants: int = 30) -> Colony:
    made = Colony(open_world(3), None, CONFIG, 0, ants, sharing="frozen", q_values=trail_follower())
    made.begin_episode()
    return made


def test_a_colony_on_the_move() -> None:
    pictures = list(frames(colony_snapshots(colony(), 7, frame_interval=3), (200, 150)))
    assert len(pictures) == 4
    assert not any((a == b).all() for a, b in itertools.pairwise(pictures))
    other = colony()
    other.tick(7)
    assert (next(frames(colony_snapshots(other), (200, 150))) == pictures[-1]).all()
    for wrong in ({"frame_interval": 0}, {"ticks": -1}):
        with pytest.raises(AntsError, match=next(iter(wrong))):
            list(colony_snapshots(colony(), **{"ticks": 5, **wrong}))


@pytest.mark.parametrize("observation", ["paper", "ants"])
def test_one_ant_of_a_colony_is_followed(observation) -> None:
    """With its state and its action values; as without it once it is dead."""
    table = random_policy(observation)
    table += np.arange(table.shape[0])[:, None]
    task = Task(observation, life=Life(lifespan=9))
    made = Colony(open_world(3), task, CONFIG, 0, 20, sharing="frozen", q_values=table)
    made.begin_episode()
    for _ in range(8):
        snapshot, status = next(colony_snapshots(made, follow=5))
        slot = int(np.flatnonzero(made.numbers[0] == 5)[0])
        assert snapshot.ant_cells[0] == made.cells[0, slot]
        assert sorted(snapshot.ant_cells) == sorted(made.snapshot().ant_cells)
        assert status.q_values[0] == status.state == table[status.state, 0]
        assert ("ant", "5") in status.lines
        assert ("sees", task.sees.name_of(status.state).split(" ", 1)[1]) in status.lines
        made.tick()
    made.tick()
    _, status = next(colony_snapshots(made, follow=5))
    assert status.state is None
    with pytest.raises(AntsError, match="follow is 20; it must be from 0 to 19"):
        next(colony_snapshots(made, follow=20))


def test_a_followed_ant_has_the_colours_and_the_table_of_its_nest_and_caste() -> None:
    """Each table has its number as its values; the followed ant moves to the front as a whole."""
    world = World((6, 6, 6), queen=[(0, 0, 0), (3, 0, 0)], foods=[(0, 3, 0)])
    task = Task(castes={"a": Caste(share=0.5), "b": Caste(share=0.5)})
    tables = np.broadcast_to(np.arange(4.0).reshape(2, 2, 1, 1), (2, 2, task.n_states, 5))
    made = Colony(world, task, CONFIG, 0, 8, sharing="frozen", q_values=tables[None])
    made.begin_episode()
    before = made.snapshot()
    for number in range(8):
        (at,) = np.flatnonzero(before.ant_numbers == number)
        snapshot, status = next(colony_snapshots(made, follow=number))
        nest, caste = before.ant_nests[at], before.ant_castes[at]
        assert (snapshot.ant_nests[0], snapshot.ant_castes[0]) == (nest, caste)
        assert snapshot.ant_numbers[0] == number
        assert (status.q_values == 2 * nest + caste).all()
    assert len({*zip(before.ant_nests.tolist(), before.ant_castes.tolist(), strict=True)}) == 4


def test_the_legend_of_learning_tells_the_rewards_of_the_task(monkeypatch) -> None:
    lines: list[str] = []
    monkeypatch.setattr(text, "write", lambda frame, line, *_, **__: lines.append(line))
    task = Task(rewards=Rewards(shaping=2, deliver=50, failed=-4))
    checkpoints = learning_checkpoints(paper(), CONFIG, checkpoints=(0,), max_steps=5, task=task)
    next(learning_frames(checkpoints, (1400, 600)))
    told = {"T onto a trail +2", "Q delivery +50", "F food +3", "X blocked, in vain -4"}
    assert told <= set(lines)
