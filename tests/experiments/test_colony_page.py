"""The page of the colony's study: its numbers are those of the tables, and it asks for nothing."""

from __future__ import annotations

import re

import pytest
from colony import colony_page
from colony_findings import Results, difference_rows
from finished_pages import colony_html, study_results
from pages import addresses, tables
from synthetic_colony_study import build

from taichi_ants.analysis.tables import number, sentence
from taichi_ants.report.page import signed

BARE = {"drawings": [], "players": [], "facts": {}, "files": []}


def words_of(page: str) -> str:
    """What one reads, with all that is marked up."""
    return re.sub(r"<script.*?</script>|<style.*?</style>", "", page, flags=re.DOTALL)


@pytest.fixture(scope="module")
def page() -> str:
    return colony_html()


def test_the_main_findings_come_first_with_their_verdicts(page: str) -> None:
    rows = tables(page[: page.index('<section id="table">')])[""][1:]
    by_statement = {
        (sentence(series.statement), world_kind): findings
        for (world_kind, series), findings in study_results().judged.items()
    }
    assert len(rows) == 3
    for statement, *cells in rows:
        for world_kind, cell in zip(("paper", "open"), cells, strict=True):
            assert cell.startswith(by_statement[statement, world_kind][8, 8].verdict.value)


def test_every_finding_has_a_line_with_the_numbers_of_the_csv(page: str) -> None:
    rows = tables(page[page.index('<section id="findings">') :])[""][1:]
    assert len(rows) == len(study_results().judged)
    assert sum(len(cells) for cells in rows) == 3 * len(rows)
    whole = " ".join(cells[0] for cells in rows)
    for row in difference_rows(study_results().judged):
        digits = 1 if abs(row["mean"]) >= 10 else 2
        assert signed(f"Difference: {number(row['mean'], digits)}") in whole
    firsts = [cells for cells in rows if cells[0].startswith("Ants with all three rules deliver m")]
    assert {cells[2] for cells in firsts[:1]} == {"supported"}


def test_it_asks_for_nothing(page: str) -> None:
    found = {one for one in addresses(page) if not one.startswith(("#", "data:"))}
    assert found == {"seeds.csv"}
    assert len(page) < 1_500_000


def test_few_seeds_are_said_and_give_no_verdict() -> None:
    measured = build(seeds=8, sizes=(1, 4), world_kinds=("paper", "rocks"))
    page = colony_page(Results.of(measured), **BARE)
    assert page.count("8 seeds, too few for a verdict") >= 5  # byline, lead, three tables
    assert "too few seeds" in page
    for verdict in ("supported", "contradicted", "undecided"):
        assert f'class="v v-{verdict}"' not in page
