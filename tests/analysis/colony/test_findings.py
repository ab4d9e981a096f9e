"""Every sentence of the study, on made-up data where it is so and where it is not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from synthetic_colony_study import SIZES, Truth, build, proportional

from taichi_ants.analysis.colony import find, judge_all
from taichi_ants.analysis.colony.contrasts import (
    COPIES,
    CROWDING,
    CURE,
    FIRST,
    TRAIL,
    decline,
    peak,
)
from taichi_ants.analysis.colony.differences import Difference, judge
from taichi_ants.analysis.colony.findings import POSSIBLE
from taichi_ants.analysis.colony.sentences import (
    change,
    comparison,
    figure,
    listed,
    percent,
)
from taichi_ants.analysis.colony.study import (
    COPIED,
    COPIED_LONG,
    JOINT,
    LASTING,
    OFF,
    ON,
    OWN,
    THEN_JOINT,
)


def sentences(question: str, truth: Truth = proportional, **settings: object) -> list[str]:
    return [f.sentence for f in find(build(truth, **settings)) if f.question == question]


def of_each(each: dict[int, float]) -> Truth:
    """All conditions alike: so much for each ant, by the number of ants."""
    return lambda pheromone, way, ants: each[ants] * ants


def scaled(factor: float, *, pheromone: str | None = None, way: str | None = None) -> Truth:
    """Twenty for each ant, but `factor` times as much for some, from two ants on."""

    def truth(smelled: str, trained: str, ants: int) -> float:
        chosen = smelled == (pheromone or smelled) and trained == (way or trained) and ants > 1
        return 20.0 * ants * (factor if chosen else 1.0)

    return truth


@pytest.mark.parametrize(
    ("each", "expected"),
    [
        (
            {1: 20, 2: 20, 4: 20, 8: 20},
            "deliver more the more there are, up to 8 ants: 20.0 per 1000 ticks with 1, 160 with "
            "8, 8.00 times as many, and it still grows there",
        ),
        (
            {1: 20, 2: 20, 4: 15, 8: 7.5},
            "deliver more the more there are, up to 4 ants: 20.0 per 1000 ticks with 1, 60.0 with "
            "4, 3.00 times as many; beyond that no growth can be told from chance (60.0 with 8)",
        ),
        (
            {1: 20, 2: 20, 4: 15, 8: 4},
            "deliver more the more there are, up to 4 ants: 20.0 per 1000 ticks with 1, 60.0 with "
            "4, 3.00 times as many; with 8 it is less again, 32.0",
        ),
        (
            {1: 20, 2: 10, 4: 5, 8: 2.5},
            "deliver no more beyond chance the more there are: 20.0 per 1000 ticks with 1, 20.0 "
            "with 8",
        ),
        (
            {1: 20, 2: 10, 4: 2.5, 8: 1},
            "deliver less the more there are, from 4 ants on: 20.0 per 1000 ticks with 1, 8.00 "
            "with 8",
        ),
    ],
)
def test_do_more_copies_help(each: dict[int, float], expected: str) -> None:
    found = sentences(COPIES, of_each(each), noise=0.01)
    for sentence, who in zip(
        found, ("copies of an ant trained alone", "jointly trained ants"), strict=True
    ):
        assert rounded(sentence) == rounded(f"In the paper world, {who} {expected}.")


def rounded(text: str) -> str:
    """Numbers with two digits, as noise blurs the third."""
    words = text.replace("(", "( ").split()
    numbers = []
    for word in words:
        core = word.rstrip(",;).")
        try:
            numbers.append(f"{float(core):.2g}")
        except ValueError:
            numbers.append(word)
    return " ".join(numbers)


@pytest.mark.parametrize(
    ("each", "onset"),
    [
        ({1: 20, 2: 20, 4: 20, 8: 20}, None),
        ({1: 20, 2: 19, 4: 18, 8: 10}, 2),
        ({1: 20, 2: 20, 4: 20, 8: 10}, 8),
        # It falls, but recovers: there is room for more.
        ({1: 20, 2: 15, 4: 25, 8: 20}, 8),
        ({1: 20, 2: 10, 4: 20, 8: 21}, None),
        ({1: 10, 2: 20, 4: 30, 8: 40}, None),
    ],
)
def test_where_crowding_begins(each: dict[int, float], onset: int | None) -> None:
    found = sentences(CROWDING, of_each(each), noise=0.5)
    assert len(found) == 3
    for sentence in found:
        if onset is None:
            assert "deliver no less each beyond chance in larger colonies" in sentence
            assert "where 8.0 % of the moves are blocked" in sentence
        else:
            assert f"deliver less each from {onset} ants on" in sentence
            assert f"while {onset}.0 % of the moves are blocked" in sentence
            assert ("; with 8 it is" in sentence) == (onset != 8)


def test_crowding_is_told_for_each_way() -> None:
    def truth(pheromone: str, way: str, ants: int) -> float:
        falls = {(ON, COPIED): 2, (OFF, COPIED): 8}.get((pheromone, way), 99)
        return ants * (10.0 if ants >= falls else 20.0)

    copies, off, jointly = sentences(CROWDING, truth)
    assert "copies of an ant trained alone deliver less each from 2 ants on" in copies
    assert "copies that lay no trails deliver less each from 8 ants on" in off
    assert "jointly trained ants deliver no less each beyond chance" in jointly


WAYS_COMPARED: dict[str, tuple[str, str, str]] = {
    "jointly trained ants deliver {} than copies of an ant trained alone": (JOINT, COPIED, ""),
    "jointly trained ants deliver {} than copies of one trained alone for 64 times as long": (
        JOINT,
        COPIED_LONG,
        "",
    ),
    "ants with a table each deliver {} than ants that share one": (OWN, JOINT, ""),
    "ants trained alone and then jointly deliver {} than ants only trained jointly": (
        THEN_JOINT,
        JOINT,
        "",
    ),
}


@pytest.mark.parametrize("words", WAYS_COMPARED)
def test_ways_are_compared(words: str) -> None:
    first, second, _ = WAYS_COMPARED[words]
    more = sentences(CURE, scaled(1.5, way=first))
    less = sentences(CURE, scaled(1.5, way=second))
    same = sentences(CURE)
    where = " at every size from 2 to 8 ants"
    assert sum(words.format("more") + where in sentence for sentence in more) == 1
    assert sum(words.format("less") + where in sentence for sentence in less) == 1
    who, _, whom = words.partition(" deliver {} than ")
    untold = f"between {who} and {whom} no difference can be told from chance at any size"
    assert sum(untold in sentence for sentence in same) == 1


@pytest.mark.parametrize(
    ("each", "noise", "expected"),
    [
        (20.0, 1, "joint learning cures crowding"),
        (30.0, 1, "joint learning cures crowding"),
        (19.0, 1, "joint learning cures crowding"),
        (10.0, 1, "joint learning does not cure crowding"),
        (17.0, 1, "joint learning does not cure crowding"),
        # An absent proof of a loss is no proof of its absence.
        (17.0, 60, "whether joint learning cures crowding cannot be told from chance"),
    ],
)
def test_whether_joint_learning_cures_crowding(each: float, noise: float, expected: str) -> None:
    def truth(pheromone: str, way: str, ants: int) -> float:
        return ants * (each if ants == 8 else 20.0)

    *_, last = sentences(CURE, truth, noise=noise)
    assert f"{expected}: each of 8 ants delivers" in last
    assert ", one alone " in last


TRAILS_COMPARED = {
    "jointly trained ants that lay trails deliver {} than ants that lay none": (JOINT, OFF),
    "copies that lay trails deliver {} than ants that lay none": (COPIED, OFF),
    "jointly trained ants that lay trails deliver {} than ants whose trails never evaporate": (
        JOINT,
        LASTING,
    ),
    "copies that lay trails deliver {} than ants whose trails never evaporate": (COPIED, LASTING),
}


@pytest.mark.parametrize("words", TRAILS_COMPARED)
def test_whether_the_trail_helps(words: str) -> None:
    way, other = TRAILS_COMPARED[words]
    for factor, verdict in ((0.5, "more"), (2.0, "less")):
        found = sentences(TRAIL, scaled(factor, pheromone=other, way=way))
        where = "at every size from 2" if way == JOINT else "with 2 to 8 ants"
        assert sum(f"{words.format(verdict)} {where}" in sentence for sentence in found) == 1
    who, _, whom = words.partition(" deliver {} than ")
    untold = f"between {who} and {whom} no difference can be told from chance at any size"
    assert sum(untold in sentence for sentence in sentences(TRAIL)) == 1


@pytest.mark.parametrize(
    ("deliveries", "reward", "expected"),
    [
        (2.0, 0.5, "trails pay ants for walking, not for delivering"),
        (0.5, 2.0, "trails bring deliveries that cost reward"),
        (0.5, 0.5, "trails raise reward and deliveries alike"),
        (2.0, 2.0, "trails lower reward and deliveries alike"),
        (2.0, 1.0, "trails change deliveries, but not reward beyond chance"),
        (1.0, 2.0, None),
    ],
)
def test_what_the_trail_pays(deliveries: float, reward: float, expected: str | None) -> None:
    """The factors are those of ants that lay no trails."""
    found = sentences(
        TRAIL,
        scaled(deliveries, pheromone=OFF, way=JOINT),
        reward=lambda pheromone, way, ants: 500.0 * (reward if pheromone == OFF else 1.0),
    )
    paid = [sentence for sentence in found if " reward and " in sentence]
    if expected is None:
        assert paid == []
    else:
        (sentence,) = paid
        assert sentence.startswith(f"In the paper world, {expected}: with ")


@pytest.mark.parametrize(
    ("first", "expected"),
    [
        (lambda ants: 400 // ants, "8 copies deliver sooner than one ant: 50 ticks"),
        (lambda ants: 40 * ants, "8 copies deliver later than one ant: 320 ticks"),
        (lambda ants: 40, "between 8 copies and one ant no difference can be told from chance"),
    ],
)
def test_whether_a_crowd_is_sooner(first: Callable[[int], int], expected: str) -> None:
    copies, jointly = sentences(FIRST, first=first)
    assert expected in copies
    assert expected.replace("copies", "jointly trained ants") in jointly
    assert "0 % of the episodes end without" in copies


def test_episodes_without_a_delivery_are_told() -> None:
    copies, _ = sentences(FIRST, first=lambda ants: -1 if ants == 1 else 40)
    assert "deliver sooner than one ant: 40 ticks" in copies
    assert "100 % of the episodes end without and count in full" in copies


def test_how_far_it_is_from_what_is_possible() -> None:
    cycle, busiest = sentences(POSSIBLE, scaled(1.5, way=OWN, pheromone=OFF), noise=0.01)
    assert "takes one ant 40 ticks, so it can deliver 25 per 1000 ticks" in cycle
    assert "of which a trained one reaches 80 %" in cycle
    assert "food can give 1000 and the queen take 1000 per 1000 ticks" in busiest
    assert "the busiest colony (8 ants, a table per ant, no trails laid) delivers 240" in busiest
    assert "100 times" not in busiest
    assert busiest.endswith("120 % of what so many ants can.")  # as made up
    assert sentences(POSSIBLE, limits=None) == []


def test_one_seed_tells_nothing() -> None:
    found = find(build(of_each({1: 20, 2: 15, 4: 10, 8: 5}), seeds=1))
    text = " ".join(f.sentence for f in found if f.question != POSSIBLE)
    assert "deliver more" not in text
    assert "deliver less" not in text
    assert "sooner" not in text
    assert "does not cure" not in text
    assert "learning cures crowding:" not in text


def test_without_differences_few_are_told() -> None:
    """At most every twentieth answer may err; these 24 are fixed, and none does."""
    for seed_count in (6, 20):
        for question in (CURE, TRAIL):
            text = " ".join(sentences(question, seeds=seed_count, noise=30))
            assert " deliver more than" not in text
            assert " deliver less than" not in text


def test_missing_conditions_leave_out_only_what_needs_them() -> None:
    study = build(ways=(COPIED, JOINT), pheromones=(ON, OFF))
    questions = [f.question for f in find(study)]
    assert questions.count(COPIES) == 2
    assert questions.count(CROWDING) == 3
    assert questions.count(CURE) == 2  # joint against copies, and whether it cures
    assert questions.count(TRAIL) == 2
    alone = find(build(ways=(COPIED,), pheromones=(ON,), sizes=(1,)))
    assert [f.question for f in alone] == [POSSIBLE] * 2


def test_each_arena_is_judged_for_itself() -> None:
    study = build(arenas=("paper", "open"))
    assert {f.arena for f in find(study)} == {"paper", "open"}
    judged = judge_all(study)
    assert set(judged) == {(a, q) for a in ("paper", "open") for q in (
        COPIES, CROWDING, CURE, TRAIL, FIRST)}  # fmt: skip


def verdicts(*signs: tuple[int, int, int]) -> dict[tuple[int, int], Difference]:
    """Differences of (ants, fewer ants, sign); all others cannot be told from 0."""
    found = {(n, less): Difference(0.0, -1.0, 1.0) for n in SIZES for less in SIZES if less < n}
    return found | {(n, less): Difference(s, s - 0.5, s + 0.5) for n, less, s in signs}


def test_peak_and_decline() -> None:
    assert peak(verdicts()) == 1
    assert peak(verdicts((8, 1, 1))) == 2
    assert peak(verdicts((8, 1, 1), (8, 2, 1), (8, 4, 1))) == 8
    assert decline(verdicts()) is None
    assert decline(verdicts((4, 1, -1))) == (4, 1)
    assert decline(verdicts((4, 1, -1), (4, 2, -2))) == (4, 2)
    assert decline(verdicts((2, 1, -1), (8, 2, 1))) is None
    assert decline(verdicts((2, 1, -1), (8, 2, 1), (8, 4, -1))) == (8, 4)


def test_more_differences_at_once_need_wider_intervals() -> None:
    values = np.random.default_rng(0).normal(1, 1, 20)
    one = judge({"a": values})["a"]
    many = judge(dict.fromkeys(range(50), values))
    assert one.low > many[0].low
    assert one.high < many[0].high
    assert one.mean == many[0].mean == pytest.approx(values.mean())
    assert judge({}) == {}


def test_seeds_are_paired() -> None:
    """What a seed adds to all conditions alike does not blur their difference."""
    random = np.random.default_rng(1)
    shared, noise = random.normal(0, 50, 12), random.normal(0, 1, 12)
    assert judge({0: (shared + noise + 3) - shared})[0].sign == 1


def test_comparisons() -> None:
    def difference(sign: int) -> Difference:
        return Difference(sign, sign - 0.5, sign + 0.5)

    signs = {2: 1, 4: 1, 8: -1, 16: 0}
    text = comparison(
        "ants",
        "bees",
        {n: difference(sign) for n, sign in signs.items()},
        {2: 20.0, 4: 50.0, 8: 10.0, 16: 1.0},
        {2: 10.0, 4: 10.0, 8: 20.0, 16: 1.0},
    )
    assert text == (
        "ants deliver more than bees with 2 and 4 ants (clearest with 4: 50 against 10 per 1000 "
        "ticks, 5 times as many) and less with 8 ants (10 against 20 per 1000 ticks, -50 %); with "
        "16 ants no difference can be told from chance"
    )
    nothing = comparison("ants", "bees", {2: difference(0)}, {2: 3.0}, {2: 3.0})
    assert nothing.startswith("between ants and bees no difference can be told from chance with 2")
    one = comparison("ants", "bees", {2: difference(1)}, {2: 3.0}, {2: 0.0})
    assert (
        one
        == "ants deliver more than bees with 2 ants (3 against 0 per 1000 ticks, instead of none)"
    )


def test_numbers_in_words() -> None:
    sizes = (1, 2, 4, 8, 16)
    assert listed((1,), sizes) == "1 ant"
    assert listed((2, 8), sizes) == "2 and 8 ants"
    assert listed((2, 4, 8), sizes) == "2 to 8 ants"
    assert listed((1, 4, 8, 16), sizes) == "1 and 4 to 16 ants"
    assert listed((1, 2, 8), sizes) == "1, 2 and 8 ants"
    assert [figure(x) for x in (0, 7, 7.2, 12.34, 123.4, np.inf)] == [
        *("0", "7", "7.20", "12.3", "123", "-"),
    ]
    assert [percent(x) for x in (0, 0.0123, 0.5, 1.2)] == ["0 %", "1.2 %", "50 %", "120 %"]
    assert [change(2, 1), change(1, 2), change(6, 2)] == ["+100 %", "-50 %", "3 times as many"]
