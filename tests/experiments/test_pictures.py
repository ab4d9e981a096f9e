"""Pictures of learning, and policy sheets."""

import re
from functools import cache
from pathlib import Path

import gallery
import learning
import numpy as np
import pytest
from command_lines import ROOT, assert_one_sentence, call_script
from learning import Checkpoint, Lessons, learning_frames, noted_checkpoints
from PIL import Image
from policy_sheet import clarity, policy_sheet, usual_spread

from taichi_ants import AntsError, TrainingConfig
from taichi_ants.learners.policies import random_policy, save_policy, trail_follower
from taichi_ants.rendering import Episode, text
from taichi_ants.rendering.colours import CELL_FOOD, CHOSEN
from taichi_ants.task import Task, observations
from taichi_ants.task.constants import N_STATES, PICK_UP, RIGHT
from taichi_ants.task.states import REACHABLE_STATES, state_name
from taichi_ants.worlds import paper

STATES = [state_name(index) for index in range(N_STATES)]
CONFIG = TrainingConfig("sarsa", 0.01, 0.9, 0.5, 0.995)


def coloured(picture: np.ndarray, colour: int) -> np.ndarray:
    return (picture == (colour >> 16, colour >> 8 & 255, colour & 255)).all(axis=2)


def test_the_account_says_where_the_return_comes_from() -> None:
    """The shortest delivery earns 16 on the trail, 16 on the way back, 3 for the food and 10."""
    follower = Checkpoint(500, Episode.play(paper(), trail_follower()))
    account = follower.account()
    assert account[-1].tolist() == [16, 16, 3, 10, 0]
    assert account[0].tolist() == [0] * 5
    for seed, checkpoints in ((2, (0, 10)), (7, (10, 30))):
        for checkpoint in Lessons(paper(), CONFIG, 80).checkpoints(seed, checkpoints):
            returns = np.concatenate([[0], checkpoint.episode.trace.rewards.cumsum()])
            assert (checkpoint.account().sum(axis=1) == returns).all()
            assert (checkpoint.account()[:, :4] >= 0).all()
            assert (checkpoint.account()[:, 4] <= 0).all()


def test_the_typical_seed_is_the_one_nearest_to_the_middle_rank_at_every_stage() -> None:
    seeds, checkpoints, steps = (3, 14, 15, 92, 65, 35, 89, 79), (0, 1, 3), 80
    lessons = Lessons(paper(), CONFIG, steps)
    chosen, deliver = lessons.typical_seed(seeds, checkpoints)
    played = {seed: lessons.checkpoints(seed, checkpoints) for seed in seeds}
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


def test_a_stage_that_has_ended_stays() -> None:
    checkpoints = Lessons(paper(), CONFIG, 60).checkpoints(2, (0, 50))
    short, long = sorted(checkpoints, key=lambda checkpoint: len(checkpoint.episode))
    assert len(short.episode) < len(long.episode) == 61
    shown = list(learning_frames(checkpoints, (640, 400), "a title"))
    assert len(shown) == 61
    halves = [(frame[:, :320], frame[:, 320:]) for frame in shown]
    ended = checkpoints.index(short)
    last = len(short.episode) - 1
    assert all((half[ended] == halves[last][ended]).all() for half in halves[last:])
    assert not (halves[last - 1][ended] == halves[last][ended]).all()
    assert not (halves[-1][1 - ended] == halves[last][1 - ended]).all()


FIVE = observations.get("five_cells")


@pytest.fixture
def lines(monkeypatch) -> list[str]:
    """The texts that pictures write."""
    written: list[str] = []
    monkeypatch.setattr(text, "write", lambda frame, line, *_, **__: written.append(line))
    return written


def test_how_clear_a_choice_is() -> None:
    """Worked by hand: the gap to the second best over the spread that is usual in the table."""
    assert clarity(np.array([0.0, 4.0, 3.0, -1.0, 0.0]), 4.0) == pytest.approx(0.25)
    assert clarity(np.array([1.0, 0.0, 0.0, 0.0, 0.0]), 1.0) == 1.0
    assert clarity(np.array([9.0, 0.0, 0.0, 0.0, 0.0]), 3.0) == 1.0
    assert clarity(np.array([2.0, 2.0, 0.0, 0.0, 0.0]), 2.0) == 0.0


def test_the_usual_spread() -> None:
    """Worked by hand: the mean over states that can occur and whose values differ."""
    table = random_policy()
    assert usual_spread(table, Task().sees) == 0.0
    table[STATES.index("foraging E E E")] = (0.0, 4.0, 3.0, -1.0, 0.0)
    table[STATES.index("foraging E F E")] = (2.0, 2.0, 2.0, 3.0, 2.0)
    table[STATES.index("foraging F F F")] = 7.0
    assert usual_spread(table, Task().sees) == pytest.approx((5 + 1) / 2)
    unreachable = next(index for index in range(128) if index not in REACHABLE_STATES)
    table[unreachable] = (100.0, 0.0, 0.0, 0.0, 0.0)
    assert usual_spread(table, Task().sees) == pytest.approx(3.0)


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
    table[STATES.index(name) if isinstance(name, str) else name] = (1.0, 0.0, 0.0, 0.0, 0.0)
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
    table[STATES.index("foraging E E E")] = (0.0, 4.0, 3.0, -1.0, 0.0)
    assert 15 <= coloured(policy_sheet(table), CHOSEN).sum(axis=1).max() < 40  # a fifth of 112


def test_text_on_a_sheet_says_what_it_shows(lines) -> None:
    table = random_policy()
    table[STATES.index("foraging E F E"), PICK_UP] = 1.0
    policy_sheet(table, "a title")
    assert lines[0] == "a title"
    assert "1 of 64 states learned" in lines
    assert "nothing was learned here" in lines  # with food
    assert lines.count("pick up") == 1
    assert max(map(len, lines)) < 125


def test_the_sheet_of_an_observation_of_more_cells(lines) -> None:
    """One state is visited: foraging T E F O E, with food ahead and a trail behind to the left."""
    table = np.zeros((FIVE.n_states, 5), dtype=np.float32)
    row = next(row for row in range(FIVE.n_states) if FIVE.name_of(row) == "foraging T E F O E")
    table[row, PICK_UP] = 1.0
    sheet = policy_sheet(table, task=Task(observation="five_cells"))
    assert coloured(sheet, CELL_FOOD).sum() > 60
    assert "1 of 1024 states learned" in lines
    assert [line for line in lines if len(line) == 1] == list("TEOE")
    with pytest.raises(AntsError, match=r"\(2048, 5\)"):
        policy_sheet(random_policy(), task=Task(observation="five_cells"))


@pytest.mark.slow
def test_learning_and_a_sheet_from_the_command_line(tmp_path: Path, capsys) -> None:
    place = tmp_path / "a.gif"
    arguments = ["--seed", 5, "--checkpoints", 0, 2, "--max-steps", 9, "--size", "300x200"]
    arguments += ["--training.learner", "q_learning"]
    status, out, err = call_script("learning", [*arguments, "--out", place], capsys)
    assert (status, err) == (0, "")
    assert out.endswith("a.gif: seed 5, before learning, after 2 episodes\n")
    with Image.open(place) as image:
        assert image.n_frames >= 5
    save_policy(tmp_path / "five.npz", np.eye(2048, 5), {}, "five_cells")
    arguments = ["--policy", tmp_path / "five.npz", "--out", tmp_path / "sheet.png"]
    assert call_script("policy_sheet", arguments, capsys)[0] == 0
    assert Image.open(tmp_path / "sheet.png").width == 1280


@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("learning", ["--out", "{}/a.avi"], ".gif"),
        ("learning", ["--policy", "a.npz"], "--policy"),
        ("learning", ["--checkpoints", "5", "2"], "it must be ascending numbers"),
        ("policy_sheet", ["--out", "{}/a.gif"], ".png"),
        ("policy_sheet", ["--size", "400x300"], "--size"),
        ("policy_sheet", ["--policy", "a.npz", "--episodes", "5"], "--episodes configures"),
        ("policy_sheet", ["--training.discount", "y", "--out", "{}/a.png"], "is 'y'; it must be"),
    ],
)
def test_mistakes_are_one_sentence(name, arguments, said, tmp_path, capsys) -> None:
    status, out, err = call_script(name, [one.format(tmp_path) for one in arguments], capsys)
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert said in err
    assert not list(tmp_path.iterdir())


def test_the_picture_of_learning_shows_stages_that_differ_and_the_median_of_many_ants(
    lines,
) -> None:
    """docs/results/paper.md says of it what the picture shows, and how many of 200 ants do so."""
    arguments = gallery.drawing(gallery.GALLERY["learning.gif"])[1]
    _, checkpoints = noted_checkpoints(arguments, paper())
    steps = [len(checkpoint.episode.trace) for checkpoint in checkpoints]
    notes = [checkpoint.note for checkpoint in checkpoints]
    assert len({*zip(steps, notes, strict=True)}) == len(checkpoints)
    page = (ROOT / "docs" / "results" / "paper.md").read_text(encoding="utf-8")
    page = " ".join(page.lower().split())
    for n, checkpoint in zip(steps[1:], checkpoints[1:], strict=True):
        assert checkpoint.note == "delivered"
        number, _, seeds = checkpoint.among.split()[:3]
        assert f"{checkpoint.title} it delivers in {n} steps ({number} of {seeds} ants" in page
    list(learning_frames(checkpoints, arguments.size))
    assert {checkpoint.among for checkpoint in checkpoints} < set(lines)
    assert f"step {steps[-1]}, return 45: delivered" in lines


def test_an_ant_that_circles_earns_more_than_a_delivery_and_the_picture_says_why(lines) -> None:
    """docs/how-to/pictures.md says so of this seed."""
    arguments = learning.parse_arguments(["--seed", "7", "--checkpoints", "0", "10", "20"])
    seed, checkpoints = noted_checkpoints(arguments, paper())
    assert seed == 7
    notes = [(checkpoint.note, checkpoint.among) for checkpoint in checkpoints]
    assert notes == [("", ""), ("circles with food", ""), ("delivered", "")]
    returns = [int(checkpoint.episode.trace.rewards.sum()) for checkpoint in checkpoints]
    assert returns[1] > returns[2] == 45
    told = (ROOT / "docs/how-to/pictures.md").read_text(encoding="utf-8")
    assert re.search(rf"returns\s+{returns[1]}\s+after\s+10\s+episodes", told)
    list(learning_frames(checkpoints, (1200, 480)))
    assert f"step 150, return {returns[1]}: circles with food" in lines
    assert "= T 16 + S 16 + F 3 + Q 10" in lines
    assert "S nearer to the queen +1" in lines  # the legend
