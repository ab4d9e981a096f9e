"""Single colonies as a command: files held against the library."""

import os
import signal
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from command_lines import EXPERIMENTS, assert_one_sentence, call

from taichi_ants import (
    AntsError,
    Colony,
    Life,
    Pheromone,
    Task,
    TrainingConfig,
    load_policy,
    worlds,
)
from taichi_ants.commands import colony as command
from taichi_ants.engines.colony.layout import WorldRow
from taichi_ants.learners.policies import save_policy
from taichi_ants.rendering import writers
from taichi_ants.task import foraging, paper, queueing

CALM = TrainingConfig("sarsa", 0.1, 0.9, 0.01, 1.0)


def task(pheromone=Pheromone(), life=Life(regrowth=0)):  # noqa: B008 - both are frozen
    """That of a colony that lives for a while."""
    return Task(pheromone=pheromone, life=life)


NO_FILE = "is not a regular file"


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--quick"], "unrecognized arguments: --quick"),
        (["--resume", "x", "--task.life.births"], "births cannot change a resumed colony"),
        (["--sharing", "frozen", "--training.discount", 0.9], "discount has no effect with"),
        (["--resume", "x"], "cannot read 'x'"),
        (["--world", "nowhere"], "there is no world 'nowhere'"),
        (["--task.life.births", "--capacity", 5], "capacity is 5; it must lie between 80 and"),
        # Refused before what the work reads later.
        (["--save", "/dev/null", "--resume", "x"], f"'/dev/null' {NO_FILE}"),
        (["--render", "../a.png/", "--resume", "x"], f"'../a.png/' {NO_FILE}"),
        (["--policy", "x", "--task.observation", "paper"], "--policy determines the observation"),
        (["--task.pheromone.half-live", 5], "is not a setting; choose half_life"),
        (["--task.life.births", "maybe"], "is 'maybe'; it must be True or False"),
        (["--plugin", "x.py"], "cannot read the plugin"),
    ],
)
def test_mistakes_end_in_one_sentence(arguments, expected, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = call("colony", ["live", *arguments], capsys)
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert expected in err
    assert list(tmp_path.iterdir()) == []


LIFE = [
    *("live", "--task", "paper", "--ants", 40, "--world.ranges", 20, 20, 20, "--capacity", 60),
    *("--seed", 5),
    *("--task.life.births", "--task.life.lifespan", 90, "--task.life.regrowth", 3),
    *("--task.life.pile_move_interval", 20, "--task.pheromone.evaporation", "exponential"),
    *("--task.pheromone.half-life", 30, "--task.pheromone.diffusion", 0.1),
    *("--task.pheromone.deposit", "add", "--task.pheromone.level", 90),
    *("--task.pheromone.cap", 170, "--training.learner", "q_learning"),
]


def test_a_colony_that_is_saved_and_resumed_is_the_one_that_lived_on(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = [*LIFE, "--ticks", 120, "--save", "whole.npz", "--render", "end.png"]
    status, out, _ = call("colony", whole, capsys)
    assert status == 0
    assert "ants, 120 ticks in " in out
    assert "deliveries by tick 120" in out
    assert call("colony", [*LIFE, "--ticks", 50, "--save", "part.npz"], capsys)[0] == 0
    more = ["live", "--resume", "part.npz", "--ticks", 70, "--save", "part.npz"]
    status, out, _ = call("colony", [*more, "--render", "rest.gif", "--frame-interval", 7], capsys)
    assert status == 0
    assert "ants, 70 ticks in " in out
    with np.load("whole.npz") as one, np.load("part.npz") as other:
        assert one.files == other.files
        assert all(np.array_equal(one[name], other[name]) for name in one.files)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *("end.png", "part.npz", "rest.gif", "whole.npz")
    ]


def test_a_colony_as_the_library_makes_it(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, _ = call("colony", [*LIFE, "--ticks", 90, "--save", "colony.npz"], capsys)
    assert status == 0
    pheromone = Pheromone(
        "exponential", half_life=30.0, diffusion=0.1, deposit="add", level=90, cap=170
    )
    life = Life(births=True, lifespan=90, regrowth=3, pile_move_interval=20)
    training = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0, 0.1)
    world = worlds.open_world(5, (20, 20, 20))
    colony = Colony(world, task(pheromone, life), training, 5, 40, 60)
    colony.run(1, 90)
    saved = Colony.load("colony.npz")
    np.testing.assert_array_equal(saved.q_values, colony.q_values)
    assert f"{colony.outcome().deliveries.sum()} deliveries by tick 90" in out


def test_stopped_a_colony_is_saved_at_a_whole_tick(capsys, tmp_path, monkeypatch):
    pieces = []

    @contextmanager
    def counting(title):
        def update(share):
            pieces.append(share)
            if len(pieces) == 3:
                signal.raise_signal(signal.SIGTERM)

        yield update

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command.command_line, "progress_bar", counting)
    arguments = ["live", "--ants", 60, "--world", "paper", "--ticks", 10_000_000]
    arguments += ["--task.life.regrowth", 0, "--save", "colony.npz"]
    status, out, err = call("colony", arguments, capsys)
    assert (status, len(pieces)) == (143, 3)
    ticks = int(err.removeprefix("Stopped at tick ").split(";")[0])
    assert err == f"Stopped at tick {ticks}; use --resume colony.npz to resume.\n"
    assert f"60 ants, {ticks} tick" in out
    training = TrainingConfig("sarsa", 0.1, 0.9, 0.1, 1.0, 0.1)
    colony = Colony(worlds.paper(), FOOD_IS_BACK, training, 0, 60)
    colony.run(1, ticks)
    saved = Colony.load("colony.npz")
    np.testing.assert_array_equal(saved.q_values, colony.q_values)
    assert saved.outcome().deliveries == colony.outcome().deliveries


def test_stopped_before_it_begins_it_promises_nothing(capsys, monkeypatch):
    monkeypatch.setattr(command, "new_colony", lambda *given: signal.raise_signal(signal.SIGINT))
    assert call("colony", ["live"], capsys) == (130, "", "Stopped.\n")


def test_a_colony_starts_from_a_policy(capsys):
    policy = EXPERIMENTS / "policies" / "foraging.npz"
    fixed = ["live", "--ants", 2, "--world", "paper", "--ticks", 60, "--sharing", "frozen"]
    assert call("colony", [*fixed, "--policy", policy, "--task.life.regrowth", 0], capsys)[0] == 0


FOOD_IS_BACK = replace(queueing(), life=Life(regrowth=0))


@pytest.mark.parametrize(
    ("arguments", "made_for", "expected"),
    [
        ([], None, queueing()),
        ([], FOOD_IS_BACK, FOOD_IS_BACK),
        (["--task", "foraging"], queueing(), replace(foraging(), observation="queues")),
        (
            ["--task.life.regrowth", 0, "--task.life.births"],
            queueing(),
            replace(queueing(), life=Life(True, None, 0)),
        ),
        (
            ["--task.pheromone.evaporation", "linear"],
            replace(paper(), pheromone=Pheromone("exponential", 20)),
            paper(),
        ),
    ],
)
def test_rules_are_those_named_else_the_policys_else_queueing(
    arguments, made_for, expected, tmp_path
):
    policy = None
    if made_for:
        table = np.zeros((made_for.n_states, 5))
        facts = {"task": made_for.as_dict()}
        save_policy(tmp_path / "a.npz", table, facts, made_for.observation)
        policy = load_policy(tmp_path / "a.npz")
    settings = command.parse_arguments(["live", *map(str, arguments)])
    assert command.rules(settings, policy) == expected


def begun(ants=3):
    colony = Colony(worlds.paper(), None, TrainingConfig("sarsa", 0.1, 0.9, 0.1, 1.0), 4, ants)
    colony.begin_episode()
    return colony


@pytest.mark.parametrize(
    ("render", "encode", "ticks"), [("a.gif", "_with_palette", 6), ("a.png", "png", 20)]
)
def test_a_colony_is_saved_although_its_picture_cannot_be(
    tmp_path, monkeypatch, render, encode, ticks
):
    def full(frames, *more, **named):
        list(islice(frames, 4))  # of a GIF: at the start and after 2, 4, 6 ticks
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writers, encode, full)
    colony = begun()
    save = str(tmp_path / "keep.npz")
    files = save, str(tmp_path / render)
    with pytest.raises((AntsError, OSError), match="o space left on device"):
        command.live(colony, 20, lambda share: None, lambda: False, *files, frame_interval=2)
    assert os.listdir(tmp_path) == ["keep.npz"]
    other = begun()
    other.tick(ticks)
    saved = Colony.load(save)
    assert saved.ticks == ticks
    np.testing.assert_array_equal(saved.cells, other.cells)
    np.testing.assert_array_equal(saved.q_values, other.q_values)


def test_the_summary_counts_in_words():
    def summed(**counts):
        colony = begun(ants=1)
        colony.tick(1)
        for name, count in counts.items():
            colony.arrays["worlds"][getattr(WorldRow, name.upper())] = count
        return command.summary(colony, 1, 2.34)

    one, two = summed(deliveries=1, births=1), summed(deliveries=2, births=2, deaths=1)
    assert one.startswith("1 ant, 1 tick in 2.3 s.")
    assert "\n1 delivery by tick 1, " in one
    assert one.endswith(" % of the moves blocked, 1 birth.")
    assert "\n2 deliveries by tick 1, " in two
    assert two.endswith(" % of the moves blocked, 2 births, 1 death.")
