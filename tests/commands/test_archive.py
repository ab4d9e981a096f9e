"""Archives of studies and their reproduction, with good and with bad archives."""

from __future__ import annotations

import json
import shutil
import stat
import zipfile
from pathlib import Path

import pytest
from command_lines import ROOT, assert_one_sentence, call, contents

from taichi_ants import AntsError
from taichi_ants.files import bundles
from taichi_ants.files.results import ResultFolder, checksum_of, read_manifest
from taichi_ants.studies import reproduction

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
[[at]]
tick = 20
policy = "old/rule.npz"
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
                __import__(f"taichi_ants.commands.{name}", fromlist=["main"]).main(arguments)
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


def test_an_archive_has_all_that_repeats_the_study(here):
    with bundles.reading(here / "done.zip") as bundle:
        own = {f"results/{name}" for name in contents(here / "done")}
        assert {*bundle.names} == own | {"README.md", "ODD.md", "requirements.txt"}
        for name in own:
            assert bundle.read(name) == (here / "done" / name.removeprefix("results/")).read_bytes()
        lock = bundle.read("requirements.txt").decode()
    inputs = ("my.toml", "my_plugin.py", "ants_halved.py", "rule.npz", "garden.txt")
    assert {f"results/inputs/{name}" for name in inputs} <= own
    manifest = json.loads((here / "done/manifest.json").read_text())
    assert {"taichi", "numpy", "kiwisolver", "taichi_ants"} <= manifest["packages"].keys()
    assert f"numpy=={manifest['packages']['numpy']}\n" in lock
    assert f"# Python {manifest['python']}\n" in lock
    assert manifest["processor"]
    assert all(len(one) == 64 for one in manifest["settings"]["policy.sha256"])


def test_equal_results_give_equal_archives(here, capsys):
    for name in ("a.zip", "new/b.zip"):
        assert call("archive", [here / "done", "--out", name], capsys)[::2] == (0, "")
    assert Path("a.zip").read_bytes() == (here / "done.zip").read_bytes()
    assert Path("a.zip").read_bytes() == Path("new/b.zip").read_bytes()
    assert "exists; choose another" in refused("archive", [here / "done", "--out", "a.zip"], capsys)


def test_an_archive_repeats_itself_without_the_files_that_the_study_read(here, capsys):
    err = refused("reproduce", [here / "done.zip"], capsys)
    assert "'results/inputs/my_plugin.py' (7 lines, SHA-256 " in err
    assert "'results/inputs/ants_halved.py' (4 lines, SHA-256 " in err
    assert "give --trust-plugins to run it" in err
    assert not list(Path().iterdir())
    status, out, err = call("reproduce", [here / "done.zip", "--trust-plugins"], capsys)
    assert status == 0
    assert err.startswith("Running code of the archive: 'results/inputs/my_plugin.py' (")
    *lines, verdict = out.splitlines()
    names = sorted(contents(here / "done"))
    assert sorted(line.split()[1] for line in lines) == names
    assert all(line.startswith("equal  ") for line in lines)
    assert verdict == f"All {len(names)} files are equal: the study is reproduced."
    assert Path("ran").exists()
    new = contents(Path("results/reproduced-done"))
    old = contents(here / "done")
    assert new.pop("manifest.json") != old.pop("manifest.json")
    assert new == old
    assert "has finished results" in refused("reproduce", [here / "done.zip"], capsys)


@pytest.fixture
def copy(here):
    """A copy of the results, to change them."""
    shutil.copytree(here / "done", "copy")
    return Path("copy")


def test_a_difference_is_named_with_its_place(copy, capsys, monkeypatch):
    folder = ResultFolder(copy, read_manifest(copy)["settings"])
    text = (copy / "runs.csv").read_text()
    at = text.index("\n") + 3
    folder.add("runs.csv", f"{text[:at]}?{text[at + 1 :]}")
    folder.add("more.txt", "more")
    assert call("archive", [copy], capsys)[0] == 0
    known = reproduction.packages()
    monkeypatch.setattr(reproduction, "packages", lambda: {**known, "numpy": "0", "scipy": None})
    status, out, err = call("reproduce", ["copy.zip", "--trust-plugins"], capsys)
    assert status == 1
    assert f"DIFFERENT  runs.csv (first difference at byte {at}, line 2)" in out
    assert "DIFFERENT  more.txt (is only in the archive)" in out
    assert "2 of 10 files differ: the study is not reproduced.\n" in out
    versions = f"numpy 0 instead of {known['numpy']}, scipy None instead of {known['scipy']}"
    assert f"These versions differ from those of the archive: {versions}.\n" in err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda copy: (copy / "runs.csv").unlink(), "is missing or has changed"),
        (lambda copy: (copy / "runs.csv").write_text("?"), "is missing or has changed"),
        (lambda copy: (copy / "inputs/rule.npz").unlink(), "is missing or has changed"),
        (
            lambda copy: (copy / "manifest.json").write_text("{}"),
            "is damaged or of anoth",
        ),
        (lambda copy: _rewrite(copy, "version", "0.0.9"), "has results of version 0.0.9"),
        (lambda copy: _unfinished(copy), "has unfinished work; run its command again"),
        (lambda copy: shutil.rmtree(copy), "has no results"),
    ],
)
def test_folders_that_cannot_be_archived(change, words, copy, capsys):
    change(copy)
    assert words in refused("archive", ["copy"], capsys)
    assert not Path("copy.zip").exists()


def _rewrite(copy, name, value):
    manifest = read_manifest(copy)
    manifest["settings"][name] = value
    _write(copy, manifest)


def _write(copy, manifest):
    from taichi_ants.files import results

    results._write_manifest(manifest, copy)


def _unfinished(copy):
    (copy / "unfinished").mkdir()
    (copy / "manifest.json").rename(copy / "unfinished/manifest.json")


def changed(source, name, more=(), drops=(), mode=None):
    """Write an archive with other files to `name`, with the same index."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED) as new:
        for one in old.infolist():
            if one.filename not in drops:
                new.writestr(one, old.read(one))
        for path, content in more:
            entry = zipfile.ZipInfo(path)
            entry.external_attr, entry.compress_type = (mode or 0) << 16, zipfile.ZIP_DEFLATED
            new.writestr(entry, content)


def test_bad_archives_are_refused_and_leave_nothing(here, capsys, monkeypatch):
    good = here / "done.zip"
    content = good.read_bytes()
    Path("text.zip").write_text("no archive")
    Path("end.zip").write_bytes(content[:-100])
    changed(good, "slip.zip", [("../evil.py", "")])
    changed(good, "absolute.zip", [("/tmp/evil.py", "")])
    changed(good, "windows.zip", [("C:\\evil.py", "")])
    changed(good, "link.zip", [("link", "/etc/passwd")], mode=stat.S_IFLNK | 0o777)
    changed(good, "more.zip", [("results/more.txt", "")])
    changed(good, "less.zip", drops=["results/runs.csv"])
    changed(good, "other.zip", [("results/runs.csv", "0")], drops=["results/runs.csv"])
    with bundles.reading(good) as bundle:
        altered = bundle.read("results/runs.csv").replace(b",0,", b",1,", 1)
        assert altered != bundle.read("results/runs.csv")
    changed(good, "same.zip", [("results/runs.csv", altered)], drops=["results/runs.csv"])
    changed(good, "plain.zip", drops=["archive.json"])
    changed(good, "index.zip", [("archive.json", "[]")], drops=["archive.json"])
    facts = json.loads(zipfile.ZipFile(good).read("archive.json"))
    later = json.dumps({**facts, "format": 2})
    changed(good, "later.zip", [("archive.json", later)], drops=["archive.json"])
    with pytest.warns(UserWarning, match="Duplicate"):
        changed(good, "twice.zip", [("results/runs.csv", "0")])
    before = {*Path().iterdir()}
    for name, words in {
        "nothing.zip": "no such file",
        "text.zip": "is not an archive of a study",
        "end.zip": "is not an archive of a study, or its end is missing",
        "slip.zip": "the path '../evil.py', which leads out of a folder",
        "absolute.zip": "the path '/tmp/evil.py', which leads out of a folder",
        "windows.zip": "evil.py', which leads out of a folder",
        "link.zip": "is damaged (link is not a file",
        "more.zip": "'results/more.txt' is not in its index",
        "less.zip": "'results/runs.csv' is missing",
        "other.zip": "'results/runs.csv' is shorter than declared",
        "same.zip": "'results/runs.csv' differs from its checksum",
        "plain.zip": "is a zip file, but not an archive of a study",
        "index.zip": "is damaged (",
        "later.zip": "has format 2 of ",
        "twice.zip": "two files have the same name",
    }.items():
        assert words in refused("reproduce", [name, "--trust-plugins"], capsys), name
        assert {*Path().iterdir()} == before
    monkeypatch.setattr(bundles, "MOST_BYTES", 3 * len(content))
    changed(good, "bomb.zip", [("results/zeros", bytes(4 * len(content)))])
    assert Path("bomb.zip").stat().st_size < 2 * len(content)
    assert "unpacks to " in refused("reproduce", ["bomb.zip"], capsys)
    monkeypatch.setattr(bundles, "MOST_FILES", 3)
    assert "at most 3 of " in refused("reproduce", [good], capsys)


def test_a_flipped_bit_never_changes_what_is_read(here):
    content = (here / "done.zip").read_bytes()
    with bundles.reading(here / "done.zip") as bundle:
        right = {name: bundle.read(name) for name in bundle.names}
    found = 0
    for place in range(5, len(content), len(content) // 80):
        Path("flipped.zip").write_bytes(
            content[:place] + bytes([content[place] ^ 4]) + content[place + 1 :]
        )
        try:
            with bundles.reading(Path("flipped.zip")) as bundle:
                assert {name: bundle.read(name) for name in bundle.names} == right
        except AntsError as error:
            found += 1
            assert str(error).endswith(".")  # noqa: PT017
    assert found > 60


def test_an_archive_without_a_new_option_uses_its_default(copy, capsys):
    manifest = read_manifest(copy)
    del manifest["asked"]["options"]["no_figures"]
    _write(copy, manifest)
    assert call("archive", ["copy"], capsys)[0] == 0
    status, out, _ = call("reproduce", ["copy.zip", "--trust-plugins"], capsys)
    assert status == 1
    assert "DIFFERENT  figures/deliveries.png (is not in the archive)\n" in out
    assert "1 of 10 files differ" in out


@pytest.mark.parametrize(
    ("options", "more"),
    [({"plugin": "other.py"}, {}), ({"file": ["my.toml"]}, {}), ({}, {"results/more.csv": "x"})],
)
def test_an_archive_that_reads_or_holds_other_files_than_its_study_is_refused(
    options, more, copy, capsys
):
    """Also with valid checksums."""
    manifest = read_manifest(copy)
    manifest["asked"]["options"] |= options
    _write(copy, manifest)
    assert call("archive", ["copy"], capsys)[0] == 0
    with bundles.reading(Path("copy.zip")) as bundle:
        texts = {name: bundle.read(name) for name in bundle.names}
    contents = {}
    for name, content in texts.items():
        path = Path("unpacked", name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        contents[name] = path
    bundles.write(Path("other.zip"), contents | more, {})
    assert "does not fit its files" in refused(
        "reproduce", ["other.zip", "--trust-plugins"], capsys
    )


@pytest.mark.parametrize(
    ("old", "new"),
    [("preset = ", 'preset = "/etc/hostname" #'), ('policy = "old', 'policy = "../secret.npz" #')],
)
def test_a_study_in_an_archive_reads_no_other_files(old, new, copy, capsys):
    """Also with valid checksums."""
    Path("../secret.npz").write_bytes((copy / "inputs/rule.npz").read_bytes())
    path, manifest = copy / "inputs/my.toml", read_manifest(copy)
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    manifest["files"]["inputs/my.toml"] = checksum_of(path)
    _write(copy, manifest)
    assert call("archive", ["copy"], capsys)[0] == 0
    (wanted,) = [one for one in ("/etc/hostname", "../secret.npz") if one in new]
    status, _, err = call("reproduce", ["copy.zip", "--trust-plugins"], capsys)
    assert status == 2
    assert f"the study reads '{wanted}', which its archive does not contain" in err
    assert not Path("results").exists()


def test_a_changed_import_of_the_plugin_changes_the_study(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my_plugin.py").write_text(PLUGIN)
    Path("ants_halved.py").write_text(BESIDE)
    sweep = SWEEP.replace("MAP", "paper").replace('"old/rule.npz", ', "").partition("[[at]]")[0]
    Path("my.toml").write_text(sweep)
    given = ["my.toml", "--plugin", "my_plugin.py", "--out", "a", "--no-figures"]
    assert call("sweep", given, capsys)[0] == 0
    assert "already has these results" in call("sweep", given, capsys)[1]
    assert "half\n" in Path("a/runs.csv").read_text()
    assert Path("a/runs.csv").read_text().endswith(",1.5\n")
    Path("ants_halved.py").write_text(BESIDE.replace("/ 2", "* 100"))
    assert "(not the same plugin)" in refused("sweep", given, capsys)
    assert call("sweep", [*given, "--force", "--workers", 1], capsys)[0] == 0
    assert Path("a/runs.csv").read_text().endswith(",300.0\n")


def test_an_index_that_declares_less_than_is_there_is_refused(here):
    with bundles.reading(here / "done.zip") as bundle:
        bundle._listed["results/runs.csv"]["bytes"] -= 1
        with pytest.raises(ValueError, match="longer than declared"):
            bundle.read("results/runs.csv")


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
    assert call(name, [*arguments, "--out", "done"], capsys)[0] == 0
    assert call("archive", ["done"], capsys)[0] == 0
    status, out, _ = call("reproduce", ["done.zip"], capsys)
    assert (status, "DIFFERENT" in out) == (0, False)
    assert "equal      report.html (except the time and the machine of the run)\n" in out
    page = "results/reproduced-done/report.html"
    with zipfile.ZipFile("done.zip") as archive:
        altered = archive.read("results/report.html").replace(b"seed", b"sead", 1)
    without_run = reproduction._WITHOUT_RUN["report.html"]
    assert without_run(altered) != without_run(Path(page).read_bytes())
