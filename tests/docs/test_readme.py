"""The README: its code, its numbers, its links and its pictures."""

from __future__ import annotations

import csv
import re
import sys
from collections import Counter

import compare
import numpy as np
import pytest
from command_lines import EXPERIMENTS, ROOT

from taichi_ants.analysis.behaviour import CIRCLES, DELIVERS, WALKS

sys.path.insert(0, str(EXPERIMENTS))
import findings

sys.path.remove(str(EXPERIMENTS))

README = (ROOT / "README.md").read_text("utf-8")
WORDS = " ".join(README.split())
PAPER = (ROOT / "docs" / "results" / "paper.md").read_text("utf-8")


def test_the_ten_lines_print_their_number(capsys):
    code, other = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    [promised] = re.findall(r"print\(.*\)  # (\d+) food items delivered\n", code)
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out == f"{promised}\n"
    exec(compile(code.replace("queueing", "paper"), "README.md", "exec"), {})
    assert f"in the same world, {capsys.readouterr().out.strip()}." in WORDS
    exec(compile(other, "README.md", "exec"), {})


def anchors(text: str) -> set[str]:
    """The anchors of the headings of a page."""
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_links_and_pictures_are_there():
    links = re.findall(r"\]\((?!https?:)([^)#]*)(?:#([^)]*))?\)", README)
    assert len(links) > 20
    for path, anchor in links:
        assert (ROOT / path).exists(), path
        assert not anchor or anchor in anchors((ROOT / path).read_text("utf-8")), anchor
    pictures = re.findall(r'src(?:set)?="([^"]+)"', README)
    assert len(pictures) == 8
    for path in pictures:
        assert (ROOT / path).stat().st_size < 3_000_000, path
    alts = re.findall(r"<img [^>]*alt=\"([^\"]+)\"", README)
    assert len(alts) == README.count("<img ") == README.count("<picture>") == 4


def test_the_third_finding_is_the_table_of_the_guide():
    by_rules = findings.deliveries()
    assert list(by_rules) == ["paper's rules", "A + B + C", "queues"]
    learned, fixed = zip(*by_rules.values(), strict=True)
    assert f"deliver {learned[0]} food items in 1000 ticks" in WORDS
    assert f"they deliver {learned[1]}, and with rules for queues {learned[2]}" in WORDS
    assert f"by hand gain as much: {fixed[0]}, {fixed[1]} and {fixed[2]}" in WORDS
    pairs = [f"{one} and {other}" for one, other in by_rules.values()]
    assert f"paper's rules {pairs[0]}, three rules {pairs[1]}, queues {pairs[2]}" in WORDS


@pytest.mark.slow  # it makes the paper's comparison with 100 seeds
def test_the_first_two_findings_and_the_printed_table(tmp_path, capsys):
    folder = tmp_path / "compare"
    with pytest.raises(SystemExit):
        compare.main(["--out", str(folder), "--no-figures"])
    printed = capsys.readouterr().out
    [table] = re.findall(r"^(Learner  .*?)```", PAPER, re.DOTALL | re.MULTILINE)
    assert table in printed

    behaviours = Counter(findings.policies(folder).tolist())
    walk, circle = behaviours[WALKS], behaviours[CIRCLES]
    assert behaviours[DELIVERS] == 0
    assert walk + circle == 100
    assert f"None of the 100 final policies delivers: {walk} walk back and forth" in WORDS
    assert f"and {circle} circle with the food" in WORDS
    assert f"{walk} walk the trail, {circle} circle at the queen, and none delivers" in WORDS
    assert Counter(findings.policies(folder, "truncates").tolist()) == {DELIVERS: 100}
    with np.load(folder / "runs.npz") as runs:
        best = runs["policy_returns"][runs["behaviours"] == WALKS].max()
    assert f"earn {best} in 600 steps" in WORDS

    q, sarsa, dyna_3, dyna_5 = 100 * findings.winners(folder)
    wins = f"Q-learning in {q:.0f} % of the repetitions, Dyna-Q in {dyna_3 + dyna_5:.0f} %"
    assert f"{wins}, SARSA in {sarsa:.0f} %" in WORDS
    shares = (
        f"SARSA in {sarsa:.0f} %, Dyna-Q (p3) in {dyna_3:.0f} % and Dyna-Q (p5) in {dyna_5:.0f} %"
    )
    assert f"Q-learning in {q:.0f} % of the repetitions, {shares}" in " ".join(PAPER.split())
    with (folder / "table2.csv").open(encoding="utf-8") as file:
        rows = [one for one in csv.DictReader(file) if one["delivery"] == "truncates"]
    typical = [float(one["return_last50_iqm"]) for one in rows]
    assert f"are between {min(typical):.1f} and {max(typical):.1f}" in WORDS
    with (folder / "claims.csv").open(encoding="utf-8") as file:
        verdicts = Counter((one["delivery"], one["verdict"]) for one in csv.DictReader(file))
    total = sum(verdicts.values()) // 2
    cut, end = (
        [verdicts[setting, one] for one in ("supported", "contradicted")]
        for setting in ("truncates", "terminates")
    )
    claims = f"{cut[0]} are supported and {cut[1]} contradicted if deliveries truncate, "
    assert f"{claims}{end[0]} and {end[1]} if they terminate" in WORDS
    assert f"Of the paper's {total} claims" in WORDS
