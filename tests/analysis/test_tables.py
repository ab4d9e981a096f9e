"""Numbers and tables as text."""

import math

from taichi_ants.analysis.tables import (
    Table,
    figure,
    interval,
    number,
    percent,
    plain_text,
)
from taichi_ants.errors import count


def test_numbers_as_text() -> None:
    assert number(-0.04) == "0.0"
    assert number(-0.06) == "-0.1"
    assert number(math.nan) == "-"
    assert number(math.inf, 0) == "inf"
    assert interval(-1.0, 2.25, 2) == "[-1.00, 2.25]"
    assert interval(1.0, math.nan) == "-"
    assert (count(1, "seed"), count(0, "seed")) == ("1 seed", "0 seeds")
    assert (count(1, "delivery"), count(2, "delivery")) == ("1 delivery", "2 deliveries")
    assert [figure(x) for x in (0, 7, 7.2, 12.34, 123.4, math.inf)] == [
        *("0", "7", "7.20", "12.3", "123", "-")
    ]
    assert [percent(x) for x in (0, 0.0123, 0.5, 1.2, math.nan)] == [
        *("0 %", "1.2 %", "50 %", "120 %", "-")
    ]


BEES = Table(
    "Bees", ["Who", "How\nmany"], [["a queen", "1\n[1, 1]"]], ["Counted once.", "By hand."]
)


def test_a_table_is_the_same_in_markdown_and_in_a_terminal() -> None:
    assert BEES.markdown() == (
        "**Bees**\n\n| Who | How<br>many |\n| --- | ---: |\n"
        "| a queen | 1<br>[1, 1] |\n\nCounted once.  \nBy hand.\n"
    )
    lines = plain_text(["Insects.", BEES], 40).splitlines()
    assert lines[:3] == ["Insects.", "", "Bees"]
    assert lines[3].split() == ["How"]
    assert [line.split() for line in lines[4:8] if "\u2500" not in line] == [
        *(["Who", "many"], ["a", "queen", "1"], ["[1,", "1]"])
    ]
    assert lines[-2:] == ["Counted once.", "By hand."]
