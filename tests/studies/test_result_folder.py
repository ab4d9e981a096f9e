"""A folder of results: finished once, never mixed, never lost, whenever the work stops."""

from __future__ import annotations

import hashlib
import json
import os
import signal

import numpy as np
import pytest

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.studies.interruption import stoppable
from taichi_ants.studies.result_folder import ResultFolder

SETTINGS = {"seeds": (0, 1), "rate": np.float32(0.5), "world": {"ranges": [3, 3, 3]}}
OTHER = {**SETTINGS, "rate": 0.25}


def finish(path, settings=SETTINGS, names=("table.csv",), text="result", replace=False):
    """Do a whole piece of work."""
    folder = ResultFolder(path, settings)
    with folder.work(replace) as (blocks, ready):
        (blocks / "block").write_text(text)
        for name in names:
            (ready / name).write_text(text)
        folder.publish({"made": text})
    return folder


def interrupted_work(path, settings=SETTINGS, replace=False, block="done"):
    """The work stops after one block, or before it."""
    with ResultFolder(path, settings).work(replace) as (blocks, ready):
        if block:
            (blocks / "block").write_text(block)
        (ready / "half").write_text("half")
        raise KeyboardInterrupt


def stop_after_a_block(*arguments, **options):
    with pytest.raises(KeyboardInterrupt):
        interrupted_work(*arguments, **options)


def names(path):
    return sorted(item.name for item in path.iterdir())


def test_finished_work(tmp_path):
    path = tmp_path / "a" / "b"
    assert not ResultFolder(path, SETTINGS).is_finished()
    finish(path)
    assert names(path) == ["manifest.json", "table.csv"]
    assert (path / "table.csv").read_text() == "result"
    manifest = json.loads((path / "manifest.json").read_text())
    assert manifest == {
        "made": "result",
        "files": {"table.csv": {"bytes": 6, "sha256": hashlib.sha256(b"result").hexdigest()}},
        "settings": {"seeds": [0, 1], "rate": 0.5, "world": {"ranges": [3, 3, 3]}},
    }
    assert ResultFolder(path, SETTINGS).is_finished()
    assert not ResultFolder(path, OTHER).is_finished()


def test_blocks_survive_what_is_ready_does_not(tmp_path):
    stop_after_a_block(tmp_path / "out")
    assert names(tmp_path / "out") == ["unfinished"]
    with ResultFolder(tmp_path / "out", SETTINGS).work() as (blocks, ready):
        assert (blocks / "block").read_text() == "done"
        assert names(ready) == []
    assert not ResultFolder(tmp_path / "out", SETTINGS).is_finished()
    finish(tmp_path / "out")
    assert names(tmp_path / "out") == ["manifest.json", "table.csv"]


@pytest.mark.parametrize("existed", [False, True])
def test_work_without_a_block_leaves_nothing(existed, tmp_path):
    path = tmp_path / "new" / "out"
    if existed:
        path.mkdir(parents=True)
    with pytest.raises(KeyboardInterrupt):
        interrupted_work(path, block="")
    assert path.exists() == existed
    assert (tmp_path / "new").exists() == existed
    assert not existed or names(path) == []


def test_an_interruption_while_folders_are_made_leaves_nothing(tmp_path, monkeypatch):
    def interrupt(folder, lock):
        raise KeyboardInterrupt

    monkeypatch.setattr(ResultFolder, "_prepare", interrupt)
    with pytest.raises(KeyboardInterrupt), ResultFolder(tmp_path / "a" / "b", SETTINGS).work():
        pass
    assert names(tmp_path) == []


def test_results_of_other_settings_are_kept_apart(tmp_path):
    finish(tmp_path)
    with pytest.raises(AntsError, match=r"results of other settings \(rate differ\)"):
        ResultFolder(tmp_path, OTHER).work().__enter__()
    with pytest.raises(AntsError, match=r"\(more, rate, world differ\)"):
        ResultFolder(tmp_path, {"seeds": [0, 1], "more": 1}).work().__enter__()
    assert names(tmp_path) == ["manifest.json", "table.csv"]
    assert ResultFolder(tmp_path, SETTINGS).is_finished()


def test_unfinished_work_of_other_settings_is_kept_apart(tmp_path):
    stop_after_a_block(tmp_path)
    with pytest.raises(AntsError, match=r"unfinished work of other settings \(rate differ\)"):
        ResultFolder(tmp_path, OTHER).work().__enter__()
    assert (tmp_path / "unfinished" / "blocks" / "block").exists()


def test_replacing_starts_anew_and_keeps_old_results_until_the_end(tmp_path):
    finish(tmp_path, names=("table.csv", "old.csv"), text="old")
    (tmp_path / "notes.txt").write_text("mine")
    stop_after_a_block(tmp_path, OTHER, replace=True)
    assert (tmp_path / "table.csv").read_text() == "old"
    assert not ResultFolder(tmp_path, SETTINGS).is_finished()  # the work on the others is not done
    finish(tmp_path, OTHER, text="new")
    assert names(tmp_path) == ["manifest.json", "notes.txt", "table.csv"]
    assert (tmp_path / "table.csv").read_text() == "new"
    assert ResultFolder(tmp_path, OTHER).is_finished()


@pytest.mark.parametrize("settings", [SETTINGS, OTHER])
def test_replacing_does_not_use_old_blocks(settings, tmp_path):
    stop_after_a_block(tmp_path)
    with ResultFolder(tmp_path, settings).work(replace=True) as (blocks, _):
        assert names(blocks) == []


def test_blocks_without_settings_are_not_trusted(tmp_path):
    """Where a process was killed while it cleaned up, nobody knows whose blocks are left."""
    stop_after_a_block(tmp_path)
    (tmp_path / "unfinished" / "settings.json").unlink()
    with ResultFolder(tmp_path, OTHER).work() as (blocks, _):
        assert names(blocks) == []


def test_left_overs_of_a_killed_clean_up_do_not_matter(tmp_path):
    finish(tmp_path)
    (tmp_path / "unfinished" / "blocks").mkdir(parents=True)
    assert ResultFolder(tmp_path, SETTINGS).is_finished()


def test_an_interrupted_clean_up_does_not_undo_the_work(tmp_path, monkeypatch):
    def interrupt(folder, **options):
        raise KeyboardInterrupt

    folder = ResultFolder(tmp_path, SETTINGS)
    with folder.work() as (blocks, ready):
        (blocks / "block").write_text("done")
        (ready / "table.csv").write_text("result")
        monkeypatch.setattr("shutil.rmtree", interrupt)
        with pytest.raises(KeyboardInterrupt):
            folder.publish({})
        monkeypatch.undo()
    assert folder.is_finished()


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"settings": 3}', "\0"])
def test_damaged_settings_are_of_no_settings(damage, tmp_path):
    stop_after_a_block(tmp_path)
    (tmp_path / "unfinished" / "settings.json").write_text(damage)
    with pytest.raises(AntsError, match="unfinished work whose settings are damaged"):
        ResultFolder(tmp_path, SETTINGS).work().__enter__()


def test_a_damaged_manifest_is_of_no_settings(tmp_path):
    finish(tmp_path)
    (tmp_path / "manifest.json").write_text("{}")
    assert not ResultFolder(tmp_path, SETTINGS).is_finished()
    with pytest.raises(AntsError, match="results whose settings are damaged"):
        ResultFolder(tmp_path, SETTINGS).work().__enter__()
    finish(tmp_path, replace=True)
    assert ResultFolder(tmp_path, SETTINGS).is_finished()


def test_foreign_files_are_not_written_among(tmp_path):
    (tmp_path / "diary.txt").write_text("mine")
    with pytest.raises(AntsError, match=r"no finished results .*--force"):
        ResultFolder(tmp_path, SETTINGS).work().__enter__()
    assert names(tmp_path) == ["diary.txt"]
    finish(tmp_path, replace=True)
    assert names(tmp_path) == ["diary.txt", "manifest.json", "table.csv"]


def test_an_empty_folder_can_be_used(tmp_path):
    finish(tmp_path)
    assert ResultFolder(tmp_path, SETTINGS).is_finished()


def test_one_process_at_a_time(tmp_path):
    with ResultFolder(tmp_path, SETTINGS).work() as (blocks, _):
        for replace in (False, True):
            with pytest.raises(AntsError, match="another process"):
                ResultFolder(tmp_path, SETTINGS).work(replace).__enter__()
        assert blocks.is_dir()
        (blocks / "block").write_text("done")
    assert (tmp_path / "unfinished" / "blocks" / "block").exists()
    finish(tmp_path)


def test_what_is_in_the_way_is_replaced(tmp_path):
    """A file where a folder goes, a folder where a file goes, links: their targets stay."""
    target = tmp_path / "target"
    target.mkdir()
    (target / "precious").write_text("mine")
    path = tmp_path / "out"
    path.mkdir()
    (path / "figures").write_text("a file")
    (path / "table.csv").mkdir()
    (path / "policies").symlink_to(target)
    folder = ResultFolder(path, SETTINGS)
    with folder.work(replace=True) as (_, ready):
        for name in ("figures", "policies"):
            (ready / name).mkdir()
            (ready / name / "x").write_text("new")
        (ready / "table.csv").write_text("new")
        folder.publish({})
    assert (path / "figures" / "x").read_text() == (path / "policies" / "x").read_text() == "new"
    assert (path / "table.csv").read_text() == "new"
    assert names(target) == ["precious"]


def test_only_files_of_the_folder_itself_are_replaced(tmp_path):
    """A manifest from elsewhere cannot make us remove what lies outside."""
    finish(tmp_path / "out")
    (tmp_path / "precious").write_text("mine")
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    listed = dict.fromkeys(["../precious", str(tmp_path / "precious"), "..", ".", "table.csv"])
    (tmp_path / "out" / "manifest.json").write_text(json.dumps({**manifest, "files": listed}))
    finish(tmp_path / "out", replace=True, names=("new.csv",))
    assert names(tmp_path) == ["out", "precious"]
    assert names(tmp_path / "out") == ["manifest.json", "new.csv"]


def test_additions(tmp_path):
    folder = finish(tmp_path)
    with folder.addition() as place:
        (place / "figures").mkdir()
        (place / "figures" / "one.png").write_text("drawn")
        assert "figures" not in names(tmp_path)
    assert names(tmp_path) == ["figures", "manifest.json", "table.csv"]
    assert folder.is_finished()
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert set(manifest["files"]) == {"figures/one.png", "table.csv"}
    assert manifest["made"] == "result"
    finish(tmp_path, replace=True)  # what was added goes with the results
    assert names(tmp_path) == ["manifest.json", "table.csv"]


def test_what_is_gone_is_noticed(tmp_path):
    folder = finish(tmp_path, names=("table.csv", "policy.npz"))
    with folder.addition() as place:
        (place / "figures").mkdir()
        for name in ("one.png", "two.png"):
            (place / "figures" / name).write_text("drawn")
    folder.check_whole()
    assert [folder.lacks(name) for name in ("figures", "table.csv", "renders")] == [
        False,
        False,
        True,
    ]
    (tmp_path / "figures" / "two.png").unlink()
    assert folder.lacks("figures")
    folder.check_whole(apart_from={"figures"})
    with pytest.raises(
        AntsError, match=r"figures/two\.png', a part of the results, is gone or empty"
    ):
        folder.check_whole()
    (tmp_path / "policy.npz").write_text("")
    with pytest.raises(AntsError, match=r"policy\.npz', .* give --force"):
        folder.check_whole(apart_from={"figures"})


ALTERED = {
    "longer": lambda path: path.write_text("result, improved"),
    "as long": lambda path: path.write_text("resuLt"),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
}


@pytest.mark.parametrize("change", ALTERED)
def test_what_was_altered_is_noticed(change, tmp_path):
    folder = finish(tmp_path, names=("policy.npz", "table.csv"))
    folder.check_whole()
    ALTERED[change](tmp_path / "table.csv")
    before = names(tmp_path)
    with pytest.raises(
        AntsError, match=r"table\.csv', a part of the results, (was altered|is gone)"
    ):
        folder.check_whole()
    assert names(tmp_path) == before


def test_a_manifest_that_lists_nothing_is_damaged(tmp_path):
    folder = finish(tmp_path)
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    (tmp_path / "manifest.json").write_text(json.dumps({**manifest, "files": ["table.csv"]}))
    with pytest.raises(AntsError, match=r"manifest\.json' is damaged; give --force"):
        folder.check_whole()


def add_a_picture(folder, name="one.png"):
    with folder.addition() as place:
        (place / "figures").mkdir()
        (place / "figures" / name).write_text("drawn")


def test_files_of_ones_own_among_ours_stay(tmp_path):
    """In folders of ours, too, and whether pictures are drawn again or all is replaced."""
    folder = finish(tmp_path)
    add_a_picture(folder)
    (tmp_path / "figures" / "mine.png").write_text("mine")
    add_a_picture(folder, "two.png")
    assert names(tmp_path / "figures") == ["mine.png", "two.png"]
    folder.check_whole()
    finish(tmp_path, replace=True)
    assert names(tmp_path) == ["figures", "manifest.json", "table.csv"]
    assert names(tmp_path / "figures") == ["mine.png"]


def test_a_folder_of_ones_own_in_the_way_stays(tmp_path):
    (tmp_path / "table.csv").mkdir()
    (tmp_path / "table.csv" / "mine").write_text("mine")
    with pytest.raises(AntsError, match=r"cannot write to .*table\.csv': directory not empty"):
        finish(tmp_path, replace=True)
    assert (tmp_path / "table.csv" / "mine").exists()
    assert not ResultFolder(tmp_path, SETTINGS).is_finished()
    (tmp_path / "table.csv").rename(tmp_path / "elsewhere")
    finish(tmp_path)
    assert ResultFolder(tmp_path, SETTINGS).is_finished()


def test_what_lies_behind_a_link_is_not_ours(tmp_path):
    folder = finish(tmp_path / "out")
    add_a_picture(folder)
    (tmp_path / "out" / "figures").rename(tmp_path / "figures")
    (tmp_path / "out" / "figures").symlink_to(tmp_path / "figures")
    finish(tmp_path / "out", replace=True)
    assert names(tmp_path / "figures") == ["one.png"]


def test_what_a_kill_has_left_of_a_clean_up_goes(tmp_path):
    folder = finish(tmp_path)
    (tmp_path / "unfinished" / "blocks").mkdir(parents=True)
    (tmp_path / "unfinished" / "blocks" / "block").write_text("done")
    folder.check_whole()
    assert names(tmp_path) == ["manifest.json", "table.csv"]


def test_what_another_process_adds_is_no_left_over(tmp_path):
    folder = finish(tmp_path)
    with folder.addition() as place:
        folder.check_whole()
        assert place.is_dir()


def test_files_that_a_kill_or_a_full_disk_has_left_half_written_do_not_matter(tmp_path):
    (tmp_path / ".0123456789abcdef.tmp").write_text("half")
    finish(tmp_path)
    assert names(tmp_path) == ["manifest.json", "table.csv"]
    for theirs in (".0123456789abcdeg.tmp", ".vimrc.tmp"):
        (tmp_path / "other" / theirs).mkdir(parents=True)
        with pytest.raises(AntsError, match="no finished results"):
            ResultFolder(tmp_path / "other", SETTINGS).work().__enter__()
        (tmp_path / "other" / theirs).rmdir()


@pytest.mark.parametrize(
    ("owner", "name"),
    [
        *((files, "check_writable_folder"), (ResultFolder, "_lock")),
        *((ResultFolder, "_prepare"), (files, "write_json")),
    ],
)
def test_ctrl_c_while_folders_are_made_leaves_nothing(owner, name, tmp_path, monkeypatch):
    real = getattr(owner, name)

    def interrupted(*arguments):
        value = real(*arguments)
        signal.raise_signal(signal.SIGINT)
        return value

    monkeypatch.setattr(owner, name, interrupted)
    with (
        pytest.raises(SystemExit),
        stoppable(),
        ResultFolder(tmp_path / "a" / "b", SETTINGS).work(),
    ):
        pytest.fail("the work has begun")
    assert names(tmp_path) == []


def test_an_addition_that_was_killed_leaves_nothing_for_ever(tmp_path):
    folder = finish(tmp_path)
    left = tmp_path / "unfinished" / "ready" / "figures"
    left.mkdir(parents=True)
    (left / "half.png").write_text("half")
    assert folder.is_finished()
    with folder.addition() as place:
        assert list(place.iterdir()) == []
    assert names(tmp_path) == ["manifest.json", "table.csv"]


def test_additions_wait_for_nobody(tmp_path):
    folder = finish(tmp_path)
    with folder.addition(), pytest.raises(AntsError, match="another process"):
        folder.addition().__enter__()
    assert folder.is_finished()


def test_what_fails_beside_an_addition_is_not_taken_for_its_place(tmp_path):
    with pytest.raises(FileNotFoundError), finish(tmp_path).addition():
        (tmp_path / "gone.csv").read_text()
    assert names(tmp_path) == ["manifest.json", "table.csv"]


def test_additions_that_fail_leave_nothing(tmp_path):
    def add_half(folder):
        with folder.addition() as place:
            (place / "half").write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        add_half(finish(tmp_path))
    assert names(tmp_path) == ["manifest.json", "table.csv"]


@pytest.mark.parametrize("place", ["file", "file/below", "/proc/nothing", "a\0b", "x" * 300])
def test_folders_that_cannot_be_written(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("in the way")
    folder = ResultFolder(place, SETTINGS)
    assert not folder.is_finished()
    with pytest.raises(AntsError, match="cannot write"):
        folder.work().__enter__()
    assert names(tmp_path) == ["file"]


def test_errors_of_the_system_while_publishing(tmp_path, monkeypatch):
    folder = ResultFolder(tmp_path / "out", SETTINGS)
    with folder.work() as (blocks, ready):
        (blocks / "block").write_text("done")
        (ready / "table.csv").write_text("new")

        def fail(*arguments):
            raise OSError(28, os.strerror(28))

        monkeypatch.setattr("pathlib.Path.replace", fail)
        with pytest.raises(AntsError, match="no space left"):
            folder.publish({})
    assert not folder.is_finished()
    monkeypatch.undo()
    finish(tmp_path / "out")
