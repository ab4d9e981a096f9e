"""Studies that grow, shards, and damage: the bytes of one plain run, by any way."""

import os
import re
import shutil
import signal
import sys
import time
from pathlib import Path

import pytest
from command_lines import (
    assert_one_sentence,
    assert_same_results,
    call,
    contents,
    descendants,
    promptly,
    start,
)

from taichi_ants.commands.status import status
from taichi_ants.studies.folder import sessions_in, write_json
from taichi_ants.studies.points import ColonyPoint, RunPoint

RUNS = """
kind = "runs"
measures = ["return_all", "greedy_deliveries"]
seeds = [7, 2, 5, 1]
episodes = 6
max_steps = 60
rollouts = 3
training = {learner = "sarsa", discount = 0.9, epsilon = 0.3, epsilon_decay = 0.99}
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
training = {learner = "sarsa", learning_rate = 1, discount = 0.9, epsilon = 0.3, epsilon_decay = 1}
world = {preset = "open", ranges = [12, 12, 12], per_seed = true}
task = {evaporation_in_training = true, life.regrowth = 0}
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
    done, real = [], owner.compute

    def do(points, seeds, *more):
        done.extend((point, seed) for point in points for seed in seeds)
        return real(points, seeds, *more)

    monkeypatch.setattr(owner, "compute", staticmethod(do))
    assert sweep(SWEEPS[kind], "grown")[::2] == (0, "")
    assert len(done) == len(set(done)) == {"runs": 24 - 8, "colony": 8 - 2, "drawn": 32 - 16}[kind]
    assert_same_results("plain", "grown")


@pytest.mark.parametrize(
    ("text", "change", "words"),
    [
        (RUNS, ("episodes = 6", "episodes = 7"), "study lacks (episodes is 6 instead of 7"),
        (RUNS, ("[7, 2, 5, 1]", "[7, 2, 5]"), "seeds is [7, 2, 5, 1] instead of [7, 2, 5]"),
        (DRAWN, ("samples = 8", "samples = 4"), "training.learning_rate is [0."),
        (DRAWN, ("samples", "design_seed = 1\nsamples"), "design_seed is 0 instead of 1"),
    ],
)
def test_what_contradicts_is_refused_by_name(text, change, words, sweep):
    assert sweep(text, "a")[0] == 0
    before = contents(Path("a"))
    status, _, err = sweep(text.replace(*change), "a")
    assert status == 2
    assert_one_sentence(err)
    assert words in err
    assert contents(Path("a")) == before
    assert sweep(text.replace(*change), "a", "--force")[0] == 0
    assert sweep(text.replace(*change), "plain")[0] == 0
    assert tables_of("a") == tables_of("plain")


def tables_of(folder):
    return {path.name: path.read_bytes() for path in Path(folder).glob("*.csv")}


def test_other_measures_and_values_that_are_equal_floats_extend_a_sweep(sweep):
    """The finished runs stay, and only what is new is computed."""
    assert sweep(RUNS, "a")[0] == 0
    more = RUNS.replace('"return_all"', '"return_all", "steps_all"')
    assert sweep(more, "a")[::2] == (0, "")
    near = RUNS.replace("[0.01, 0.1, 0.2]", "[0.01, 0.1, 0.10000000000000002, 0.2]")
    near = near.replace("0.1,", "0.1000000000000000055,", 1)
    assert sweep(near, "a", "--force")[::2] == (0, "")
    assert sweep(near, "plain")[0] == 0
    assert tables_of("a") == tables_of("plain")


def test_results_of_other_physics_are_refused(sweep, monkeypatch):
    assert sweep(RUNS, "a")[0] == 0
    monkeypatch.setattr("taichi_ants.studies.points.PHYSICS", 99)
    monkeypatch.setattr("taichi_ants.studies.command.PHYSICS", 99)
    status, _, err = sweep(RUNS, "a")
    assert status == 2
    assert (
        "contains results that this study lacks (physics is 1 instead of 99); choose another" in err
    )


def test_a_folder_of_something_else_is_left_alone(sweep):
    Path("a").mkdir()
    write_json(Path("a/manifest.json"), {"made": "by another program"})
    Path("a/runs.csv").write_text("1\n")
    status, _, err = sweep(RUNS, "a")
    assert (status, err.count("\n")) == (2, 1)
    assert "a contains files, but no results; choose another --out" in err.replace("'", "")
    assert sorted(path.name for path in Path("a").iterdir()) == ["manifest.json", "runs.csv"]


@pytest.mark.parametrize("change", ["appended", "removed"])
def test_a_table_that_was_changed_or_removed_is_written_again(change, sweep, monkeypatch):
    assert sweep(RUNS, "a")[0] == 0
    before = contents(Path("a"))
    if change == "appended":
        with open("a/runs.csv", "a") as file:
            file.write("0,0,0,0,0\n")
    else:
        Path("a/summary.csv").unlink()
    monkeypatch.setattr(RunPoint, "compute", None)
    assert sweep(RUNS, "a")[::2] == (0, "")
    after = contents(Path("a"))
    assert {name for name in after if after[name] != before.get(name)} <= {"manifest.json"}


def test_read_only_results_are_shown(sweep):
    """In a forked process, in which nothing can be written to their folder."""
    assert sweep(RUNS, "a")[0] == 0
    process = os.fork()
    if process == 0:

        def hook(event, details):
            writes = event == "open" and details[2] & (os.O_CREAT | os.O_WRONLY | os.O_RDWR)
            is_inside = os.path.abspath(str(details[0])).startswith(os.path.abspath("a"))
            if is_inside and (writes or event in ("os.mkdir", "os.rename")):
                raise PermissionError(30, os.strerror(30))

        sys.addaudithook(hook)
        shown, more = sweep(RUNS, "a"), sweep(RUNS.replace("[7,", "[7, 8,"), "a")
        is_right = "a/ already has these results" in shown[1] and shown[::2] == (0, "")
        os._exit(0 if is_right and (more[0], more[2].count("\n")) == (2, 1) else 1)
    assert os.waitpid(process, 0)[1] == 0


@pytest.mark.parametrize("kind", SWEEPS)
def test_three_shards_have_the_bytes_of_one_run(kind, sweep):
    """In one folder, whose last shard writes the tables, and in several, by copying files."""
    assert sweep(SWEEPS[kind], "plain")[0] == 0
    for n in (3, 1, 2):
        status, out, err = sweep(SWEEPS[kind], "one", "--shard", f"{n}/3")
        assert (status, err) == (0, "")
        assert ("Shard" in out) == (n != 2)
        assert sweep(SWEEPS[kind], f"s{n}", "--shard", f"{n}/3")[0] == 0
        shutil.copytree(f"s{n}/blocks", "merged/blocks", dirs_exist_ok=True)
    assert sweep(SWEEPS[kind], "merged")[0] == 0
    assert_same_results("plain", "one")
    assert_same_results("plain", "merged")
    assert not sessions_in(Path("merged"))  # nothing was computed


def test_a_damaged_block_is_computed_again(sweep):
    assert sweep(RUNS, "plain")[0] == 0
    assert sweep(RUNS, "a")[0] == 0
    path, *_ = sorted(Path("a/blocks").iterdir())
    content = bytearray(path.read_bytes())
    content[content.rindex(b"\x93NUMPY") + 130] ^= 1  # after NumPy's 128 bytes
    path.write_bytes(content)
    Path("a/runs.csv").unlink()
    status, _, err = sweep(RUNS, "a")
    assert status == 0
    assert err.startswith(f"'{path}' is damaged, so its runs are ")
    assert_same_results("plain", "a")
    Path("a/study.json").write_text("{")
    status, _, err = sweep(RUNS.replace("[7,", "[7, 8,"), "a")
    assert status == 2
    assert_one_sentence(err)
    assert "'a/study.json' is damaged; remove it and run the command" in err


@pytest.mark.parametrize("shard", ["4/3", "0/3", "2", "a/b"])
def test_shards_that_do_not_exist_are_refused(shard, sweep):
    status, _, err = sweep(RUNS, "a", f"--shard={shard}")
    assert status == 2
    assert_one_sentence(err)
    assert "write I/N" in err


def test_status_and_tables_of_work_in_progress(sweep, capsys, monkeypatch):
    real, seen = RunPoint.compute, []

    def fails(points, seeds, *more):
        if 0.2 in (point.training.learning_rate for point in points) and 1 in seeds:
            raise KeyError("a plugin")
        seen.append(call("status", ["a"], capsys))
        return real(points, seeds, *more)

    monkeypatch.setattr(RunPoint, "compute", staticmethod(fails))
    status, _, err = sweep(RUNS, "a")
    assert status == 1
    assert_one_sentence(err)
    assert re.search(
        "failed: .*training.learning_rate 0.2, .*seeds? .*1 \\(KeyError: 'a plugin'", err
    )
    status, out, _ = seen[-1]
    assert status == 0
    assert out.splitlines()[0] == "a"
    assert re.search(r"unfinished: \d+ of 24 runs done \(\d+ % of the work\), in \d+ blocks", out)
    monkeypatch.setattr(RunPoint, "compute", staticmethod(real))
    _, out, _ = call("status", ["a"], capsys)
    (done,) = re.findall(r"(\d+) of 24", out)
    assert "  failed: " in out
    assert "  last block: " in out
    status, out, _ = call("tables", ["a", "--no-figures"], capsys)
    assert status == 0
    assert f"{24 - int(done)} runs are missing" in out
    partial = Path("a/runs.csv").read_text().splitlines()
    assert not Path("a/manifest.json").exists()
    assert sweep(RUNS, "a")[0] == 0
    final = Path("a/runs.csv").read_text().splitlines()
    assert partial[0] == final[0]
    assert set(partial) < set(final)
    assert len(partial) == int(done) + 1
    assert call("tables", ["a", "--no-figures"], capsys)[0] == 0
    assert Path("a/runs.csv").read_text().splitlines() == final
    _, out, _ = call("status", ["a"], capsys)
    assert "finished: results with 24 runs, since" in out
    status, out, err = call("status", ["nothing"], capsys)
    assert status == 2
    assert "has no results; name the folder of a study" in err


def test_the_time_left_is_that_of_the_last_process(sweep, monkeypatch):
    real, calls = RunPoint.compute, []

    def stops(*arguments):
        calls.append(arguments)
        if len(calls) > 3:
            raise KeyboardInterrupt
        return real(*arguments)

    monkeypatch.setattr(RunPoint, "compute", staticmethod(stops))
    assert sweep(RUNS, "a")[0] == 130
    (one,) = sessions_in(Path("a"))
    blocks = sorted(Path("a/blocks").iterdir(), key=os.path.getmtime)
    os.utime(blocks[0], (0, one["began"] - 99))  # of a process before
    os.utime(blocks[1], (0, one["began"] + 100))
    os.utime(blocks[2], (0, one["began"] + 5 * 86400))
    (left,) = (line for line in status(Path("a")) if line.startswith("left"))
    assert re.fullmatch(r"left: about \d+ days", left)
    assert next(line for line in status(Path("a")) if "last" in line) == "last block: 0 seconds ago"
    old = time.time() - 3 * 86400
    for path in blocks:
        os.utime(path, (old, old))
    assert "last block: 3 days ago" in status(Path("a"))


def test_tables_are_written_as_parquet_too(sweep, capsys, monkeypatch):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "pyarrow", None)
        status, _, err = sweep(COLONY, "whole", "--parquet")
        assert status == 2
        assert 'pip install -e ".[parquet]"' in err
    assert sweep(COLONY, "whole", "--parquet")[0] == 0
    assert sweep(COLONY, "plain")[0] == 0
    monkeypatch.setattr(ColonyPoint, "compute", None)
    assert sweep(COLONY, "plain", "--parquet")[0] == 0  # added to finished results
    assert_same_results("plain", "whole")
    for name in ("runs", "series", "summary"):
        table = pandas.read_parquet(f"whole/{name}.parquet")
        text = pandas.read_csv(f"plain/{name}.csv")
        pandas.testing.assert_frame_equal(table, text, check_dtype=False)
    runs, series = (pandas.read_parquet(f"plain/{name}.parquet") for name in ("runs", "series"))
    assert runs.dtypes["deliveries"] == "float64"
    assert series.dtypes["tick"] == series.dtypes["seed"] == "int64"


@pytest.mark.parametrize("kind", SWEEPS)
def test_a_row_is_played_to_the_same_numbers(kind, sweep, capsys):
    assert sweep(SWEEPS[kind], "a")[0] == 0
    header, *rows = (line.split(",") for line in Path("a/runs.csv").read_text().splitlines())
    status, out, _ = call("watch", ["a", "--row", 6], capsys)
    assert status == 0
    values = dict(line.split() for line in out.splitlines()[:-1])
    row = dict(zip(header, rows[5], strict=True))
    assert {name: float(row[name] or "nan") for name in values} == pytest.approx(
        {name: float(value) for name, value in values.items()}, rel=1e-4, nan_ok=True
    )
    assert Path("a/row-6.html").stat().st_size > 50_000
    assert call("watch", ["a", "--row", len(rows) + 1], capsys)[0] == 2


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGINT, marks=pytest.mark.slow),
        pytest.param(signal.SIGKILL, marks=pytest.mark.long),
    ],
)
def test_worker_processes_end_with_the_command_and_work_resumes(number, sweep, tmp_path, kernels):
    long = RUNS.replace("episodes = 6", "episodes = 6000").replace("= 60", "= 600")
    long = long.replace("[7, 2, 5, 1]", "400")
    Path("long.toml").write_text(long)
    arguments = ["long.toml", "--out", "a", "--no-figures", "--workers", 2]
    # A process that is killed while it writes kernels would leave a lock.
    cache = kernels if number == signal.SIGINT else tmp_path / "kernels"
    process = start("sweep", arguments, cache, tmp_path)
    until = time.monotonic() + 120
    while not list(Path("a").rglob("*.npz")) and time.monotonic() < until:
        time.sleep(0.05)
    workers = descendants(process.pid)
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
    assert set(Path("a").rglob("*.npz"))
    assert "of 2400 runs done" in "".join(status(Path("a")))
