"""The page of the comparison: its numbers are those of the tables, and it asks for nothing."""

import re
from dataclasses import replace
from html import escape, unescape

import pytest
from finished_pages import FACTS, Results, comparison_html, results
from paper.claims import claims_rows
from paper.comparison import Variant
from paper.page import Seen, comparison_page
from synthetic_comparison import subset

from taichi_ants.analysis.tables import number
from taichi_ants.report.page import signed


def page_of(results: Results) -> str:
    """Return the page without baselines, figures, facts and links."""
    comparison, lines, audit = results
    return comparison_page(comparison, [], lines, audit, Seen(), {}, [])


@pytest.fixture(scope="module")
def page() -> str:
    return comparison_html()


def cells_of(row: str) -> list[str]:
    """Return the texts of the cells of a row of a table."""
    cells = re.findall(r"<t[dh].*?>(.*?)</t[dh]>", row, re.S)
    return [" ".join(unescape(re.sub(r"<.*?>", " ", cell)).split()) for cell in cells]


def test_every_claim_has_a_line_with_the_numbers_of_the_csv(page: str) -> None:
    table = page.partition('<section id="claims">')[2].partition("</table>")[0]
    rows = [cells_of(row) for row in re.findall(r"<tr.*?</tr>", table, re.S)][1:]
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


def test_it_asks_for_nothing_and_links_only_to_what_is_there(page: str) -> None:
    assert page.startswith("<!doctype html>")
    markup = re.sub(r"<script.*?</script>", "", page, flags=re.S)
    linked = re.findall(r"""(?:href|src|action)=["']?([^"'\s>]+)""", markup)
    found = {one for one in linked if not one.startswith(("#", "data:"))}
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
