"""The study of the double bridge as a command."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from command_lines import call, load

from taichi_ants.analysis import bridge as analysis


@pytest.mark.slow
def test_it_writes_counts_and_a_report_and_shows_them_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(analysis, "DESIGNS", (analysis.Design(),))
    arguments = ["--seeds", 2, "--seed", 5, "--episodes", 2, "--ticks", 20]
    arguments += ["--evaluation-ticks", 50, "--no-figures", "--out", tmp_path / "out"]
    status, said, _ = call("bridge", arguments, capsys)
    assert status == 0
    assert said.count("queueing") == len(analysis.BRIDGES) - 1 + len(analysis.LOADS)
    assert "means over 2 seeds, too few for" in said
    with (tmp_path / "out" / "shares.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(analysis.BRIDGES) * 2 * len(analysis.LOADS) * analysis.WINDOWS
    assert {row["seed"] for row in rows} == {"5", "6"}
    status, again, _ = call("bridge", arguments, capsys)
    assert "already has these results" in again
    status, _, err = call("bridge", [*arguments, "--evaluation-ticks", 60], capsys)
    assert status == 2
    assert "(evaluation_ticks is 50 instead of 60)" in err


def test_quick_leaves_alone_what_is_given() -> None:
    settings = load("bridge").parse_arguments(["--quick", "--seeds", "7"])
    assert (settings.seeds, settings.episodes) == (7, 20)
    assert settings.out == Path("results", "bridge-quick")
