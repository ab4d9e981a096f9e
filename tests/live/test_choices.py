"""What pages can choose from: the rules make the tasks that have names."""

from __future__ import annotations

import re
from itertools import combinations

import pytest
from command_lines import ROOT

from taichi_ants import task
from taichi_ants.commands import watch
from taichi_ants.live.choices import LIFE, RULES, TASKS, Choices, rules_of, task_of


@pytest.mark.parametrize("name", TASKS)
def test_rules_make_the_tasks_that_have_names(name):
    rules = getattr(task, name)()
    assert TASKS[name][1] == rules
    assert task_of(rules_of(rules), rules.observation) == rules


def test_every_set_of_rules_is_a_task_and_each_rule_changes_it():
    for n in range(len(RULES) + 1):
        for chosen in combinations(RULES, n):
            made = task_of(chosen, "paper")
            assert task_of(rules_of(made), "paper") == made
    for rule in RULES:
        assert task_of([rule], "paper") != task_of([], "paper")
    assert set(LIFE) < set(RULES)


def test_rules_of_others_have_no_names():
    assert rules_of(task.Task(delivery="continuing")) is None


def test_what_the_command_begins_with_can_be_chosen():
    setup = Choices({}).setup(watch.START)
    assert Choices({}).chosen(setup) == {**watch.START, "rules": rules_of(setup.task)}
    assert setup.learns


def test_the_python_of_the_guide_works(tmp_path, monkeypatch):
    text = (ROOT / "docs" / "watching.md").read_text(encoding="utf-8")
    names: dict = {}
    monkeypatch.chdir(tmp_path)
    exec("\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)), names)
    assert names["session"].ticks == 2500
    assert (tmp_path / "mine.npz").exists()
