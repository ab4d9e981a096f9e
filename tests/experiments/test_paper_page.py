"""The page of the comparison: its numbers are those of the tables, and it asks for nothing."""

from __future__ import annotations

import re
from dataclasses import replace
from html import escape, unescape

import pytest
from finished_pages import FACTS, Results, comparison_html, results
from pages import addresses, tables
from paper.claims import HEADLINES, claims_rows
from paper.comparison import Variant
from paper.page import Seen, comparison_page
from synthetic_comparison import subset

from taichi_ants.analysis.tables import number
from taichi_ants.report.page import setting_facts, signed


def page_of(results: Results) -> str:
    """Return the page without baselines, figures, facts and links."""
    comparison, lines, audit = results
    return comparison_page(comparison, [], lines, audit, Seen(), {}, [])


@pytest.fixture(scope="module")
def page() -> str:
    return comparison_html()


def test_the_main_claims_come_first_with_their_verdicts(page: str) -> None:
    answer = page[page.index('<section id="answer">') : page.index('<section id="table2">')]
    rows = tables(answer)[""][1:]
    by_id = {claim.id: (claim, findings) for claim, findings in results().audit.items()}
    expected = [
        [claim.statement, claim.quantity.words, *(one.verdict.value for one in findings.values())]
        for claim, findings in (by_id[name] for name in HEADLINES)
    ]
    for cells, (statement, scope, *verdicts) in zip(rows, expected, strict=True):
        assert cells[0] == f"{statement} ({scope})"
        for cell, verdict in zip(cells[1:], verdicts, strict=True):
            assert cell.startswith(verdict)
    assert f"World: {results().comparison.world}." in unescape(answer)


def test_the_mean_is_told_with_its_own_difference(page: str) -> None:
    """The contrast that decides by the mean may be another one than that by the IQM."""
    told = 0
    for findings in results().audit.values():
        for one in findings.values():
            if one.by_mean and one.by_mean.verdict is not one.verdict:
                verdict, label = one.by_mean.verdict.value, one.by_mean.contrast.label
                words = f"With the mean instead of the IQM, {verdict}: {label}: "
                told += escape(words) in page
    assert told > 0


def test_every_claim_has_a_line_with_the_numbers_of_the_csv(page: str) -> None:
    rows = tables(page[page.index('<section id="claims">') :])[""][1:]
    expected = claims_rows(results().audit)
    assert len(rows) == len(expected) / 2 == 51
    for place, cells in enumerate(rows):
        for column, row in enumerate(expected[2 * place : 2 * place + 2]):
            assert cells[0].startswith(row["statement"])
            assert cells[1] == row["section"]
            assert cells[2 + column] == row["verdict"]
            digits = (
                1 if row["estimator"] == "interquartile mean" or abs(row["effect"]) >= 10 else 2
            )
            told = f"Delivery {row['delivery']}: {row['verdict']} . {row['contrast']}"
            assert told in cells[0]
            if row["verdict"] != "not tested":
                effect = signed(number(row["effect"], digits))
                assert f"{row['contrast']}: {effect} {row['unit']}".rstrip() in cells[0]


def test_minus_signs_are_true_ones_wherever_a_number_stands(page: str) -> None:
    words = re.sub(r"<(script|style|svg).*?</\1>|<[^>]+>", " ", page, flags=re.DOTALL)
    assert "\N{MINUS SIGN}" in words
    assert not re.findall(r"[\s(\[]-[\d.]+", words)
    assert signed("-1.5, [-3, 4] of 1-2 --seeds 5 and Dyna-Q") == (
        "\N{MINUS SIGN}1.5, [\N{MINUS SIGN}3, 4] of 1-2 --seeds 5 and Dyna-Q"
    )


def test_settings_are_facts_with_each_value_once() -> None:
    settings = {
        "version": "1.0",
        "seeds": [3, 4, 5],
        "worlds": [{"food": 1}],
        "training.learner": ["sarsa", "sarsa", "q_learning"],
        "training.epsilon": 0.5,
        "task.life.births": False,
        "task.life.lifespan": None,
        "ants": [16, 4, 16],
    }
    assert setting_facts(settings) == {
        **{"Seeds": "3 to 5", "Learner": "sarsa, q_learning", "Epsilon": "0.5"},
        **{"Life, births": "no", "Ants": "4, 16"},
    }
    assert setting_facts({"seeds": [7]}) == {"Seeds": "7"}


def test_it_asks_for_nothing_and_links_only_to_what_is_there(page: str) -> None:
    assert page.startswith("<!doctype html>")
    found = {one for one in addresses(page) if not one.startswith(("#", "data:"))}
    assert found == {"claims.csv", "manifest.json"}
    assert "default-src 'none'" in page
    assert len(page) < 1_500_000


def test_what_comes_from_the_user_is_escaped(page: str) -> None:
    for text in (*FACTS.values(), "As it <should>", "a <policy>"):
        assert escape(text, quote=False).replace("'", "&#39;") in page
    comparison = replace(results().comparison, world="<script>alert(1)</script>.txt")
    nasty = Variant("<img src=x onerror=alert(1)>")
    rows = tuple(row._replace(variant=nasty) for row in comparison.rows[:16])
    found = subset(comparison, range(16), 2, 30)
    told = page_of(Results.of(replace(found, rows=rows)))
    assert "<script>alert" not in told
    assert "<img src=x" not in told
    assert "&lt;script&gt;alert(1)&lt;/script&gt;.txt" in told
