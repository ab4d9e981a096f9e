"""Links, worlds and settings are the same in JavaScript and Python."""

import base64
import json
import runpy

import numpy as np
import pytest
from command_lines import assert_one_sentence
from hypothesis import example, given, settings
from hypothesis import strategies as st
from lab_engines import ENGINE

from taichi_ants import AntsError, lab
from taichi_ants.worlds.lab import WORLDS, lab_world

CODE = "AQAPVUAeZIQHAQrYBAEC"  # of the first screen
AT_ONCE = [{"tick": 5, "do": "rock", "reach": 1, "path": [cell]} for cell in (2112, 2113)]
THOUSANDTHS = ("epsilon", "rate", "discount")


def of_setting(name):
    """A drawn value of a setting, as scenes have it."""
    numbers = st.integers(*lab.RANGES[name])
    return numbers.map(lambda n: n / 1000) if name in THOUSANDTHS else numbers


SCENES = st.fixed_dictionaries(
    {
        "world": st.integers(0, len(WORLDS) - 1),
        "learner": st.integers(0, len(lab.LEARNERS) - 1),
        "rules": st.sampled_from(lab.RULES),
        **{name: of_setting(name) for name in lab.RANGES},
    }
)


@st.composite
def visits(draw):
    """A drawn scene with events; some strokes go on where the last one ended."""
    scene, events, tick, end = draw(SCENES), [], 0, None
    radius = WORLDS[scene["world"]]["radius"]
    for _ in range(draw(st.integers(0, 8))):
        tick += draw(st.sampled_from([0, 1, 2, 31, 32, 33, 97, 200]))
        if draw(st.booleans()):
            name = draw(st.sampled_from(lab.SETTINGS))
            events.append({"tick": tick, "do": name, "value": draw(of_setting(name))})
            continue
        q, r = end if end and draw(st.booleans()) else (draw(st.integers(-6, 6)), 0)
        path = [] if (q, r) == end else [(q, r)]
        for heading in draw(st.lists(st.integers(0, 5), min_size=1, max_size=6)):
            for _ in range(draw(st.sampled_from([1, 2, 33]))):
                ahead = q + lab.STEPS[heading][0], r + lab.STEPS[heading][1]
                if lab.distance(*ahead) < radius:
                    q, r = ahead
                    path.append(ahead)
        if path:
            does, reach = (
                draw(st.sampled_from([*filter(None, lab.STROKES)])),
                draw(st.integers(0, 7)),
            )
            if events and "path" in events[-1]:
                does, reach = events[-1]["do"], events[-1]["reach"]
            width, end = 2 * radius + 1, (q, r)
            cells = [(b + radius) * width + a + radius for a, b in path]
            events.append({"tick": tick, "do": does, "reach": reach, "path": cells})
    return scene, events


@example(({**lab.decoded(CODE)[0], "learner": 0}, AT_ONCE))
@given(visits())
def test_a_code_has_the_visit(ask, visit):
    scene, events = visit
    code = ask("encode", scene=scene, events=events)
    assert ask("decode", code=code) == {"scene": scene, "events": events}
    found, read = lab.decoded(code)
    assert found == {**scene, "learner": lab.LEARNERS[scene["learner"]]}
    radius = WORLDS[scene["world"]]["radius"]
    for event, wanted in zip(read, events, strict=True):
        cells = [(r + radius) * (2 * radius + 1) + q + radius for q, r in event.path]
        more = {"reach": event.reach, "path": cells} if cells else {"value": event.value}
        assert {"tick": event.tick, "do": event.does, **more} == wanted


@example(b"")
@given(st.binary(max_size=40).map(lambda more: base64.urlsafe_b64decode(CODE) + more))
def test_both_refuse_the_same_codes(ask, raw):
    code = base64.urlsafe_b64encode(raw).decode().rstrip("=")
    try:
        found = len(lab.decoded(code)[1])
    except (ValueError, IndexError):
        found = None
    answer = ask("decode", code=code)
    assert ("error" in answer) == (found is None)
    assert found is None or len(answer["events"]) == found


@pytest.mark.parametrize(
    "link",
    [
        *("", "#", CODE, f"{CODE};10", f"{CODE};10;xyz", f"{CODE};-1;0", f"{CODE};9999999;0"),
        *(f"{CODE[:-3]};10;0", f"A{CODE};10;0", f"{CODE}!;10;0", "https://example.org/#a=b"),
    ],
)
def test_a_damaged_link_is_refused(link):
    with pytest.raises(AntsError, match="the link is damaged, or is not one of the lab") as raised:
        lab.replay(link)
    assert_one_sentence(f"error: {raised.value}\n")


@pytest.mark.parametrize("number", range(len(WORLDS)))
def test_worlds_are_the_same(number, ask):
    daily = WORLDS[number].get("daily", False)
    for seed in (0, 85, 20261127, 2**53 - 1) if daily else (0,):
        world, found = lab_world(number, seed), ask("world", world=number, seed=seed)
        grid = world.grid
        assert found["queen"] == grid.index([world.queen])[0]
        for name, cells in (("foods", world.foods), ("rocks", world.obstacles)):
            assert found[name] == sorted(grid.index(cells).tolist())
        assert found["scent"] == sorted(grid.index(world.trails[:, :3]).tolist())


@pytest.mark.slow
def test_food_of_each_day_can_be_reached():
    """Items beside which ants can stand; others lie behind them."""
    daily = next(number for number, world in enumerate(WORLDS) if world.get("daily"))
    days = np.arange("2026-11-01", "2036-11-01", 25, dtype="datetime64[D]").astype(str)
    worlds = [lab_world(daily, int(day.replace("-", ""))) for day in days]
    assert min(world.reachable_foods().sum() for world in worlds) > 10


@settings(max_examples=30)
@given(st.sampled_from(sorted(lab.RANGES)), st.floats(-2e6, 2e6))
def test_the_page_rounds_to_what_links_can_have(ask, name, value):
    kept, unit = ask("allowed", name=name, value=value), 1000 if name in THOUSANDTHS else 1
    least, most = lab.RANGES[name]
    assert kept * unit == pytest.approx(min(max(value * unit, least), most), abs=0.500001)
    assert round(kept * unit) / unit == kept


def test_tables_of_the_page_are_those_of_the_package():
    for name, content in runpy.run_path(str(ENGINE / "build.py"))["DATA"].items():
        kept = json.loads((ENGINE.parent / name).read_text("utf-8"))
        assert json.loads(json.dumps(content())) == kept, f"{name}: run python lab/engine/build.py"
