"""What the comparison does with what cannot be: one sentence, status 2, nothing left behind."""

from __future__ import annotations

import pytest
from command_lines import assert_one_sentence, call, run

TINY = [
    *("--seeds", 1, "--episodes", 2, "--max-steps", 30, "--learners", "q_learning"),
    *("--learning-rates", 0.1, "--discounts", 0.9, "--epsilons", 0.3, "--epsilon-decays", 0.9),
    *("--delivery", "terminates", "--no-figures"),
]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with damaged maps, in which the command runs."""
    (tmp_path / "damaged.txt").write_text("Q F\n  x\n")
    (tmp_path / "no_way.txt").write_text("Q\n\n#\n\nF\n")
    (tmp_path / "bytes.txt").write_bytes(bytes(range(256)))
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "diary.txt").write_text("not a result")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def everything(folder):
    """All paths below a folder, with what files hold, except bytecode, which Python writes."""
    paths = [path for path in folder.rglob("*") if "__pycache__" not in path.parts]
    return {path: path.is_file() and path.read_bytes() for path in paths}


def assert_refused(arguments, named, place, capsys):
    before = everything(place)
    status, out, err = call("compare", [*TINY, "--out", "a/new/folder", *arguments], capsys)
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    for word in named:
        assert word in err
    assert everything(place) == before


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--learners", "td_zero"], ["td_zero", "q_learning", "sarsa", "dyna_q"]),
        (["--learners", ""], ["--learners is empty"]),
        (["--epsilons", "half"], ["--epsilons", "'half'"]),
        (["--learning-rates", "0"], ["learning_rate", "0.0", "must be between"]),
        (["--discounts", "inf"], ["discount", "inf"]),
        (["--epsilons", "0.3", "nan"], ["epsilon", "nan"]),
        (["--epsilon-decays", "0"], ["epsilon_decay", "0.0"]),
        (["--training.n-steps", "2"], ["`training.n_steps` is not a hyperparameter of q_learning"]),
        (["--training.planning-steps", "2"], ["use --planning-steps"]),
        (["--learners", "sarsa_lambda", "--training.trace-decay", "two"], ["trace_decay", "two"]),
        (["--task.delivery", "truncates"], ["--task.delivery"]),
        (["--learners", "dyna_q", "--planning-steps", "1001"], ["planning_steps", "1001"]),
        (["--seeds", "many"], ["--seeds", "'many'"]),
        (["--seeds", "1000000"], ["--seeds", "1000000"]),
        (["--seed", str(2**64)], ["18446744073709551616", "it must lie between"]),
        (["--max-steps", "10000001"], ["max_steps", "10000001"]),
        (["--threads", "1025"], ["--threads", "1025"]),
        (["--arch", "abacus"], ["--arch", "abacus", "cpu"]),
        (["--learner", "sarsa"], ["--learner"]),  # no abbreviations: they change their meaning
        (["two\nlines"], ["two lines"]),
        (["--world", "mars"], ["'mars'", "open", "paper"]),
        (["--world", "damaged.txt"], ["damaged.txt", "line 2", "'x'"]),
        (["--world", "bytes.txt"], ["bytes.txt", "not UTF-8 text"]),
        (["--world", "no_way.txt"], ["no_way.txt", "cannot reach any food"]),
        (["--world.seed", "0"], ["--world.seed", "'paper'", "open"]),
        (["--out", "file/below/it"], ["'file/below/it'"]),
        (["--out", "/proc/results"], ["'/proc/results'"]),
        (["--out", "full"], ["'full'", "--force"]),
        (["--out", "a\0b"], ["null"]),
    ],
)
def test_settings_worlds_and_folders(arguments, named, place, capsys):
    assert_refused(arguments, named, place, capsys)


PLUGINS = {
    "missing": (None, ["cannot read", "plugin.py"]),
    "syntax": ("def broken(:\n", ["plugin.py", "SyntaxError"]),
    "fails": ("raise KeyError('a\\nb')\n", ["plugin.py", "KeyError"]),
    "exits": ("import sys\nsys.exit(0)\n", ["plugin.py", "SystemExit"]),
    "queen on food": (
        "from taichi_ants import World\nWorld((3, 3, 3), queen=(0, 0, 0), foods=[(0, 0, 0)])\n",
        ["(0, 0, 0)", "food"],
    ),
    "ant outside": (
        "from taichi_ants import World\n"
        "World((3, 3, 3), (0, 0, 0), foods=[(2, 0, 0)], ants=[((0, 7, 0), 1)])\n",
        ["(0, 7, 0", "ants"],
    ),
}


@pytest.mark.parametrize("name", PLUGINS)
def test_plugins(name, place, capsys):
    """A world of a person's own, and what else can be wrong in a file of theirs."""
    text, named = PLUGINS[name]
    if text is not None:
        (place / "plugin.py").write_text(text)
    assert_refused(["--plugin", "plugin.py"], named, place, capsys)


LEARNER = """
import taichi as ti
from taichi_ants import learners

@ti.func
def error(value, reward):
    return reward - value

learners.register(learners.td_learner("mine", error))
"""


def test_a_learner_with_too_few_arguments(place, kernels):
    """In a process of its own, since what a plugin registers stays registered."""
    (place / "plugin.py").write_text(LEARNER)
    before = everything(place)
    arguments = [*TINY, "--plugin", "plugin.py", "--learners", "mine", "--out", "a/new/folder"]
    done = run("compare", arguments, kernels, place)
    assert (done.returncode, done.stdout) == (2, "")
    assert_one_sentence(done.stderr)
    assert "'mine'" in done.stderr
    assert "has 2 arguments" in done.stderr
    assert everything(place) == before


def test_a_bad_command_as_a_process(place, kernels):
    done = run("compare", ["--epsilons", 3, "--out", "new"], kernels, place)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: `training.epsilon` is 3.0; it must be between 0 and 1.\n"
    assert not (place / "new").exists()
