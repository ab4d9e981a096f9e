"""A folder of results: finished once, never mixed, never lost, whenever the work stops."""

from __future__ import annotations

import hashlib
import json
import os
from argparse import Namespace

import numpy as np
import pytest

from taichi_ants.errors import AntsError
from taichi_ants.files.results import ResultFolder, _write_manifest, seconds_of
from taichi_ants.studies.result_folder import work_or_show

SETTINGS = {"seeds": (0, 1), "rate": np.float32(0.5), "world": {"ranges": [3, 3, 3]}}
OTHER = {**SETTINGS, "rate": 0.25}


def finish(path, settings=SETTINGS, names=("table.csv",), text="result", replace=False):
    """Do a whole piece of work."""
    folder = ResultFolder(path, settings)
    assert replace or not folder.is_finished()
    with folder.work(replace) as (blocks, ready):
        (blocks / "0.npz").write_text(text)
        for name in ("report.txt", *names):
            (ready / name).parent.mkdir(exist_ok=True)
            (ready / name).write_text(text)
        folder.publish(ready, {"made": text})
    return folder


def interrupted_work(path, settings=SETTINGS, replace=False, block="done"):
    """The work stops after one block, or before it."""
    with ResultFolder(path, settings).work(replace) as (blocks, ready):
        if block:
            (blocks / "0.npz").write_text(block)
        (ready / "half").write_text("half")
        raise KeyboardInterrupt


def stop_after_a_block(*arguments, **options):
    with pytest.raises(KeyboardInterrupt):
        interrupted_work(*arguments, **options)


def names(path):
    return sorted(item.name for item in path.iterdir())


def test_finished_work(tmp_path):
    path = tmp_path / "a" / "b"
    folder = finish(path)
    assert names(path) == ["manifest.json", "report.txt", "table.csv"]
    assert (path / "table.csv").read_text() == "result"
    manifest = json.loads((path / "manifest.json").read_text())
    assert manifest.pop("checksum")
    assert manifest == {
        "made": "result",
        "files": dict.fromkeys(["report.txt", "table.csv"], hashlib.sha256(b"result").hexdigest()),
        "settings": {"seeds": [0, 1], "rate": 0.5, "world": {"ranges": [3, 3, 3]}},
    }
    assert folder.is_finished()


def test_blocks_survive_what_is_ready_does_not(tmp_path):
    stop_after_a_block(tmp_path / "out")
    assert names(tmp_path / "out") == ["unfinished"]
    folder = ResultFolder(tmp_path / "out", SETTINGS)
    assert not folder.is_finished()
    with folder.work() as (blocks, ready):
        assert (blocks / "0.npz").read_text() == "done"
        assert names(ready) == []
    assert not folder.is_finished()
    finish(tmp_path / "out")
    assert names(tmp_path / "out") == ["manifest.json", "report.txt", "table.csv"]


def test_time_is_that_of_all_processes_until_their_last_block(tmp_path):
    for n in (1, 2):
        stop_after_a_block(tmp_path, block=f"block {n}")
        last = (tmp_path / "unfinished" / "blocks" / "0.npz").stat().st_mtime
        os.utime(tmp_path / "unfinished" / "manifest.json", (last, last - 100 * n))
    folder = ResultFolder(tmp_path, SETTINGS)
    with folder.work():
        assert folder.seconds_before == pytest.approx(300)
    with folder.work():  # the one before it made nothing that is kept
        assert folder.seconds_before == pytest.approx(300, abs=1)
    with folder.work(replace=True):
        assert folder.seconds_before == 0


def test_work_without_a_block_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        interrupted_work(tmp_path, block="")
    assert names(tmp_path) == []


def test_results_of_other_settings_are_kept_apart(tmp_path):
    finish(tmp_path)
    with pytest.raises(AntsError, match=r"results of .* \(rate is 0.5 instead of 0.25\)"):
        ResultFolder(tmp_path, OTHER).is_finished()
    with pytest.raises(AntsError, match=r"\(not the same more, rate, world\)"):
        ResultFolder(tmp_path, {"seeds": [0, 1], "more": 1}).is_finished()


def test_of_settings_that_follow_from_others_only_these_are_named(tmp_path):
    finish(tmp_path)
    other = {**OTHER, "seeds": (1, 2)}
    with pytest.raises(AntsError, match=r"\(not the same seeds\)"):
        ResultFolder(tmp_path, other, ("seeds", "more")).is_finished()
    with pytest.raises(AntsError, match=r"\(rate is 0.5 instead of 0.25\)"):
        ResultFolder(tmp_path, OTHER, ("seeds", "more")).is_finished()


def test_unfinished_work_of_other_settings_is_kept_apart(tmp_path):
    stop_after_a_block(tmp_path)
    with pytest.raises(AntsError, match=r"unfinished work of .* \(rate is 0.5 instead of"):
        ResultFolder(tmp_path, OTHER).is_finished()
    assert (tmp_path / "unfinished" / "blocks" / "0.npz").exists()


def test_replacing_starts_anew_and_keeps_old_results_until_the_end(tmp_path):
    finish(tmp_path, names=("table.csv", "old.csv"), text="old")
    (tmp_path / "notes.txt").write_text("mine")
    stop_after_a_block(tmp_path, OTHER, replace=True)
    assert (tmp_path / "table.csv").read_text() == "old"
    assert not ResultFolder(tmp_path, OTHER).is_finished()
    finish(tmp_path, OTHER, text="new")
    assert names(tmp_path) == ["manifest.json", "notes.txt", "report.txt", "table.csv"]
    assert (tmp_path / "table.csv").read_text() == "new"
    assert ResultFolder(tmp_path, OTHER).is_finished()


@pytest.mark.parametrize("settings", [SETTINGS, OTHER])
def test_replacing_does_not_use_old_blocks(settings, tmp_path):
    stop_after_a_block(tmp_path)
    with ResultFolder(tmp_path, settings).work(replace=True) as (blocks, _):
        assert names(blocks) == []


def test_blocks_without_a_manifest_are_not_trusted(tmp_path):
    """Where a process was killed while it cleaned up, nobody knows whose blocks are left."""
    stop_after_a_block(tmp_path)
    for name in ("manifest.json", "manifest-copy.json"):
        (tmp_path / "unfinished" / name).unlink()
    with ResultFolder(tmp_path, OTHER).work() as (blocks, _):
        assert names(blocks) == []


def test_what_a_killed_clean_up_has_left_is_removed_with_the_next_look(tmp_path):
    settings = Namespace(out=tmp_path, force=False, no_figures=True, plugin=None, arch="cpu")
    finish(tmp_path, {**SETTINGS, "arch": "cpu", "plugin": None})
    before = names(tmp_path)
    (tmp_path / "unfinished" / "blocks").mkdir(parents=True)
    work_or_show(settings, SETTINGS, lambda blocks, ready: pytest.fail("it is finished"))
    assert names(tmp_path) == before


@pytest.mark.parametrize("moment", ["pathlib.Path.replace", "pathlib.Path.unlink"])
def test_a_kill_while_results_move_up_loses_nothing(moment, tmp_path, monkeypatch):
    finish(tmp_path, names=("table.csv", "old.csv"), text="old")

    def interrupt(*arguments, **options):
        raise KeyboardInterrupt

    folder = ResultFolder(tmp_path, OTHER)
    with folder.work(replace=True) as (blocks, ready):
        (blocks / "0.npz").write_text("done")
        for name in ("report.txt", "table.csv"):
            (ready / name).write_text("new")
        monkeypatch.setattr(moment, interrupt)
        with pytest.raises(KeyboardInterrupt):
            folder.publish(ready, {})
        monkeypatch.undo()
    assert not folder.is_finished()
    assert (tmp_path / "unfinished" / "blocks" / "0.npz").exists()
    finish(tmp_path, OTHER, text="new")
    assert "old.csv" not in names(tmp_path)
    assert (tmp_path / "table.csv").read_text() == "new"


@pytest.mark.parametrize(
    "damage",
    ["", "{", "[]", "[" * 9999, '{"settings": {}}', '{"checksum": "x"}', "\0"],
)
@pytest.mark.parametrize("place", [".", "unfinished"])
def test_a_damaged_manifest_is_named(place, damage, tmp_path):
    if place == ".":
        finish(tmp_path)
    else:
        stop_after_a_block(tmp_path)
    (tmp_path / place / "manifest.json").write_text(damage)
    folder = ResultFolder(tmp_path, SETTINGS)
    if place == "unfinished":
        assert not folder.is_finished()  # by the copy
        (tmp_path / place / "manifest-copy.json").write_text(damage)
    with pytest.raises(AntsError, match=r"manifest\.json' is damaged or .* again with --force"):
        folder.is_finished()
    if place == ".":
        with pytest.raises(AntsError, match=r"manifest\.json' is damaged"):
            folder.work().__enter__()
    assert finish(tmp_path, replace=True).is_finished()
    assert names(tmp_path) == ["manifest.json", "report.txt", "table.csv"]


def test_a_process_that_stops_leaves_the_work_of_others_alone(tmp_path):
    with ResultFolder(tmp_path, SETTINGS).work() as (blocks, ready):
        for replace in (False, False):  # before the first block
            with pytest.raises(KeyboardInterrupt):
                interrupted_work(tmp_path, replace=replace, block=None)
        (ready / "table.csv").write_text("mine")
        (blocks / "0.npz").write_text("done")
    assert not ResultFolder(tmp_path, SETTINGS).is_finished()


def test_a_process_that_begins_leaves_the_folders_of_others_alone(tmp_path, monkeypatch):
    """Another process has made its folders, but not its manifest yet."""
    theirs = tmp_path / "unfinished" / "ready" / "tmp"
    theirs.mkdir(parents=True)
    stop_after_a_block(tmp_path)
    assert theirs.exists()


def test_finished_results_are_shown_beside_other_unfinished_work(tmp_path):
    folder = finish(tmp_path)
    stop_after_a_block(tmp_path, OTHER)
    assert folder.is_finished()
    assert folder.has_other_work()
    with pytest.raises(AntsError, match=r"or remove .*unfinished' to give it up\.$"):
        ResultFolder(tmp_path, {**SETTINGS, "rate": 0.1}).is_finished()
    assert not ResultFolder(tmp_path, OTHER).is_finished()


@pytest.mark.parametrize("name", ["manifest.json", "manifest-copy.json"])
@pytest.mark.parametrize("damage", [None, "{"])
def test_one_copy_of_the_manifest_is_enough_for_the_blocks(name, damage, tmp_path):
    stop_after_a_block(tmp_path)
    path = tmp_path / "unfinished" / name
    path.unlink() if damage is None else path.write_text(damage)
    with pytest.raises(AntsError, match="of other settings"):
        ResultFolder(tmp_path, OTHER).is_finished()
    folder = ResultFolder(tmp_path, SETTINGS)
    assert not folder.is_finished()
    assert seconds_of(tmp_path / "unfinished") >= 0
    with folder.work() as (blocks, _):
        assert (blocks / "0.npz").read_text() == "done"


def test_foreign_files_are_not_written_among(tmp_path):
    (tmp_path / "diary.txt").write_text("mine")
    with pytest.raises(AntsError, match=r"but no finished results;.*--force"):
        ResultFolder(tmp_path, SETTINGS).is_finished()
    assert names(tmp_path) == ["diary.txt"]
    finish(tmp_path, replace=True)
    assert names(tmp_path) == ["diary.txt", "manifest.json", "report.txt", "table.csv"]


def test_two_processes_at_the_same_work_do_not_harm_each_other(tmp_path):
    first = ResultFolder(tmp_path, SETTINGS)
    with first.work() as (blocks, ready):
        (ready / "report.txt").write_text("result")
        (blocks / "0.npz").write_text("done")
        with pytest.raises(KeyboardInterrupt):
            interrupted_work(tmp_path)
        assert (blocks / "0.npz").exists()
        finish(tmp_path)
        assert first.is_finished()
        assert (ready.exists(), blocks.exists()) == (False, False)
    first.check()


def test_only_files_of_the_folder_itself_are_removed(tmp_path):
    """Whatever a manifest lists, and even if a file outside is the same."""
    finish(tmp_path / "out", names=("table.csv", "old.csv"))
    (tmp_path / "precious").write_text("result")
    path = tmp_path / "out" / "manifest.json"
    manifest = json.loads(path.read_text())
    digest = manifest["files"]["old.csv"]
    del manifest["checksum"]
    for name in ("../precious", str(tmp_path / "precious"), "..", "."):
        manifest["files"][name] = digest
    _write_manifest(manifest, path.parent)
    finish(tmp_path / "out", replace=True)
    assert names(tmp_path) == ["out", "precious"]
    assert names(tmp_path / "out") == ["manifest.json", "report.txt", "table.csv"]


def test_an_unfinished_folder_of_ones_own_stays(tmp_path):
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "unfinished" / "novel.txt").write_text("mine")
    finish(tmp_path)
    assert (tmp_path / "unfinished" / "novel.txt").read_text() == "mine"


def test_a_folder_of_ones_own_in_the_way_stays(tmp_path):
    (tmp_path / "table.csv").mkdir()
    (tmp_path / "table.csv" / "mine").write_text("mine")
    with pytest.raises(OSError, match="directory"):
        finish(tmp_path, replace=True)
    assert (tmp_path / "table.csv" / "mine").exists()
    assert not ResultFolder(tmp_path, SETTINGS).is_finished()
    (tmp_path / "table.csv").rename(tmp_path / "elsewhere")
    assert finish(tmp_path).is_finished()


def test_what_lies_behind_a_link_is_not_removed(tmp_path):
    finish(tmp_path / "out", names=("figures/one.png",))
    (tmp_path / "out" / "figures").rename(tmp_path / "figures")
    (tmp_path / "out" / "figures").symlink_to(tmp_path / "figures")
    finish(tmp_path / "out", replace=True)
    assert names(tmp_path / "figures") == ["one.png"]


def test_files_of_ones_own_among_ours_stay(tmp_path):
    """In folders of ours, too."""
    finish(tmp_path, names=("figures/one.png",))
    (tmp_path / "figures" / "mine.png").write_text("mine")
    finish(tmp_path, replace=True)
    assert names(tmp_path / "figures") == ["mine.png"]


ALTERED = {
    "gone": lambda path: path.unlink(),
    "empty": lambda path: path.write_text(""),
    "as long": lambda path: path.write_text("resuLt"),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
}


@pytest.mark.parametrize("change", ALTERED)
def test_what_was_altered_is_noticed(change, tmp_path):
    folder = finish(tmp_path, names=("policy.npz", "figures/one.png"))
    ALTERED[change](tmp_path / "policy.npz")
    said = r"policy\.npz', a part of the results, is missing or has changed .* with --force"
    with pytest.raises(AntsError, match=said):
        folder.check()


@pytest.mark.parametrize(
    ("old", "new"), [('"files"', '"filez"'), ('"a.csv"', '"b.csv"'), ("true", "null")]
)
def test_a_manifest_that_was_altered_is_noticed(old, new, tmp_path):
    folder = finish(tmp_path, {**SETTINGS, "quick": True}, names=("a.csv",))
    path = tmp_path / "manifest.json"
    text = path.read_text()
    assert old in text
    assert folder.is_finished()
    path.write_text(text.replace(old, new))
    for look in (folder.is_finished, folder.check):
        with pytest.raises(AntsError, match=r"manifest\.json' is damaged"):
            look()


def test_a_page_that_is_gone_is_made_again(tmp_path, capsys):
    """And listed among the files; what is altered is not passed over."""
    settings = Namespace(
        out=tmp_path / "out", force=False, no_figures=False, plugin=None, arch="cpu"
    )
    made, again = [], []

    def work(blocks, ready):
        (ready / "report.txt").write_text("result")
        return "new"

    def page(folder, results, manifest):
        assert (folder / "report.txt").read_text() == "result"
        made.append(results)
        return f"page in {manifest['seconds']:.0f} s"

    def run():
        work_or_show(settings, SETTINGS, work, page=page)
        out = capsys.readouterr().out
        assert out.splitlines()[-1] == str(settings.out / "report.html")
        again.append(
            "report.html was missing and has been written again from the other files." in out
        )
        return json.loads((settings.out / "manifest.json").read_text())

    first = run()
    whole = (settings.out / "report.html").read_bytes()
    assert first["files"]["report.html"] == hashlib.sha256(whole).hexdigest()
    assert run() == first
    assert made == ["new"]
    (settings.out / "report.html").unlink()
    assert run() == first
    assert (settings.out / "report.html").read_bytes() == whole
    assert made == ["new", None]
    assert again == [False, False, True]  # and this is said
    (settings.out / "report.html").write_text("mine")
    with pytest.raises(AntsError, match=r"report\.html', a part of the results, is missing"):
        run()


@pytest.mark.parametrize("place", ["file", "file/below", "/proc/nothing", "a\0b"])
def test_folders_that_cannot_be_written(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("in the way")
    folder = ResultFolder(place, SETTINGS)
    assert not folder.is_finished()
    with pytest.raises(AntsError, match="cannot write"):
        folder.work().__enter__()
    assert names(tmp_path) == ["file"]


def test_a_full_disk_while_publishing_loses_nothing(tmp_path, monkeypatch):
    folder = ResultFolder(tmp_path / "out", SETTINGS)

    def fail(*arguments):
        raise OSError(28, os.strerror(28))

    with folder.work() as (blocks, ready):
        (blocks / "0.npz").write_text("done")
        (ready / "table.csv").write_text("new")
        monkeypatch.setattr("pathlib.Path.replace", fail)
        with pytest.raises(OSError, match="No space left"):
            folder.publish(ready, {})
    monkeypatch.undo()
    finish(tmp_path / "out")
