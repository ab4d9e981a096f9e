"""Studies that grow, and shards that are merged: the bytes of one plain run, by any way."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_lines import (
    assert_one_sentence,
    assert_same_results,
    call,
    contents,
    promptly,
    start,
)

from taichi_ants.files import archives
from taichi_ants.studies.points import ColonyPoint, RunPoint
from taichi_ants.studies.state import state

RUNS = """
kind = "runs"
measures = ["return_all", "greedy_deliveries"]
seeds = [7, 2, 5, 1]
episodes = 6
max_steps = 60
rollouts = 3
[training]
learner = "sarsa"
discount = 0.9
epsilon = 0.3
epsilon_decay = 0.99
[vary]
training.learning_rate = [0.01, 0.1, 0.2]
task.rewards.shaping = [1, 0]
"""
COLONY = """
kind = "colony"
measures = ["deliveries", "entropy"]
measure_every = 25
seeds = 4
ants = 4
episodes = 2
ticks = 60
rollouts = 2
[world]
preset = "open"
ranges = [12, 12, 12]
per_seed = true
[task]
evaporation_in_training = true
life.regrowth = 0
[training]
learner = "sarsa"
learning_rate = 0.1
discount = 0.9
epsilon = 0.3
epsilon_decay = 0.9
[vary]
task.rewards.shaping = [1, 0]
"""
DRAWN = (
    RUNS.split("[vary]")[0].replace("kind =", 'design = "sobol"\nsamples = 8\nkind =')
    + """
[vary]
training.learning_rate = {from = 0.01, to = 0.2, scale = "log"}
task.rewards.shaping = [1, 0]
"""
)
SWEEPS = {"runs": RUNS, "colony": COLONY, "drawn": DRAWN}
FEWER = {
    "runs": RUNS.replace("[7, 2, 5, 1]", "[5, 7]").replace("[0.01, 0.1, 0.2]", "[0.2, 0.01]"),
    "colony": COLONY.replace("seeds = 4", "seeds = 2").replace("[1, 0]", "[0]"),
    "drawn": DRAWN.replace("samples = 8", "samples = 4"),
}


@pytest.fixture
def sweep(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for kind in (RunPoint, ColonyPoint):
        monkeypatch.setattr(kind, "runs_of_a_block", 3)

    def called(text, out, *more):
        Path("my.toml").write_text(text, "utf-8")
        return call("sweep", ["my.toml", "--out", out, "--no-figures", *more], capsys)

    return called


@pytest.mark.parametrize("kind", SWEEPS)
def test_a_finished_sweep_grows_without_repeating_anything(kind, sweep, monkeypatch):
    assert sweep(SWEEPS[kind], "plain")[0] == 0
    assert sweep(FEWER[kind], "grown")[0] == 0
    owner = ColonyPoint if kind == "colony" else RunPoint
    done, real = [], owner.do

    def do(points, seeds, *more):
        done.extend((point, seed) for point in points for seed in seeds)
        return real(points, seeds, *more)

    monkeypatch.setattr(owner, "do", staticmethod(do))
    assert sweep(SWEEPS[kind], "grown")[::2] == (0, "")
    assert len(done) == len(set(done)) == {"runs": 24 - 8, "colony": 8 - 2, "drawn": 32 - 16}[kind]
    assert_same_results("plain", "grown")


def test_unfinished_work_grows_too(sweep, monkeypatch):
    assert sweep(RUNS, "plain")[0] == 0
    real = RunPoint.do

    def stops(points, seeds, *more):
        if 0.2 in (point.training.learning_rate for point in points):
            raise KeyboardInterrupt
        return real(points, seeds, *more)

    monkeypatch.setattr(RunPoint, "do", staticmethod(stops))
    fewer = RUNS.replace("[7, 2, 5, 1]", "[7, 2]")
    assert sweep(fewer, "grown")[0] == 130
    monkeypatch.setattr(RunPoint, "do", staticmethod(real))
    assert sweep(RUNS, "grown")[0] == 0
    assert_same_results("plain", "grown")


@pytest.mark.parametrize(
    ("text", "change", "words"),
    [
        (RUNS, ("episodes = 6", "episodes = 7"), "of other settings (episodes is 6 instead of 7)"),
        (RUNS, ("discount = 0.9\n", "discount = 0.8\n"), "discount is 0.9 instead of 0.8"),
        (RUNS, ("[7, 2, 5, 1]", "[7, 2, 5]"), "that this study lacks (seed 1); add them"),
        (RUNS, ("[0.01, 0.1, 0.2]", "[0.01, 0.1, 0.3]"), "lacks (training.learning_rate 0.2)"),
        (RUNS, ("return_all", "return_last50"), "not the same measures"),
        (RUNS, ("[training]", 'task.delivery = "truncates"\n[training]'), "task.delivery is "),
        (DRAWN, ("samples = 8", "samples = 4"), "that this study lacks (4 samples); add them"),
        (DRAWN, ("samples = 8", "samples = 8\ndesign_seed = 3"), "(design_seed is 0 instead of 3)"),
        (DRAWN, ("to = 0.2", "to = 0.3"), "(not the same training.learning_rate, vary)"),
        (DRAWN, ('"sobol"', '"random"'), "(design is 'sobol' instead of 'random')"),
    ],
)
def test_what_contradicts_is_refused_by_name(text, change, words, sweep):
    assert sweep(text, "a")[0] == 0
    before = contents(Path("a"))
    enough = ("episodes = 6", "episodes = 50") if "last50" in change[1] else ("", "")
    status, _, err = sweep(text.replace(*change).replace(*enough), "a")
    assert status == 2
    assert_one_sentence(err)
    assert words in err
    assert contents(Path("a")) == before


def test_altered_results_do_not_grow(sweep):
    assert sweep(FEWER["runs"], "a")[0] == 0
    with open("a/runs.csv", "a") as file:
        file.write("0,0,0,0,0\n")
    status, _, err = sweep(RUNS, "a")
    assert status == 2
    assert "has changed since they were finished" in err


@pytest.mark.parametrize("kind", SWEEPS)
def test_three_shards_merge_to_the_bytes_of_one_run(kind, sweep, capsys):
    assert sweep(SWEEPS[kind], "plain")[0] == 0
    for n in (1, 2, 3):
        status, out, err = sweep(SWEEPS[kind], f"s{n}", "--shard", f"{n}/3")
        assert (status, err) == (0, "")
        assert f"Shard {n} of 3 is finished in s{n}/" in out
    Path("my.toml").unlink()
    shutil.copytree("s1", "once more")  # overlaps that are the same are allowed
    status, _, err = call("merge", ["s3", "s1", "once more", "s2", "--out", "merged"], capsys)
    assert (status, err) == (0, "")
    assert_same_results("plain", "merged")


def test_shards_in_one_folder_need_no_merge(sweep):
    assert sweep(RUNS, "plain")[0] == 0
    for n in (2, 1):
        assert sweep(RUNS, "all", "--shard", f"{n}/2")[0] == 0
    assert sweep(RUNS, "all")[0] == 0
    assert_same_results("plain", "all")


def test_shards_that_do_not_fit_are_refused(sweep, capsys):
    for n in (1, 2):
        assert sweep(RUNS, f"s{n}", "--shard", f"{n}/3")[0] == 0
    assert sweep(RUNS.replace("seeds = [7,", "seeds = [8,"), "other", "--shard", "3/3")[0] == 0
    assert sweep(FEWER["runs"], "finished")[0] == 0

    def refused(*folders):
        status, _, err = call("merge", [*folders, "--out", "merged"], capsys)
        assert status == 2
        assert_one_sentence(err)
        assert not Path("merged").exists()
        return err

    assert "8 of 24 runs are missing in these folders; give shard 3 of 3 too" in refused("s1", "s2")
    assert "not shards of the same work (seeds differ)" in refused("s1", "s2", "other")
    assert "'finished' has finished results, not a shard" in refused("s1", "finished")
    assert "'nothing' does not exist" in refused("s1", "nothing")
    assert sweep(RUNS, "s3", "--shard", "3/3")[0] == 0
    shutil.copytree("s1", "wrong")
    for path in Path("wrong/unfinished/blocks").iterdir():
        arrays = archives.read(path)
        arrays["value_return_all"] = arrays["value_return_all"] + 1
        archives.write(path, arrays, compress=False)
    err = refused("s1", "s2", "wrong", "s3")
    assert "'s1' and 'wrong' have different results for training.learning_rate 0.01, " in err


@pytest.mark.parametrize("part", ["header", "array"])
def test_a_damaged_block_of_a_shard_is_computed_again_by_its_command(part, sweep, capsys):
    assert sweep(RUNS, "plain")[0] == 0
    for n in (1, 2):
        assert sweep(RUNS, f"s{n}", "--shard", f"{n}/2")[0] == 0
    path = blocks_of("s2")[0]
    content = bytearray(path.read_bytes())
    first, *_, header = (one.start() for one in re.finditer(rb"\x93NUMPY", content))
    content[(header if part == "header" else first) + 130] ^= 1  # after NumPy's 128 bytes
    path.write_bytes(content)
    before = contents(Path("s2"))
    status, _, err = call("merge", ["s1", "s2", "--out", "merged"], capsys)
    assert status == 2
    assert_one_sentence(err)
    assert f"'{path}' is damaged; run the command of the shard in 's2' again" in err
    assert contents(Path("s2")) == before
    assert not Path("merged").exists()
    status, _, err = sweep(RUNS, "s2", "--shard", "2/2")
    assert status == 0
    assert "is damaged or has other settings, so it is computed again" in err
    assert call("merge", ["s1", "s2", "--out", "merged"], capsys)[::2] == (0, "")
    assert_same_results("plain", "merged")


def test_a_merge_that_was_killed_counts_the_runs_of_all_shards(sweep, capsys, monkeypatch):
    for n in (1, 2):
        assert sweep(RUNS, f"s{n}", "--shard", f"{n}/2")[0] == 0
    with monkeypatch.context() as patch:
        patch.setattr("taichi_ants.commands.merge.started", lambda *given: None)
        assert call("merge", ["s1", "s2", "--out", "merged"], capsys)[0] == 0
    assert "unfinished: 24 of 24 runs done" in call("status", ["merged"], capsys)[1]


def test_a_merge_replaces_other_results_only_if_asked(sweep, capsys):
    assert sweep(FEWER["runs"], "merged")[0] == 0
    assert sweep(RUNS.replace("seeds = [7,", "seeds = [8,"), "other")[0] == 0
    assert sweep(RUNS, "s1", "--shard", "1/1")[0] == 0
    for out in ("merged", "other"):
        status, _, err = call("merge", ["s1", "--out", out], capsys)
        assert status == 2
        assert "--force" in err
        assert call("merge", ["s1", "--out", out, "--force"], capsys)[::2] == (0, "")
        assert_same_results("merged", out)


@pytest.mark.parametrize("shard", ["4/3", "0/3", "2", "a/b", "1/0", "-1/3"])
def test_shards_that_do_not_exist_are_refused(shard, sweep):
    status, _, err = sweep(RUNS, "a", f"--shard={shard}")
    assert status == 2
    assert_one_sentence(err)
    assert "write I/N" in err


def test_status_and_rows_of_work_in_progress(sweep, capsys, monkeypatch):
    real, seen = RunPoint.do, []

    def fails(points, seeds, *more):
        if 0.2 in (point.training.learning_rate for point in points) and 1 in seeds:
            raise KeyError("a plugin")
        seen.append((call("status", ["a"], capsys), Path("a/unfinished/rows/runs.csv")))
        seen[-1] = seen[-1][0], seen[-1][1].read_text() if seen[-1][1].exists() else ""
        return real(points, seeds, *more)

    monkeypatch.setattr(RunPoint, "do", staticmethod(fails))
    status, _, err = sweep(RUNS, "a")
    assert status == 1
    assert_one_sentence(err)
    assert (
        "2 blocks failed: task.rewards.shaping 1, training.learning_rate 0.2, seed 1 (KeyEr" in err
    )
    (status, out, _), rows = seen[-1]
    assert status == 0
    assert out.splitlines()[0] == "a"
    assert "unfinished: 19 of 24 runs done (79 % of the work), in 9 blocks" in out
    monkeypatch.setattr(RunPoint, "do", staticmethod(real))
    _, out, _ = call("status", ["a"], capsys)
    assert out.count("failed: task.rewards.shaping ") == 2
    assert "22 of 24 runs done" in out
    partial = Path("a/unfinished/rows/runs.csv").read_text().splitlines()
    assert sweep(RUNS, "a")[0] == 0
    final = Path("a/runs.csv").read_text().splitlines()
    assert partial[0] == final[0]
    assert set(partial) < set(final)
    assert len(partial) == 23
    assert rows.splitlines()[0] == final[0]
    _, out, _ = call("status", ["a"], capsys)
    assert "finished: results with 24 runs, since" in out
    assert call("status", ["nothing"], capsys)[0] == 2


def test_tables_are_written_as_parquet_too(sweep, capsys, monkeypatch):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "pyarrow", None)
        status, _, err = sweep(COLONY, "whole", "--parquet")
        assert status == 2
        assert 'pip install -e ".[parquet]"' in err
    assert sweep(COLONY, "plain")[0] == 0
    before = contents(Path("plain"))
    real, seen = ColonyPoint.do, []

    def looks(*arguments):
        rows = Path("whole/unfinished/rows")
        if rows.exists():
            seen.append([pandas.read_parquet(rows / f"{n}.parquet") for n in ("runs", "series")])
        return real(*arguments)

    monkeypatch.setattr(ColonyPoint, "do", staticmethod(looks))
    assert sweep(COLONY, "whole", "--parquet")[0] == 0
    assert sweep(COLONY, "plain", "--parquet")[0] == 0  # added to finished results
    assert sweep(COLONY, "plain", "--parquet")[0] == 0
    tables = {"runs", "series", "summary"}
    assert {one.stem for one in Path("plain").glob("*.parquet")} == tables
    Path("plain/series.parquet").unlink()  # it is made again
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "pyarrow", None)
        assert "pip install" in sweep(COLONY, "plain", "--parquet")[2]
    assert sweep(COLONY, "plain", "--parquet")[0] == 0
    assert (
        before.items() - {("manifest.json", before["manifest.json"])}
        <= contents(Path("plain")).items()
    )
    for name in tables:
        table = pandas.read_parquet(f"whole/{name}.parquet")
        pandas.testing.assert_frame_equal(table, pandas.read_parquet(f"plain/{name}.parquet"))
        text = pandas.read_csv(f"plain/{name}.csv")
        pandas.testing.assert_frame_equal(table, text, check_dtype=False)
    runs, series = seen[-1]
    assert len(runs) == 7  # of 8, in blocks of 3 seeds and of 1
    assert runs.dtypes["deliveries"] == "float64"
    assert series.dtypes["tick"] == series.dtypes["seed"] == "int64"
    whole = pandas.read_parquet("whole/runs.parquet")
    parts = runs.merge(whole, "inner")
    assert len(parts) == len(runs)
    assert call("archive", ["plain"], capsys)[0] == 0
    status, out, _ = call("reproduce", ["plain.zip"], capsys)
    assert status == 0
    assert "equal      series.parquet" in out


def blocks_of(folder):
    return sorted(Path(folder, "unfinished/blocks").iterdir(), key=lambda one: one.stat().st_mtime)


def test_the_time_left_does_not_count_kept_results_as_new(sweep, capsys, monkeypatch):
    assert sweep(FEWER["runs"], "a")[0] == 0
    real, done = RunPoint.do, []

    def stops(*arguments):
        if done:
            raise KeyboardInterrupt
        done.append(arguments[:2])
        return real(*arguments)

    monkeypatch.setattr(RunPoint, "do", staticmethod(stops))
    assert sweep(RUNS, "a")[0] == 130
    ((points, seeds),) = done
    new = len(points) * len(seeds)
    began = Path("a/unfinished/manifest.json").stat().st_mtime
    os.utime(blocks_of("a")[-1], (began, began + 360))
    _, out, _ = call("status", ["a"], capsys)
    assert f"unfinished: {8 + new} of 24 runs done" in out
    assert f"left: about {360 * (16 - new) / new / 60:.0f} minutes" in out


def test_the_time_left_before_the_first_block_of_a_new_process(sweep, capsys, monkeypatch):
    real, stop_after = RunPoint.do, 3

    def stops(*arguments):
        nonlocal stop_after
        stop_after -= 1
        if stop_after < 0:
            raise KeyboardInterrupt
        return real(*arguments)

    monkeypatch.setattr(RunPoint, "do", staticmethod(stops))
    assert sweep(RUNS, "a")[0] == 130
    done = sum(int(one) for one in re.findall(r"(\d+) of 24", call("status", ["a"], capsys)[1]))
    began = Path("a/unfinished/manifest.json").stat().st_mtime - 1000
    os.utime("a/unfinished/manifest.json", (began, began))
    for path in blocks_of("a"):
        os.utime(path, (began, began + 360))
    assert sweep(RUNS, "a")[0] == 130
    _, out, _ = call("status", ["a"], capsys)
    assert f"left: about {360 * (24 - done) / done / 60:.0f} minutes" in out


def test_a_finished_shard_is_not_unfinished(sweep, capsys):
    assert sweep(RUNS, "a", "--shard", "2/3")[0] == 0
    _, out, _ = call("status", ["a"], capsys)
    assert "  finished: shard 2 of 3, 8 runs, in " in out
    assert "unfinished" not in out
    assert "of all shards" not in out
    Path("a/unfinished/failed.json").write_text("{")  # damaged
    assert sweep(RUNS, "a", "--shard", "1/3")[0] == 0
    status, out, err = call("status", ["nothing", "a", "none"], capsys)
    assert "  of all shards: 16 of 24 runs done in this folder" in out
    assert status == 2
    assert err.count("has neither results nor unfinished work") == 2


def workers_of(pid):
    """The processes that are children of a process, or of its children."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = path.read_text().rpartition(")")[2].split()
            if int(fields[1]) == pid:
                found += [int(path.parent.name), *workers_of(int(path.parent.name))]
    return found


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGINT, marks=pytest.mark.slow),
        pytest.param(signal.SIGKILL, marks=pytest.mark.long),
    ],
)
def test_worker_processes_end_with_the_command_and_work_resumes(number, sweep, tmp_path):
    long = RUNS.replace("episodes = 6", "episodes = 6000").replace("= 60", "= 600")
    long = long.replace("[7, 2, 5, 1]", "400")
    Path("long.toml").write_text(long)
    arguments = ["long.toml", "--out", "a", "--no-figures", "--workers", 2]
    process = start("sweep", arguments, tmp_path / "kernels", tmp_path)
    until = time.monotonic() + 120
    while not list(Path("a").rglob("block-*.npz")) and time.monotonic() < until:
        time.sleep(0.05)
    workers = workers_of(process.pid)
    assert len(workers) >= 2
    began = time.monotonic()
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert time.monotonic() - began < promptly()
    while any(Path(f"/proc/{one}").exists() for one in workers):
        assert time.monotonic() - began < promptly()
        time.sleep(0.05)
    if number == signal.SIGINT:
        assert process.returncode == 130
        assert err == "Stopped; finished parts are saved. Run the same command again to resume.\n"
    done = set(Path("a").rglob("block-*.npz"))
    assert done
    assert "of 2400 runs done" in "".join(state(Path("a")))


COMPARE = [
    *("--seed", 3, "--episodes", 20, "--max-steps", 40, "--learners", "sarsa", "q_learning"),
    *("--learning-rates", 0.1, "--discounts", 0.9, "--epsilons", 0.3, "--epsilon-decays", 0.9),
    *("--no-figures", "--delivery", "truncates"),
]


@pytest.mark.parametrize("way", ["grown", "merged"])
def test_a_comparison_grows_and_merges(way, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert call("compare", [*COMPARE, "--seeds", 4, "--out", "plain"], capsys)[0] == 0
    if way == "grown":
        assert call("compare", [*COMPARE, "--seeds", 2, "--out", way], capsys)[0] == 0
        assert call("compare", [*COMPARE, "--seeds", 4, "--out", way], capsys)[::2] == (0, "")
    else:
        for n in (1, 2):
            more = "--out", n, "--shard", f"{n}/2"
            assert call("compare", [*COMPARE, "--seeds", 4, *more], capsys)[::2] == (0, "")
        assert call("merge", ["1", "2", "--out", way], capsys)[::2] == (0, "")
    Path("plain/report.html").unlink()
    Path(way, "report.html").unlink()
    arrays = [archives.read(Path(folder, "runs.npz")) for folder in ("plain", way)]
    assert arrays[0].keys() == arrays[1].keys()
    for name, array in arrays[0].items():
        np.testing.assert_array_equal(array, arrays[1][name])
    first, second = contents(Path("plain")), contents(Path(way))
    for files in (first, second):
        del files["manifest.json"]
    assert first == second
