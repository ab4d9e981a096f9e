"""What is public in rendering names an argument of a wrong kind where it comes in."""

from __future__ import annotations

import inspect
from collections.abc import Callable

import numpy as np
import pytest

from taichi_ants import AntsError, Colony, TrainingConfig, rendering
from taichi_ants.learners.policies import trail_follower
from taichi_ants.rendering import Episode, Scene, Status, at_start
from taichi_ants.worlds import paper

WORLD = paper()
TABLE = trail_follower()
FRAME = np.zeros((64, 64, 3), np.uint8)
CONFIG = TrainingConfig("sarsa", 0.01, 0.9, 0.5, 0.995)


def episode() -> Episode:
    return Episode.play(WORLD, TABLE)


def colony() -> Colony:
    made = Colony(WORLD, None, CONFIG, 0, 3, sharing="frozen", q_values=TABLE)
    made.begin_episode()
    return made


def of(make: Callable, *others: object, **named: object) -> Callable[[object], object]:
    """Calls with a wrong first argument; generators are begun."""

    def call(wrong: object) -> object:
        found = make(wrong, *others, **named)
        return next(found) if inspect.isgenerator(found) else found

    return call


# Public name -> calls with one wrong argument, which the message names.
CALLS: dict[str, list[tuple[str, Callable[[object], object]]]] = {
    "Episode": [("world", of(Episode.play, TABLE))],
    "Scene": [
        ("grid", of(Scene)),
        ("size", lambda wrong: Scene(WORLD.grid, wrong)),
        ("title", lambda wrong: Scene(WORLD.grid, title=wrong)),
        ("overlay", lambda wrong: Scene(WORLD.grid, overlay=wrong)),
        ("snapshot", lambda wrong: Scene(WORLD.grid).draw(wrong)),
        ("status", lambda wrong: Scene(WORLD.grid).draw(at_start(WORLD), wrong)),
    ],
    "Snapshot": [("snapshot", lambda wrong: Scene(WORLD.grid).draw(wrong))],
    "Status": [("status", lambda wrong: Scene(WORLD.grid).draw(at_start(WORLD), wrong))],
    "at_start": [("world", of(at_start))],
    "picture": [
        ("world", of(rendering.picture)),
        ("size", lambda wrong: rendering.picture(WORLD, wrong)),
    ],
    "check_animation": [
        ("path", of(rendering.check_animation, 8)),
        ("fps", lambda wrong: rendering.check_animation("a.gif", wrong)),
    ],
    "check_picture": [("path", of(rendering.check_picture))],
    "colony_snapshots": [
        ("colony", of(rendering.colony_snapshots, 3)),
        ("ticks", lambda wrong: next(rendering.colony_snapshots(colony(), wrong))),
        (
            "frame_interval",
            lambda wrong: next(rendering.colony_snapshots(colony(), 3, frame_interval=wrong)),
        ),
    ],
    "frames": [
        ("snapshot", lambda wrong: next(rendering.frames([(wrong, Status(()))]))),
        ("status", lambda wrong: next(rendering.frames([(at_start(WORLD), wrong)]))),
        ("size", lambda wrong: next(rendering.frames(episode().snapshots(), wrong))),
    ],
    "save_animation": [
        ("path", of(rendering.save_animation, [FRAME], 8)),
        ("frames", lambda wrong: rendering.save_animation("a.gif", wrong, 8)),
        ("a frame", lambda wrong: rendering.save_animation("a.gif", [wrong], 8)),
    ],
    "save_picture": [
        ("path", of(rendering.save_picture, FRAME)),
        ("a frame", lambda wrong: rendering.save_picture("a.png", wrong)),
    ],
}


def test_all_that_is_public_is_tried() -> None:
    assert set(CALLS) == {name for name in rendering.__all__ if not name.isupper()}


@pytest.mark.parametrize(
    ("called", "named", "call"),
    [(name, named, call) for name, calls in CALLS.items() for named, call in calls],
)
@pytest.mark.parametrize("wrong", [7.5, object(), np.zeros(3)], ids=["7.5", "object", "array"])
def test_a_wrong_kind_is_named_in_one_sentence(
    called, named, call, wrong, tmp_path, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if named == "fps" and isinstance(wrong, float):
        wrong = "7.5"
    with pytest.raises(AntsError) as caught:
        call(wrong)
    message = str(caught.value)
    assert named.removeprefix("a ").rstrip("s") in message
    assert "\n" not in message
    assert len(message) < 250
    assert list(tmp_path.iterdir()) == []


def test_a_snapshot_of_another_grid_is_refused() -> None:
    from taichi_ants.worlds import open_world

    with pytest.raises(AntsError, match="ranges"):
        Scene(WORLD.grid).draw(at_start(open_world(1)), Status(()))
