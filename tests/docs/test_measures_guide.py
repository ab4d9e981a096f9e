"""The Python of docs/how-to/measures.md works, and its tables list every measure and array."""

from __future__ import annotations

import re
from dataclasses import fields

import pytest
from command_lines import ROOT
from guides import blocks

from taichi_ants import Colony, TrainingConfig, measures, worlds
from taichi_ants.learners.policies import trail_follower
from taichi_ants.measures.measure import MEASURES
from taichi_ants.rendering import Snapshot
from taichi_ants.task import foraging

GUIDE = (ROOT / "docs/how-to/measures.md").read_text("utf-8")


@pytest.mark.slow  # 40 colonies
def test_the_example_prints_what_the_guide_shows(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    [code] = blocks("how-to/measures", "Record measures")
    exec(compile(code, "measures.md", "exec"), {})
    shown = GUIDE.split("The example prints\n\n```\n")[1].split("```")[0]
    assert capsys.readouterr().out == shown
    assert (tmp_path / "measures.png").exists()


def test_your_own_measures_work_as_the_guide_writes_them(monkeypatch):
    monkeypatch.setattr(MEASURES, "yours", {})
    follows = {"sharing": "frozen", "q_values": trail_follower()}
    rule = TrainingConfig("q_learning", 0.1, 0.9, 0.0, 1.0)
    colony = Colony(worlds.build("double_bridge"), None, rule, ants=9, **follows)
    names = {"colony": colony, "Colony": Colony, "rule": rule, "task": foraging()}
    names |= {"trail_follower": trail_follower, "worlds": worlds}
    for kind, code in re.findall(r"```(\w*)\n(.*?)```", GUIDE, re.DOTALL):
        if not kind and "measures" in code:
            exec(compile(code.replace("2000", "200"), "measures.md", "exec"), names)
    yours = {"outside", "wasted", "worst"}
    assert set(measures.names()) - measures.BUILT_IN.keys() == yours
    assert {"regions.short", "regions.long"} == names["result"].series.values.keys()
    assert len(colony.run(1, 40, measures=["outside", "wasted"], every=20).series.values) == 2


def test_the_tables_are_complete():
    part = GUIDE.split("## Built-in measures")[1].split("## ")[0]
    listed = dict(re.findall(r"^\| `(\w+)` \|.*\| ?([^|]*) \|$", part, re.MULTILINE))
    units = {name: one.unit for name, one in measures.BUILT_IN.items()}
    assert listed == units
    arrays = GUIDE.split("The snapshot has these arrays")[1]
    for one in fields(Snapshot):
        assert f"`{one.name}`" in arrays, one.name
