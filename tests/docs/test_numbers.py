"""Numbers and tables in pages are those of docs/results/data, which commands write."""

import re
import sys

import compare
import numpy as np
import pytest
from command_lines import EXPERIMENTS, ROOT

from taichi_ants import AntsError
from taichi_ants.analysis.behaviour import BEHAVIOURS, DELIVERS
from taichi_ants.analysis.tables import Table

sys.path.insert(0, str(EXPERIMENTS))
import findings
import published

sys.path.remove(str(EXPERIMENTS))

NAMES = [path.stem for path in sorted((ROOT / "docs/results/data").glob("*.json"))]


@pytest.mark.parametrize("page", published.pages(), ids=lambda page: page.stem)
def test_a_page_has_the_published_numbers(page):
    """If this fails after a rerun, run `python experiments/published.py`."""
    text = page.read_text("utf-8")
    assert published.filled(text) == text
    assert not re.search(r"^\s*<!--n", text, re.M)  # which would end the paragraph


@pytest.mark.parametrize("name", NAMES)
def test_each_published_table_is_quoted_by_a_page_and_has_all_its_cells(name):
    texts = [page.read_text("utf-8") for page in published.pages()]
    assert any(re.search(rf"<!-- {name} -->|<!--n {name};", text) for text in texts)
    for table in published.tables(name):
        assert table.rows
        assert {len(row) for row in table.rows} == {len(table.columns)}


def test_a_number_is_that_of_its_cell(tmp_path, monkeypatch):
    monkeypatch.setattr(published, "data_file", lambda name: tmp_path / f"{name}.json")
    rows = [["a", "x", "12\n[11, 13]"], ["a", "y", "7 (8), 9 %"]]
    published.write(tmp_path / "made.json", [Table("", ("one", "other", "mean\nof all"), rows)])
    assert published.tables("made")[0].rows == rows
    wrong = "<!--n made; a; x; mean of all-->10<!--/n-->, <!--n made; y; mean of all!-->\n<!--/n-->"
    right = wrong.replace("10", "12").replace("-->\n", "-->7 (8), 9 %")
    assert published.filled(wrong) == right == published.filled(right)
    page = "before\n<!-- made -->\nold\n<!-- /made -->\nafter"
    new = published.filled(page)
    assert "| a | x | 12<br>[11, 13] |\n" in new
    assert new.startswith("before\n<!-- made -->\n\n|")
    assert published.filled(new) == new
    for place in ("made; a; mean of all", "made; b; mean of all", "made; x; median"):
        with pytest.raises(AntsError, match=r"a page quotes .* cells are there"):
            published.cell(place)


@pytest.mark.slow
def test_a_hundred_policies_of_the_readme_do_what_it_says(tmp_path):
    """One of the 64 configurations of the comparison."""
    one = ["--learners", "dyna_q", "--planning-steps", "5", "--learning-rates", "0.01"]
    one += ["--discounts", "0.99", "--epsilons", "0.5", "--epsilon-decays", "0.995"]
    with pytest.raises(SystemExit):
        compare.main(["--out", str(tmp_path / "one"), "--no-figures", *one])
    assert_policies_are_as_published(tmp_path / "one")


@pytest.mark.long  # it makes the paper's comparison with 100 seeds
def test_a_rerun_of_the_comparison_has_the_published_tables(tmp_path):
    folder = tmp_path / "compare"
    with pytest.raises(SystemExit):
        compare.main(["--out", str(folder), "--no-figures"])
    made = sorted((folder / "tables").glob("*.json"))
    assert len(made) == 6
    for path in made:
        assert path.read_bytes() == published.data_file(path.stem).read_bytes()
    wins = [cells[1] for cells in published.tables("paper_winners")[0].rows]
    assert wins == [f"{100 * share:.0f} %" for share in findings.winners(folder)]
    assert_policies_are_as_published(folder)


def assert_policies_are_as_published(folder):
    codes, counts = np.unique(findings.policies(folder), return_counts=True)
    place = "paper_policies; Dyna-Q (p5) +; terminates"
    for code, count in zip(codes, counts, strict=True):
        assert published.cell(f"{place}; {BEHAVIOURS[code]}; Runs") == f"{count}"
    assert set(findings.policies(folder, "truncates").tolist()) == {DELIVERS}
