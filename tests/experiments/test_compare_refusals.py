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
    (tmp_path / "no_way.txt").write_text("Q\n\n#\n\nF\n")
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
        (["--epsilons", "0.3", "nan"], ["epsilon", "nan"]),
        (["--training.n-steps", "2"], ["`training.n_steps` is not a hyperparameter of q_learning"]),
        (["--training.planning-steps", "2"], ["use --planning-steps"]),
        (["--task.delivery", "truncates"], ["--task.delivery"]),
        (["--seeds", "1000000"], ["--seeds", "1000000"]),
        (["--learner", "sarsa"], ["--learner"]),  # no abbreviations: they change their meaning
        (["--world", "mars"], ["'mars'", "open", "paper"]),
        (["--world", "no_way.txt"], ["no_way.txt", "cannot reach any food"]),
        (["--world.seed", "0"], ["--world.seed", "'paper'", "open"]),
        (["--out", "full"], ["'full'", "--force"]),
    ],
)
def test_settings_worlds_and_folders(arguments, named, place, capsys):
    assert_refused(arguments, named, place, capsys)


def test_a_bad_command_as_a_process(place, kernels):
    done = run("compare", ["--epsilons", 3, "--out", "new"], kernels, place)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: `training.epsilon` is 3.0; it must be between 0 and 1.\n"
    assert not (place / "new").exists()
