"""Archives of studies and their reproduction, with good and with bad archives."""

import re
import shutil
import zipfile
from pathlib import Path

import pytest
from command_lines import ROOT, assert_one_sentence, assert_same_results, call, contents
from few_resamples import few_resamples  # noqa: F401
from paper import process

from taichi_ants import commands
from taichi_ants.commands import reproduce
from taichi_ants.studies.folder import asked_in, checksum_of, json_in, write_json

PLUGIN = """
from pathlib import Path
from ants_halved import half
from taichi_ants import measures

Path("ran").touch()
measures.register("half", half, "ants", "half of the ants")
"""
BESIDE = '''
def half(snapshot):
    """Return half the number of ants."""
    return len(snapshot.ant_cells) / 2
'''
SWEEP = """
kind = "colony"
measures = ["deliveries", "half"]
seeds = 2
ants = 3
episodes = 0
ticks = 40
rollouts = 1
[world]
preset = "MAP"
[task]
observation = "ants"
life.regrowth = 0
[vary]
policy = ["old/rule.npz", "trail_follower"]
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A folder of finished results, whose inputs are removed, and its archive."""
    place = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        Path("old").mkdir()
        shutil.copy(ROOT / "experiments/policies/foraging.npz", "old/rule.npz")
        shutil.copy(ROOT / "experiments/maps/garden.txt", "old/garden.txt")
        Path("old/my_plugin.py").write_text(PLUGIN)
        Path("old/ants_halved.py").write_text(BESIDE)
        Path("my.toml").write_text(SWEEP.replace("MAP", str(place / "old/garden.txt")))
        for name, arguments in {
            "sweep": ["my.toml", "--plugin", "old/my_plugin.py", "--out", "done", "--no-figures"],
            "archive": ["done", "--out", "done.zip"],
        }.items():
            with pytest.raises(SystemExit) as exit_:
                commands.run(name, arguments)
            assert exit_.value.code == 0
        for path in ("old", "my.toml", "ran"):
            shutil.rmtree(path) if Path(path).is_dir() else Path(path).unlink()
    return place


@pytest.fixture
def here(study, tmp_path, monkeypatch):
    """The study, from another folder."""
    monkeypatch.chdir(tmp_path)
    return study


def refused(name, arguments, capsys):
    status, _, err = call(name, arguments, capsys)
    assert status == 2
    assert_one_sentence(err)
    return err


def test_an_archive_has_the_folder_and_all_that_repeats_the_study(here):
    with zipfile.ZipFile(here / "done.zip") as found:
        own = {f"results/{name}": one for name, one in contents(here / "done").items()}
        assert {*found.namelist()} == {*own, "README.md", "ODD.md", "requirements.txt"}
        assert all(found.read(name) == content for name, content in own.items())
        lock = found.read("requirements.txt").decode()
    inputs = ("my.toml", "plugin/my_plugin.py", "plugin/ants_halved.py", "rule.npz", "garden.txt")
    assert {f"results/inputs/{name}" for name in inputs} <= {*own}
    manifest = json_in(here / "done" / "manifest.json")
    assert {"taichi", "numpy", "kiwisolver", "taichi_ants"} <= manifest["packages"].keys()
    assert f"numpy=={manifest['packages']['numpy']}\n" in lock
    assert f"# Python {manifest['python']}\n" in lock
    assert manifest["processor"]
    sums = asked_in(here / "done")["settings"]["policy.sha256"]
    assert all(len(one) == 64 for one in sums)


def test_equal_results_give_equal_archives(here, capsys):
    for name in ("a.zip", "new/b.zip"):
        assert call("archive", [here / "done", "--out", name], capsys)[::2] == (0, "")
    assert Path("a.zip").read_bytes() == (here / "done.zip").read_bytes()
    assert Path("a.zip").read_bytes() == Path("new/b.zip").read_bytes()
    assert "exists; choose another" in refused("archive", [here / "done", "--out", "a.zip"], capsys)


def test_an_archive_repeats_itself_without_the_files_that_the_study_read(here, capsys):
    err = refused("reproduce", [here / "done.zip"], capsys)
    assert "results/inputs/plugin/my_plugin.py; read it" in err
    assert "results/inputs/plugin/ants_halved.py, " in err
    assert "give --trust-code to run it" in err
    assert not list(Path().iterdir())
    status, out, err = call("reproduce", [here / "done.zip", "--trust-code"], capsys)
    assert status == 0
    assert err == ""
    names = sorted(json_in(here / "done" / "manifest.json")["files"])
    time_and_place, *lines, verdict = out.splitlines()  # without the report
    assert time_and_place.endswith("all results are in results/reproduced-done/")
    assert [line.split() for line in lines] == [["equal", name] for name in names]
    assert verdict == f"All {len(names)} files are equal: the study is reproduced."
    assert Path("ran").exists()
    assert_same_results(here / "done", "results/reproduced-done")
    assert "has finished results" in refused("reproduce", [here / "done.zip"], capsys)


@pytest.fixture
def copy(here):
    """A copy of the results, to change them."""
    shutil.copytree(here / "done", "copy")
    return Path("copy")


def rewrite(copy, name, change):
    """Change a file of results and its checksum."""
    (copy / name).write_text(change((copy / name).read_text()))
    manifest = json_in(copy / "manifest.json")
    manifest["files"][name] = checksum_of(copy / name)
    write_json(copy / "manifest.json", manifest)


def test_a_difference_is_named_with_its_place(copy, capsys, monkeypatch):
    at = (copy / "runs.csv").read_text().index("\n") + 3
    rewrite(copy, "runs.csv", lambda text: f"{text[:at]}?{text[at + 1 :]}")
    (copy / "more.txt").touch()
    rewrite(copy, "more.txt", str)
    assert call("archive", [copy], capsys)[0] == 0
    known = reproduce.packages()
    others = {**known, "numpy": "0", "scipy": None}
    monkeypatch.setattr(reproduce, "packages", lambda also: others)
    status, out, err = call("reproduce", ["copy.zip", "--trust-code"], capsys)
    assert status == 1
    assert "DIFFERENT  runs.csv\n" in out
    assert "DIFFERENT  more.txt\n" in out
    assert "2 of 4 files differ: the study is not reproduced.\n" in out
    assert f"The archive has numpy {known['numpy']}, here is 0.\n" in err
    assert f"The archive has scipy {known['scipy']}, here is None.\n" in err


@pytest.mark.parametrize(
    "change",
    [
        lambda copy: (copy / "runs.csv").unlink(),
        lambda copy: (copy / "runs.csv").write_text("?"),
        lambda copy: (copy / "manifest.json").unlink(),
        lambda copy: (copy / "manifest.json").write_text("{}"),
        lambda copy: shutil.rmtree(copy),
    ],
)
def test_folders_that_cannot_be_archived(change, copy, capsys):
    change(copy)
    err = refused("archive", ["copy"], capsys)
    assert re.search(
        "has no finished results, or some of them have changed; run|is damaged|has no results", err
    )
    assert not Path("copy.zip").exists()


def changed(source, name, more=(), drops=()):
    """Write an archive with other files to `name`, with the same index."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED) as new:
        for one in old.infolist():
            if one.filename not in drops:
                new.writestr(one, old.read(one))
        for path, content in more:
            entry = zipfile.ZipInfo(path)
            entry.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(entry, content)


def test_bad_archives_are_refused_and_leave_nothing(here, capsys, monkeypatch):
    good = here / "done.zip"
    content = good.read_bytes()
    Path("text.zip").write_text("no archive")
    Path("end.zip").write_bytes(content[:-100])
    Path("flipped.zip").write_bytes(content[:1000] + bytes([content[1000] ^ 4]) + content[1001:])
    changed(good, "slip.zip", [("../evil.py", "")])
    changed(good, "less.zip", drops=["results/runs.csv"])
    changed(good, "other.zip", [("results/runs.csv", "0")], drops=["results/runs.csv"])
    changed(good, "plain.zip", drops=["results/study.json"])
    before = {*Path().iterdir()}
    for name, words in {
        "nothing.zip": "no such file",
        **dict.fromkeys(("text.zip", "end.zip", "flipped.zip"), "or it is damaged ("),
        **dict.fromkeys(("less.zip", "other.zip"), "has no finished results, or some"),
        "plain.zip": "has no results",
    }.items():
        assert words in refused("reproduce", [name, "--trust-code"], capsys), name
        assert {*Path().iterdir()} == before
    reproduce.unpack(Path("slip.zip"), "deep/folder")  # nothing lands outside of the folder
    assert not Path("deep/evil.py").exists()
    monkeypatch.setattr(reproduce, "MOST_BYTES", 3 * len(content))
    changed(good, "bomb.zip", [("results/zeros", bytes(4 * len(content)))])
    assert Path("bomb.zip").stat().st_size < 2 * len(content)
    assert "unpacks to more than" in refused("reproduce", ["bomb.zip"], capsys)


@pytest.mark.parametrize(
    ("old", "new"),
    [("preset = ", 'preset = "/etc/hostname" #'), ('"old/rule.npz"', '"../secret.npz"')],
)
def test_a_study_in_an_archive_reads_no_other_files(old, new, copy, capsys):
    """Also with valid checksums."""
    Path("../secret.npz").write_bytes((copy / "inputs/rule.npz").read_bytes())
    path = copy / "inputs/my.toml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    assert call("archive", ["copy"], capsys)[0] == 0
    (wanted,) = [one for one in ("/etc/hostname", "../secret.npz") if one in new]
    status, _, err = call("reproduce", ["copy.zip", "--trust-code"], capsys)
    assert status == 2
    assert f"the study reads '{wanted}', which its archive does not contain" in err
    assert not Path("results").exists()


COMPARE = [
    *("--seeds", 3, "--episodes", 20, "--max-steps", 40, "--learners", "sarsa", "--quick"),
    *("--learning-rates", 0.1, "--discounts", 0.9, "--epsilons", 0.3, "--epsilon-decays", 0.9),
]
COLONY = [
    *("study", "--seeds", 3, "--episodes", 2, "--ticks", 60, "--sizes", 1, 4),
    *("--world-kinds", "paper", "open"),
]


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        pytest.param("compare", COMPARE, marks=pytest.mark.slow),
        pytest.param("colony", COLONY, marks=pytest.mark.long),
    ],
)
def test_studies_with_pages_and_figures_repeat_themselves(
    name, arguments, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(process, "available_threads", lambda: 1)  # so with few resamples, too
    assert call(name, [*arguments, "--out", "done"], capsys)[0] == 0
    assert call("archive", ["done"], capsys)[0] == 0
    status, out, _ = call("reproduce", ["done.zip", "--trust-code"], capsys)
    assert (status, "DIFFERENT" in out) == (0, False)
    assert "equal      report.txt\n" in out
