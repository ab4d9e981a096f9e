"""The study of colonies as a script: files held against the library."""

from __future__ import annotations

import contextlib
import io

import colony
import pytest
from command_lines import contents, read_csv

SEEDS, EPISODES, TICKS, ROLLOUTS = (3, 4), 4, 80, 2
SMALL = [
    *("study", "--world-kinds", "paper", "small", "--sizes", 1, 3),
    *("--seeds", len(SEEDS), "--seed", SEEDS[0]),
    *("--episodes", EPISODES, "--ticks", TICKS, "--rollouts", ROLLOUTS),
]
FILES = {
    *("conditions.csv", "differences.csv", "seeds.csv", "manifest.json"),
    *("report.html", "report.txt", "study.json"),
    *("tables/colony_elsewhere.json", "tables/colony_glance.json"),
    *(f"figures/{name}.png" for name in ("elsewhere", "rules", "scaling", "training")),
    *(
        f"policies/paper_{rules}_{ants}.npz"
        for rules in ("paper", "foraging", "queueing")
        for ants in (1, 3)
    ),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return the output of one run of the script, and its folder, which is not to be changed."""
    place, out = tmp_path_factory.mktemp("finished"), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out):
        patch.chdir(place)
        with pytest.raises(SystemExit) as ended:
            colony.main([*map(str, SMALL), "--out", "out"])
    assert ended.value.code == 0
    return out.getvalue(), place / "out"


@pytest.mark.slow
def test_all_files_are_there(finished):
    out, folder = finished
    folders = ("blocks", "inputs", "sessions")
    assert {name for name in contents(folder) if not name.startswith(folders)} == FILES
    report = (folder / "report.txt").read_text("utf-8")
    assert out.startswith(report)
    assert len(out.splitlines()) <= 42
    assert out.splitlines()[-1] == "out/report.html"
    assert "Deliveries per 1000 ticks of 3 ants" in report
    assert "2 seeds, too few for a verdict, exploration rate 0.01; in brackets: without" in report
    assert "What does each rule add?" in report
    page = (folder / "report.html").read_text("utf-8")
    assert (
        "The paper&#39;s world, 2 seeds, too few for a verdict, exploration rate 0.01: deliveries"
        in page
    )
    assert "Trained in open worlds, 3 ants, 2 seeds, too few for a verdict" in page
    assert page.count('class="player"') == 3
    rows = read_csv(folder / "conditions.csv")
    # In the paper's world seven rules for one and three ants, and of three rules those that were
    # trained alone, or in open worlds; the latter in small worlds, too.
    assert len(rows) == 7 * 2 + 3 + 3 + 3
