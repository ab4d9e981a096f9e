"""The wheel, the source distribution, and the command that they install."""

import re
import subprocess
import sys
import tarfile
import zipfile

import pytest
from command_lines import ROOT, assert_one_sentence, environment

from taichi_ants.commands import COMMANDS
from taichi_ants.live.server import PARTS
from taichi_ants.viewer.page import SCRIPTS, STYLES

BUILD = """
import sys
from hatchling import build
for kind in ("wheel", "sdist"):
    print(getattr(build, f"build_{kind}")(f"{sys.argv[1]}/{kind}"))
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The two by their kind."""
    place = tmp_path_factory.mktemp("built")
    done = subprocess.run(
        [sys.executable, "-c", BUILD, str(place)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return {
        kind: place / kind / name
        for kind, name in zip(("wheel", "sdist"), done.stdout.split(), strict=True)
    }


def sources(folder):
    return {str(path.relative_to(ROOT)) for path in (ROOT / folder).rglob("*.py")}


def test_the_wheel_holds_the_package_and_nothing_else(built):
    with zipfile.ZipFile(built["wheel"]) as wheel:
        names = [name for name in wheel.namelist() if ".dist-info/" not in name]
        (entries,) = [name for name in wheel.namelist() if name.endswith("entry_points.txt")]
        assert "taichi-ants = taichi_ants.commands:main" in wheel.read(entries).decode()
    page = {f"taichi_ants/viewer/{name}" for name in ("page.html", *STYLES, *SCRIPTS)}
    templates = ("base.html", "odd.md", "parts.html")
    others = ("report.css", "report.js")
    page |= {f"taichi_ants/report/{name}" for name in (*templates, *others)}
    page |= {f"taichi_ants/live/{name}" for name in PARTS}
    page |= {"taichi_ants/analysis/taichi_ants.mplstyle", "taichi_ants/worlds/lab.json"}
    assert set(names) == sources("taichi_ants") | {"taichi_ants/py.typed"} | page


def test_a_package_index_shows_no_broken_links(built):
    with zipfile.ZipFile(built["wheel"]) as wheel:
        (name,) = [name for name in wheel.namelist() if name.endswith("/METADATA")]
        shown = wheel.read(name).decode().split("\n\n", 1)[1]
    assert len(re.findall(r"\]\((?!https?:)", (ROOT / "README.md").read_text("utf-8"))) > 15
    assert shown.startswith("# Taichi Ants")
    assert "(`docs/results/paper.md`)" in shown
    assert re.findall(r"\]\((?!https?:)", shown) == []
    assert "<" not in re.sub(r"<!-- tests -->|<repository address>", "", shown)  # no HTML


def test_the_source_distribution_can_run_the_tests(built):
    with tarfile.open(built["sdist"]) as archive:
        names = {name.split("/", 1)[1] for name in archive.getnames()}
    for folder in ("taichi_ants", "tests", "experiments", "benchmarks"):
        assert sources(folder) <= names
    others = ("pyproject.toml", "README.md", "LICENSE", "experiments/maps/garden.txt")
    assert {*others, "renders/episode.gif", ".ci/run"} <= names


def call(arguments, folder, *options, kernels=None):
    return subprocess.run(
        [sys.executable, *options, "-m", "taichi_ants", *arguments],
        cwd=folder,
        env=environment(kernels or folder),
        capture_output=True,
        text=True,
        timeout=60,
    )


def test_help_lists_the_commands_in_a_line_each(tmp_path):
    done = call([], tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    lines = [line.split()[0] for line in done.stdout.splitlines() if line.startswith("  ")]
    assert lines == list(COMMANDS)
    files = {path.stem for path in (ROOT / "taichi_ants" / "commands").glob("[a-z]*.py")}
    assert files == {name.replace("-", "_") for name in COMMANDS}
    assert max(map(len, done.stdout.splitlines())) < 80


@pytest.mark.parametrize("arguments", ["sweep", "colony live", "render episode"])
def test_commands_have_help_of_their_own_which_needs_little(arguments, tmp_path):
    """No library that takes long to import, so that it comes at once."""
    done = call([*arguments.split(), "--help"], tmp_path, "-X", "importtime")
    assert done.returncode == 0
    assert done.stdout.startswith(f"usage: taichi-ants {arguments} [")
    lines = [line.split("|") for line in done.stderr.splitlines()]
    assert {len(line) for line in lines} == {3}  # nothing else is said
    needed = {module.strip().partition(".")[0] for *_, module in lines}
    assert "taichi_ants" in needed
    libraries = {"taichi", "numpy", "scipy", "matplotlib", "PIL", "gymnasium", "jinja2", "rich"}
    assert needed & libraries == set()


def test_an_unknown_command_is_one_sentence_and_the_version_is_printed(tmp_path):
    done = call(["comparre"], tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert_one_sentence(done.stderr)
    for word in ("'comparre'", *COMMANDS):
        assert word in done.stderr
    done = call(["--version"], tmp_path)
    assert (done.returncode, done.stdout) == (0, "taichi-ants 0.1.0\n")
