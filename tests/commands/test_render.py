"""The command line of `experiments/render.py`, from outside."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import gallery
import numpy as np
import pytest
from command_lines import EXPERIMENTS, ROOT, assert_one_sentence, call, environment, start
from command_lines import run as process
from PIL import Image

from taichi_ants import AntsError, commands
from taichi_ants.commands import render
from taichi_ants.learners.policies import save_policy, trail_follower
from taichi_ants.studies.command_line import Parser
from taichi_ants.worlds import paper


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


@pytest.mark.parametrize("shown", ["episode", "colony"])
def test_a_policy_of_another_observation_is_shown_as_such(tmp_path, shown, run) -> None:
    path = tmp_path / "five.npz"
    save_policy(path, np.eye(2048, 5), {}, "five_cells")
    length = {"episode": ["--max-steps", "2"], "colony": ["--ticks", "2"]}[shown]
    assert run(shown, "--policy", path, *length, "--out", tmp_path / "a.png")[0] == 0
    assert files_in(tmp_path) == ["a.png", "five.npz"]


@pytest.mark.parametrize("name", ["a.gif", "a.png", "a.html"])
def test_a_place_that_cannot_be_written_is_refused_before_the_training(
    name, tmp_path, monkeypatch, capsys
) -> None:
    monkeypatch.setattr(render, "find_policy", lambda *_: pytest.fail("it trains first"))
    (tmp_path / name).mkdir()
    with pytest.raises(SystemExit) as end:
        render.main(["colony", "--out", str(tmp_path / name)])
    assert end.value.code == 2
    assert "is not a regular file; name a file to write to." in capsys.readouterr().err


def test_a_wrong_size_is_refused_before_the_training(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(render, "find_policy", lambda *_: pytest.fail("it trains first"))
    wrong = ["episode", "--size", "63x63", "--out", str(tmp_path / "a.gif")]
    with pytest.raises(AntsError, match="64 and 4096"):
        render.show(render.parse_arguments(wrong))


@pytest.mark.parametrize("shown", ["episode", "colony"])
def test_what_is_trained_on_the_spot_sees_what_is_asked_for(shown, monkeypatch) -> None:
    chosen = ["--episodes", "1", "--task.observation", "ants_seen", "--training.learner", "dyna_q"]
    chosen += ["--training.planning-steps", "2"]
    length = ["--ticks", "5"] if shown == "colony" else []
    settings = render.parse_arguments([shown, *chosen, *length])
    assert render.training_config(settings).planning_steps == 2
    table, task, title = render.find_policy(settings, paper())
    assert title == "Dyna-Q after 1 episode"
    assert (table.shape, task.observation) == ((250, 5), "ants_seen")


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
    "something else": (["movie"], "'movie'"),
    "ending": (["episode", "--out", "{}/a.avi"], ".gif or .mp4"),
    "place": (["episode", "--out", "/proc/nope/a.gif"], "cannot write"),
    "size": (["episode", "--size", "63x63", "--out", "{}/a.gif"], "64 and 4096"),
    "large size": (["colony", "--size", "5000x100", "--out", "{}/a.gif"], "64 and 4096"),
    "form of a size": (["episode", "--size", "1280*720"], "1280x720"),
    "speed": (["episode", "--fps", "0", "--out", "{}/a.gif"], "fps"),
    "no number": (["episode", "--fps", "fast"], "'fast' is not a number"),
    "world": (["episode", "--world", "mars", "--out", "{}/a.gif"], "mars"),
    "policy": (["episode", "--policy", "nope.npz", "--out", "{}/a.gif"], "nope.npz"),
    "world seed of the paper": (
        ["episode", "--world.seed", "3"],
        "--world.seed has no effect on",
    ),
    "ants of an episode": (["episode", "--ants", "80"], "--ants"),
    "checkpoints of an episode": (["episode", "--checkpoints", "1"], "--checkpoints"),
    "epsilon": (
        ["episode", "--policy", "{policy}", "--epsilon", "2", "--out", "{}/a.gif"],
        "epsilon",
    ),
    "learner": (["episode", "--training.learner", "magic", "--out", "{}/a.gif"], "magic"),
    "steps": (["episode", "--max-steps", "0"], "from 1 to"),
    "training of a policy": (
        ["colony", "--policy", "a.npz", "--episodes", "5"],
        "--episodes configures",
    ),
    "learner of a policy": (
        ["colony", "--training.learner=sarsa", "--policy", "a.npz"],
        "--training.learner configures",
    ),
    "observation of a policy": (
        ["episode", "--policy", "a.npz", "--task.observation", "paper"],
        "--task.observation configures training",
    ),
    "view of a plain picture": (
        ["colony", "--no-overlay", "--follow", "0"],
        "--follow has no effect with --no-overlay",
    ),
    "title of a plain picture": (
        ["episode", "--no-overlay", "--title", "a"],
        "--title has no effect",
    ),
    "wrong number": (
        ["episode", "--training.discount", "y", "--out", "{}/a.png"],
        "is 'y'; it must be",
    ),
    "hyperparameter of another": (
        ["episode", "--training.n-steps", "2", "--out", "{}/a.gif"],
        "`training.n_steps` is not a setting of sarsa",
    ),
    "unknown option": (["episode", "--colour", "red"], "--colour"),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_are_one_sentence(tmp_path, policy, name, run) -> None:
    arguments, named = WRONG[name]
    status, out, err = run(*(part.format(tmp_path, policy=policy) for part in arguments))
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert named in err
    assert files_in(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "sent", "status"),
    [
        pytest.param("a.gif", signal.SIGINT, 130, marks=pytest.mark.slow),
        pytest.param("a.mp4", signal.SIGTERM, 143, marks=pytest.mark.slow),
    ],
)
def test_stopped_midway_it_leaves_nothing_behind(
    tmp_path, policy, name, sent, status, kernels
) -> None:
    # An ant that moves at random has far more steps to take than there is time for.
    arguments = ["episode", "--policy", str(policy), "--epsilon", "1", "--max-steps", "100000"]
    arguments += ["--world", "open", "--size", "1600x1200", "--out", str(tmp_path / "new" / name)]
    with start("render", arguments, kernels, tmp_path) as running:
        time.sleep(2.5)  # it draws, into memory
        running.send_signal(sent)
        try:
            _, errors = running.communicate(timeout=30)
        finally:
            running.kill()
    assert running.returncode == status
    assert errors == "Stopped; nothing was left behind.\n"
    assert files_in(tmp_path) == []


@pytest.mark.parametrize(
    ("arguments", "world"),
    [(["episode"], "paper"), (["colony"], "open"), (["colony", "--world", "x"], "x")],
)
def test_default_worlds(arguments, world) -> None:
    assert render.parse_arguments(arguments).world == world


@pytest.mark.parametrize(
    ("arguments", "size"),
    [
        (["episode"], (1280, 720)),
        (["colony"], (960, 540)),
        (["colony", "--size", "320x200"], (320, 200)),
    ],
)
def test_default_sizes(arguments, size) -> None:
    assert render.parse_arguments(arguments).size == size


def test_the_command_names_itself_as_it_is_called(capsys, monkeypatch) -> None:
    monkeypatch.setattr(sys, "argv", ["taichi-ants", "render", "colony", "--help"])
    monkeypatch.setattr(Parser, "program", None)
    with pytest.raises(SystemExit):
        commands.main()
    shown = capsys.readouterr().out
    assert shown.startswith("usage: taichi-ants render colony [options]")
    assert "Example: taichi-ants render colony --ants 200 --out ants.gif" in shown


def test_help_needs_little(run, kernels) -> None:
    for kind in ("episode", "colony"):
        _, out, _ = run(kind, "--help")
        assert "--training.learner" in out
        example = re.search(rf"Example: .*?\b({kind}\b.*)", out)[1].split()
        assert render.parse_arguments(example).kind == kind
    heavy = "import sys; sys.path.insert(0, sys.argv[1]); import render; "
    heavy += "print({'taichi', 'matplotlib', 'PIL', 'av', 'numpy'} & set(sys.modules))"
    loaded = subprocess.run(
        [sys.executable, "-c", heavy, str(EXPERIMENTS)],
        env=environment(kernels),
        capture_output=True,
        text=True,
        check=True,
    )
    assert loaded.stdout == "set()\n"


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
        ["git", "ls-files", "renders", "docs", "*.png", "*.gif", "*.mp4"],
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
        if Path(path).suffix in (".png", ".gif", ".mp4")
        and not path.startswith(("tests/", "docs/lessons/"))  # which others make
    }
    pages = [page.read_text("utf-8") for page in (ROOT / "docs").rglob("*.md")]
    shown = [name for page in pages for name in re.findall(r"\]\(figures/([\w.]+)\)", page)]
    drawn = (*gallery.FIGURES, gallery.VIEWER, gallery.LIVE, *shown)
    figures = {f"docs/figures/{name}" for name in drawn}
    readme = (ROOT / "README.md").read_text("utf-8")
    findings = set(re.findall(r'src(?:set)?="(renders/finding_[^"]+)"', readme))  # by findings.py
    assert pictures == figures | {f"renders/{name}" for name in gallery.GALLERY} | findings


@pytest.mark.parametrize("shown", ["episode", "colony", "learning", "policy_sheet"])
def test_by_default_no_tracked_picture_is_replaced(shown) -> None:
    place = gallery.drawing([shown])[1].out
    ignored = subprocess.run(
        ["git", "check-ignore", "--no-index", "-q", place],
        cwd=ROOT,
        capture_output=True,
        check=False,
    )
    if ignored.returncode == 128:
        pytest.skip("not a git repository")
    assert ignored.returncode == 0
