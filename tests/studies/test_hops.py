"""The functions that a value passes through, as the page on the architecture lists them."""

import re
import traceback

import paper.table2
import pytest
from command_lines import ROOT, call

from taichi_ants.engines.launch import Launch
from taichi_ants.measures.finished import Run
from taichi_ants.studies.points import RunPoint
from taichi_ants.studies.store import Store

TINY = [
    *("--seeds", 1, "--episodes", 2, "--max-steps", 30, "--learners", "q_learning"),
    *("--learning-rates", 0.1, "--discounts", 0.9, "--epsilons", 0.3, "--epsilon-decays", 0.9),
    *("--delivery", "terminates", "--no-figures", "--threads", 1),
]
ARRIVALS = (  # functions that get the value, and whether they are on its way
    *((RunPoint, "__post_init__", False), (Launch, "__call__", True), (Store, "add", True)),
    *((Run, "of_lone_ant", False), (Store, "read", True)),
    *((paper.table2, "centres_of", False), (paper.table2, "best_of", False)),
)
OWN = (f"{ROOT}/taichi_ants/", f"{ROOT}/experiments/")
# Other launches: to compile a kernel, to evaluate and follow policies, and to train an example.
ASIDE = {"compiled", "evaluate", "what_policies_do", "trained", "policy_rows"}


@pytest.mark.slow
def test_settings_pass_at_most_twenty_functions_until_table_2(tmp_path, capsys, monkeypatch):
    passed = set()

    def watch(owner, name, is_on_way):
        real = getattr(owner, name)

        def watching(*given, **named):
            stack = [f for f in traceback.extract_stack() if f.filename.startswith(OWN)]
            own = [f.name for f in stack if f.name[0] != "<"]
            if not ASIDE & {*own}:
                passed.update([*own, name] if is_on_way else own)
            return real(*given, **named)

        monkeypatch.setattr(owner, name, watching)

    for arrival in ARRIVALS:
        watch(*arrival)
    assert call("compare", [*TINY, "--out", tmp_path / "out"], capsys)[0] == 0
    page = (ROOT / "docs/develop/architecture.md").read_text(encoding="utf-8")
    table = page.partition("Functions on the way")[2].split("\n\n")[2]
    listed = re.findall(r"`(?:[\w.]+\.)?(\w+)`", table)
    assert len(listed) <= 20
    assert passed == set(listed)
