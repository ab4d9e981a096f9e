"""The colony's yardstick in C, a third writing of the rules, and the command."""

from __future__ import annotations

from shutil import which

import colony_in_c
import numpy as np
import pytest
from throughput import compiler

from taichi_ants import AntsError

pytestmark = pytest.mark.skipif(compiler(1) is None, reason="there is no C compiler")


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    try:
        return colony_in_c.load(compiler(2), tmp_path_factory.mktemp("c"), 2)
    except AntsError:  # no compiler has OpenMP
        return colony_in_c.load(compiler(1), tmp_path_factory.mktemp("c"), 1)


@pytest.mark.parametrize("rules", colony_in_c.TASKS)
def test_c_gives_the_same_colonies(rules, library):
    colony = colony_in_c.scattered(colony_in_c.TASKS[rules], 300)
    colony.begin_episode()
    before = {name: array.copy() for name, array in colony.arrays.items()}
    one, two = (colony_in_c.live_in_c(library, colony, 400, threads) for threads in (1, 2))
    assert np.array_equal(one.q_values, two.q_values)
    assert one[1:] == two[1:]
    assert one.deliveries > 20
    assert one.blocked > 10_000
    assert all(np.array_equal(before[name], colony.arrays[name]) for name in before)
    colony_in_c.check_same(library, colony, 400, 2)
    colony.arrays["rewards"][3] += 1  # of C alone
    colony.begin_episode()
    other = colony_in_c.live_in_c(library, colony, 400, 1)
    assert other.returns != one.returns


def run(arguments, capsys):
    with pytest.raises(SystemExit) as end:
        colony_in_c.main(arguments)
    return end.value.code, capsys.readouterr()


@pytest.mark.long
def test_the_command_and_its_guard(library, capsys, monkeypatch):
    monkeypatch.setattr(colony_in_c, "_SECONDS", 0.0)
    few = ["--ants", "300", "--rounds", "1", "--threads", "1"]
    code, said = run(few, capsys)
    assert code == 0
    assert "the paper's" in said.out
    assert "foraging" in said.out
    code, said = run([*few, "--least", "1000"], capsys)
    assert code != 0
    assert "at least 1000 is expected" in said.err
    monkeypatch.setattr(
        colony_in_c, "live_in_c", lambda *_: colony_in_c.Lived(np.zeros(1), 0, 0, 0, 0)
    )
    code, said = run(few, capsys)
    assert code != 0
    assert "returns other results" in said.err


@pytest.mark.parametrize("command", [one for name in ("gcc", "clang") if (one := which(name))])
def test_each_compiler_gives_the_same(command, tmp_path):
    library = colony_in_c.load(command, tmp_path, 1)
    for task in colony_in_c.TASKS.values():
        colony_in_c.check_same(library, colony_in_c.scattered(task, 200), 300, 1)


@pytest.mark.parametrize(
    ("threads", "advice"), [(1, "; set CC to"), (2, "; install its OpenMP, use `--threads 1`, or")]
)
def test_a_compiler_that_fails_is_named(threads, advice, tmp_path):
    broken = tmp_path / "broken"
    broken.write_text("#!/bin/sh\necho here >&2\necho 'error: no omp.h' >&2\nexit 1\n")
    broken.chmod(0o755)
    with pytest.raises(AntsError) as error:
        colony_in_c.load(str(broken), tmp_path, threads)
    assert f"{broken} cannot compile colony.c: error: no omp.h{advice}" in str(error.value)


def test_without_a_compiler(capsys, monkeypatch):
    monkeypatch.setattr(colony_in_c, "compiler", lambda threads: None)
    code, said = run(["--ants", "10"], capsys)
    assert code == 0
    assert said.out.startswith("There is no C compiler")


def test_results_that_differ_are_no_comparison(library, monkeypatch):
    colony = colony_in_c.scattered(colony_in_c.TASKS["foraging"], 50)
    lived = colony_in_c.live_in_c
    monkeypatch.setattr(colony_in_c, "live_in_c", lambda *given: lived(*given)._replace(blocked=-1))
    with pytest.raises(AntsError, match="returns other results"):
        colony_in_c.check_same(library, colony, 5, 1)
