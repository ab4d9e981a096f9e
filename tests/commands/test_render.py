"""The command line of `taichi-ants render`, from outside."""

import re
import subprocess
from pathlib import Path

import gallery
import numpy as np
import pytest
from command_lines import ROOT, assert_one_sentence, call
from command_lines import run as process
from PIL import Image

from taichi_ants import commands
from taichi_ants.commands import render
from taichi_ants.learners.policies import save_policy, trail_follower
from taichi_ants.rendering import writers


@pytest.fixture
def run(capsys):
    """Calls the command in this process; its exit status, standard output and error."""
    return lambda *arguments: call("render", arguments, capsys)


@pytest.fixture(scope="module")
def policy(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("policies") / "follower.npz"
    save_policy(path, trail_follower(), {})
    return path


def files_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*"))


@pytest.mark.slow
def test_an_episode_without_display_and_home(tmp_path, policy, kernels) -> None:
    path = tmp_path / "new" / "a.gif"
    shown = ["episode", "--policy", policy, "--size", "400x330", "--out", path]
    places = {"HOME": "/proc/nope", "DISPLAY": None}
    done = process("render", shown, kernels, tmp_path, **places)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"{path}: 34 steps, return 45, delivered\n"
    with Image.open(path) as image:
        assert image.n_frames == 35
        assert image.size == (400, 330)
    assert files_in(tmp_path) == ["a.gif", "new"]


def test_training_on_the_spot(tmp_path, run) -> None:
    short = ["--episodes", 30, "--size", "64x64", "--max-steps", 4]
    assert run("episode", *short, "--out", tmp_path / "a.gif")[0] == 0
    assert files_in(tmp_path) == ["a.gif"]


def test_a_still(tmp_path, policy, run) -> None:
    path = tmp_path / "a.png"
    _, out, _ = run("episode", "--policy", policy, "--max-steps", 3, "--out", path)
    assert out.endswith("3 steps, return 3, not delivered\n")
    _, out, _ = run("episode", "--policy", policy, "--max-steps", 1, "--out", path)
    assert ": 1 step, return" in out
    assert Image.open(path).size == (1280, 720)
    assert files_in(tmp_path) == ["a.png"]


@pytest.mark.parametrize("name", ["a.gif", "a.png", "a.html"])
def test_a_place_that_cannot_be_written_is_refused_before_the_training(
    name, tmp_path, monkeypatch, capsys
) -> None:
    monkeypatch.setattr(render, "find_policy", lambda *_: pytest.fail("it trains first"))
    (tmp_path / name).mkdir()
    with pytest.raises(SystemExit) as end:
        commands.run("render", ["colony", "--out", str(tmp_path / name)])
    assert end.value.code == 2
    assert "is not a regular file; name a file to write to." in capsys.readouterr().err


def test_a_colony(tmp_path, run) -> None:
    _, out, _ = run(
        *("colony", "--world", "open", "--ants", 7, "--episodes", 2, "--ticks", 9),
        *("--frame-interval", 3, "--size", "300x200", "--out", tmp_path / "b.gif"),
    )
    assert "7 ants, 9 ticks" in out
    with Image.open(tmp_path / "b.gif") as image:
        assert image.n_frames == 4


WRONG = {
    "nothing to show": ([], "episode|colony"),
    "ending": (["episode", "--out", "{}/a.avi"], ".png or .gif"),
    "size": (["episode", "--size", "63x63", "--out", "{}/a.gif"], "64 and 4096"),
    "world": (["episode", "--world", "mars", "--out", "{}/a.gif"], "mars"),
    "world seed of the paper": (["episode", "--world.seed", "3"], "--world.seed has no effect on"),
    "learner": (["episode", "--training.learner", "magic", "--out", "{}/a.gif"], "magic"),
    "training of a policy": (
        ["colony", "--policy", "a.npz", "--episodes", "5"],
        "--episodes configures",
    ),
    "hyperparameter of another": (
        ["episode", "--training.n-steps", "2", "--out", "{}/a.gif"],
        "`training.n_steps` is not a setting of sarsa",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_are_one_sentence(tmp_path, policy, name, run) -> None:
    arguments, named = WRONG[name]
    status, out, err = run(*(part.format(tmp_path, policy=policy) for part in arguments))
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert named in err
    assert files_in(tmp_path) == []


def test_stopped_midway_it_leaves_nothing_behind(tmp_path, policy, run, monkeypatch) -> None:
    def stopped(frames, *more, **named) -> None:
        next(iter(frames))
        raise KeyboardInterrupt

    monkeypatch.setattr(writers, "_with_palette", stopped)
    status, _, err = run("episode", "--policy", policy, "--out", tmp_path / "new" / "a.gif")
    assert (status, err) == (130, "Stopped; nothing was left behind.\n")
    assert files_in(tmp_path) == []


def test_the_gallery_is_there_and_small() -> None:
    sizes = []
    for name, arguments in gallery.GALLERY.items():
        _, settings = gallery.drawing([*arguments, "--out", name])
        path = ROOT / "renders" / name
        sizes.append(path.stat().st_size)
        with Image.open(path) as image:
            assert image.size == getattr(settings, "size", image.size)
            frames = getattr(image, "n_frames", 1)
            assert (frames > 1) == name.endswith(".gif")
            assert np.asarray(image.convert("RGB")).std() > 5
    assert len(sizes) == 5
    assert sum(sizes) < 3_000_000
    figures = [ROOT / "docs" / "figures" / name for name in gallery.FIGURES]
    assert sum(path.stat().st_size for path in figures) < 600_000


def test_the_tracked_pictures_are_those_of_the_gallery() -> None:
    listed = subprocess.run(
        ["git", "ls-files", "renders", "docs", "*.png", "*.gif"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode:
        pytest.skip("not a git repository")
    pictures = {
        path
        for path in listed.stdout.split()
        if Path(path).suffix in (".png", ".gif")
        and not path.startswith(("tests/", "docs/lessons/"))  # which others make
    }
    pages = [page.read_text("utf-8") for page in (ROOT / "docs").rglob("*.md")]
    shown = [name for page in pages for name in re.findall(r"\]\((?:../)?figures/([\w.]+)\)", page)]
    drawn = (*gallery.FIGURES, gallery.VIEWER, gallery.LIVE, *shown)
    figures = {f"docs/figures/{name}" for name in drawn}
    readme = (ROOT / "README.md").read_text("utf-8")
    findings = set(re.findall(r'src(?:set)?="(renders/finding_[^"]+)"', readme))  # by findings.py
    assert pictures == figures | {f"renders/{name}" for name in gallery.GALLERY} | findings
