"""The study in three sentences, on made-up data where it is so and where it is not."""

from __future__ import annotations

from synthetic_colony_study import Truth, build, proportional

from taichi_ants.analysis.colony.results import Results
from taichi_ants.analysis.colony.study import ABC, ALONE, JOINT, PAPER, SILENT
from taichi_ants.analysis.colony.tables import on_one_screen
from taichi_ants.analysis.tables import plain_text


def told(truth: Truth = proportional, **settings: object) -> list[str]:
    study = build(truth, **settings)
    return list(Results.of(study).answer)


def times(factor: float, rules: str, way: str = JOINT) -> Truth:
    """Twenty for each ant, but so many times as much for one design."""

    def truth(of: str, trained: str, ants: int) -> float:
        return 20.0 * ants * (factor if (of, trained) == (rules, way) else 1.0)

    return truth


def test_each_sentence_says_more_less_or_open() -> None:
    for number, (design, other) in enumerate(
        (((ABC, JOINT), PAPER), ((PAPER, JOINT), SILENT), ((ABC, JOINT), ALONE))
    ):
        assert " deliver more than " in told(times(2, *design))[number], other
        assert " deliver less than " in told(times(0.5, *design))[number], other
        sentence = told(noise=20)[number]
        assert sentence.startswith("Whether 8 ants ")
        assert " stays open: " in sentence


def test_the_numbers_are_the_means_of_the_largest_colonies() -> None:
    first = told(times(2, ABC), noise=0, arenas=("paper", "open"))[0]
    assert first == (
        "8 ants with all three rules deliver more than under the paper's rules: 320 against 160 in "
        "the paper's world and 320 against 160 in open worlds."
    )


def test_worlds_that_disagree_are_told_apart() -> None:
    study = dict(build(proportional, noise=5, arenas=("paper", "open", "piles")))
    for condition, measures in study.items():
        if condition.rules == ABC and condition.arena != "piles":
            factor = 2.0 if condition.arena == "paper" else 0.5
            study[condition] = {**measures, "deliveries": measures["deliveries"] * factor}
    sentence = Results.of(study).answer[0]
    more, less, still = sentence.split("; ")
    assert more.startswith(
        "8 ants with all three rules deliver more than under the paper's rules: "
    )
    assert more.endswith(" in the paper's world")
    assert less.startswith("less than under the paper's rules: ")
    assert less.endswith(" in open worlds")
    assert still.startswith("the difference stays open: ")
    assert still.endswith(" with three far piles.")


def test_few_seeds_say_that_they_cannot_tell() -> None:
    sentence = told(noise=20, seeds=3)[0]
    assert sentence.startswith("3 seeds are too few to tell whether 8 ants with all three rules ")
    assert told(seeds=1)[1].startswith("1 seed is too few to tell whether 8 ants that lay trails ")
    clear = told(times(2, ABC), noise=0.1, seeds=9)[0]
    assert clear.startswith("9 seeds are too few to tell whether 8 ants with all three rules ")
    assert " deliver more than " in told(times(2, ABC), noise=0.1, seeds=10)[0]


def test_one_ant_alone_answers_nothing() -> None:
    for sentence in told(sizes=(1,)):
        assert sentence.startswith("Whether ants ")
        assert sentence.endswith(" is not tested here.")


def test_it_fits_on_one_screen() -> None:
    study = build(arenas=("paper", "open", "piles", "rocks"))
    found = Results.of(study)
    lines = plain_text(on_one_screen(found.rows, found.judged, found.answer), 79).splitlines()
    assert len(lines) <= 37
    assert max(map(len, lines)) <= 79
    [row] = [line.split() for line in lines if line.startswith("A + B + C  ")]
    means = [
        one["deliveries_mean"]
        for one in found.rows
        if (one["rules"], one["way"], one["ants"]) == (ABC, JOINT, 8)
    ]
    assert row[5::4] == [f"{mean:.0f}" for mean in means[:3]]
    assert row[6::4] == [f"({1.5 * mean:.0f})," for mean in means[:3]]
    assert any(line.startswith("  Do the trails help? ") for line in lines)
    elsewhere = build(ways=("open",), arenas=("rocks",))
    found = Results.of(elsewhere)
    text = plain_text(on_one_screen(found.rows, found.judged, found.answer), 79)
    assert "rocks" in text
