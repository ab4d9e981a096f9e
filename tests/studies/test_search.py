"""Searches: what they find, what they prune, and that an interruption changes nothing."""

from __future__ import annotations

import math
import re
import sys

import numpy as np
import optuna
import pytest
from command_lines import call

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.studies import search
from taichi_ants.studies.search import Search
from taichi_ants.studies.sweep import Sweep, sweep_of

TEXT = """
kind = "colony"
seeds = 6
ants = 2
episodes = 0
ticks = 30
rollouts = 1
policy = "trail_follower"

[search]
maximise = "deliveries"
trials = 40
prune_after = 2
held_out = 12
vary.task.pheromone.half_life = { from = 10, to = 1000, scale = "log" }
vary.task.pheromone.level = { from = 1, to = 200 }
vary.task.pheromone.view = ["half", "strongest"]

[task]
pheromone.evaporation = "exponential"
pheromone.half_life = 20
"""


def read(text=TEXT):
    return Search.of(files.tomllib.loads(text))


@pytest.fixture
def plain(monkeypatch):
    """Replaces colonies by a function of the settings, with its maximum of 0 and noise by seed."""

    def measured(self, blocks, progress, **where):
        rows = []
        for point in self.study.points:
            trail = point.task.pheromone
            best = -abs(math.log10(trail.half_life / 100)) - abs(trail.level - 120) / 100
            view = -float(trail.view == "half")
            rows.append([best + view + math.sin(seed) for seed in self.study.seeds])
        progress(1.0)
        return {"deliveries": np.array(rows)}

    monkeypatch.setattr(Sweep, "measured", measured)


def test_the_best_settings_are_near_the_maximum(plain, tmp_path):
    shares = []
    asked = read()
    found = asked.measured(tmp_path, shares.append)
    best = found.trials[found.best].settings
    assert best["task.pheromone.view"] == "strongest"
    assert 40 < best["task.pheromone.half_life"] < 250
    assert 60 < best["task.pheromone.level"] < 180
    assert type(best["task.pheromone.level"]) is int
    values = [one.values["deliveries"].mean() for one in found.trials if one.state == "complete"]
    assert found.trials[found.best].values["deliveries"].mean() == max(values)
    default, chosen = found.held_out["deliveries"]
    assert chosen.mean() - default.mean() > 1
    assert asked.held_out == tuple(range(6, 18))
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)


def test_what_is_minimised_is_the_other_end(plain, tmp_path):
    found = read(TEXT.replace("maximise", "minimise")).measured(tmp_path, lambda share: None)
    best = found.trials[found.best].settings
    assert best["task.pheromone.view"] == "half"
    assert best["task.pheromone.level"] < 40 or best["task.pheromone.half_life"] < 20


def test_trials_below_the_median_are_pruned(plain, tmp_path):
    found = read().measured(tmp_path, lambda share: None)
    pruned = [one for one in found.trials if one.state == "pruned"]
    assert len(pruned) > 5
    assert {len(one.values["deliveries"]) for one in pruned} <= {2, 4}
    whole = [one.values["deliveries"] for one in found.trials[:5]]
    assert {len(values) for values in whole} == {6}  # there is no median yet
    first = found.trials.index(pruned[0])
    n = len(pruned[0].values["deliveries"])
    earlier = [one.values["deliveries"][:n].mean() for one in found.trials[:first]]
    assert pruned[0].values["deliveries"].mean() < np.median(earlier)
    without = TEXT.replace("prune_after = 2", "prune = false")
    found = read(without).measured(tmp_path, lambda share: None)
    assert {one.state for one in found.trials} == {"complete"}


def test_a_search_depends_on_its_seed_only(plain, tmp_path):
    def settings(text):
        found = read(text).measured(tmp_path, lambda share: None)
        return [one.settings for one in found.trials]

    first = settings(TEXT)
    assert first == settings(TEXT)
    assert first != settings(TEXT.replace("[search]", "[search]\nseed = 1"))
    assert first[:30] == settings(TEXT.replace("trials = 40", "trials = 30"))


def test_a_trial_that_is_not_allowed_is_left_out(plain, tmp_path, monkeypatch):
    asked, point = read(), search.Base.point

    def refuses(self, row, built):
        if row.get("task.pheromone.level", 0) > 100:
            raise AntsError("too much.")
        return point(self, row, built)

    monkeypatch.setattr(search.Base, "point", refuses)
    found = asked.measured(tmp_path, lambda share: None)
    failed = [one for one in found.trials if one.state == "failed"]
    assert len(failed) > 3
    for one in found.trials:
        assert (one.settings["task.pheromone.level"] > 100) == (one in failed)
        assert bool(one.values) == (one not in failed)
    asked.write(found, tmp_path, draws=True)
    assert "failed" in (tmp_path / "report.txt").read_text("utf-8")


def test_a_search_without_values_says_so(tmp_path, monkeypatch):
    def missing(self, blocks, progress, **where):
        return {"deliveries": np.full((1, len(self.study.seeds)), np.nan)}

    monkeypatch.setattr(Sweep, "measured", missing)
    with pytest.raises(AntsError, match="no trial of 40 has a value of deliveries"):
        read().measured(tmp_path, lambda share: None)


def test_results_of_a_search(plain, tmp_path):
    asked = read()
    found = asked.measured(tmp_path, lambda share: None)
    asked.write(found, tmp_path, draws=True)
    rows = files.read_csv(tmp_path / "trials.csv")
    assert [row["trial"] for row in rows] == list(range(40))
    for row, one in zip(rows, found.trials, strict=True):
        assert (row["state"], row["seeds"]) == (one.state, len(one.values["deliveries"]))
        assert row["task.pheromone.half_life"] == one.settings["task.pheromone.half_life"]
        assert row["deliveries"] == one.values["deliveries"].mean()
    held = files.read_csv(tmp_path / "held_out.csv")
    assert [row["seed"] for row in held] == list(asked.held_out)
    assert [row["default"] for row in held] == found.held_out["deliveries"][0].tolist()
    assert all(row["difference"] == row["best"] - row["default"] for row in held)
    report = (tmp_path / "report.txt").read_text("utf-8")
    differences = [row["difference"] for row in held]
    assert f"paired by seed: {np.mean(differences):.4g} [" in " ".join(report.split())
    assert "Finding: better." in report
    assert re.search(r"half_life +20 ", report)
    assert re.search(r"level +250 ", report)  # the default of the setting
    assert (tmp_path / "figures" / "search.png").stat().st_size > 10_000


def test_less_of_what_is_minimised_is_better(plain, tmp_path):
    asked = read(TEXT.replace("maximise", "minimise"))
    found = asked.measured(tmp_path, lambda share: None)
    asked.write(found, tmp_path, draws=False)
    report = " ".join((tmp_path / "report.txt").read_text("utf-8").split())
    mean, low, high = map(
        float, re.search(r"paired by seed: (\S+) \[(\S+), (\S+)\]", report).groups()
    )
    assert low <= mean <= high < 0
    assert "has the lowest deliveries" in report
    assert "Finding: better." in report


def test_the_storage_is_one_that_optuna_reads(plain, tmp_path):
    asked = read(TEXT.replace("trials = 40", "trials = 9"))
    found = asked.measured(tmp_path, lambda share: None)
    asked.write(found, tmp_path, draws=False)
    backend = optuna.storages.journal.JournalFileBackend(str(tmp_path / search.STORAGE))
    storage = optuna.storages.JournalStorage(backend)
    loaded = optuna.load_study(study_name="search", storage=storage)
    assert loaded.best_trial.number == found.best
    assert [one.params for one in loaded.trials] == [one.settings for one in found.trials]
    states = [one.state.name.lower() for one in loaded.trials]
    assert states == [one.state for one in found.trials]
    assert "pruned" in states
    values = loaded.best_trial.user_attrs["values"]["deliveries"]
    assert values == found.trials[found.best].values["deliveries"].tolist()


def test_the_best_file_runs_the_best_settings(plain, tmp_path):
    asked = read(TEXT.replace("trials = 40", "trials = 6"))
    found = asked.measured(tmp_path, lambda share: None)
    text = asked.best_file(found)
    sweep = sweep_of(files.tomllib.loads(text))
    assert sweep.settings == (found.trials[found.best].settings,)
    held = asked.base._replace(seeds=asked.held_out)
    assert sweep.study.points == (held.point(found.trials[found.best].settings, {}),)
    assert sweep.study.seeds == asked.held_out


def test_a_world_for_each_seed_is_that_of_the_seed(tmp_path):
    worlds = '[world]\npreset = "open"\nper_seed = true\nranges = [12, 12, 12]\n[task]'
    text = TEXT.replace("[task]", worlds).replace("trials = 40", "trials = 2")
    text = text.replace("held_out = 12", "held_out = 4")
    found = read(text).measured(tmp_path / "a", lambda share: None)
    text = text.replace("prune_after = 2", "prune = false")
    whole = read(text).measured(tmp_path / "b", lambda share: None)
    for one, other in zip(found.trials, whole.trials, strict=True):
        assert one.settings == other.settings
        assert one.values["deliveries"].tolist() == other.values["deliveries"].tolist()
    default, _ = whole.held_out["deliveries"]
    base = read(text).base._replace(seeds=read(text).held_out)
    assert base.point({}, {}).world[0] != base.point({}, {}).world[1]
    assert len(set(default.tolist())) > 1


class Stopped(BaseException):
    """An interruption."""


@pytest.mark.parametrize("after", [1, 13])
def test_a_search_that_was_stopped_resumes_with_the_same_trials(after, tmp_path, monkeypatch):
    text = TEXT.replace("trials = 40", "trials = 7").replace("held_out = 12", "held_out = 4")
    whole = read(text).measured(tmp_path / "whole", lambda share: None)
    do, done = search.ColonyPoint.do, []

    def stops(*arguments):
        if len(done) == after:
            raise Stopped
        done.append(1)
        return do(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(search.ColonyPoint, "do", staticmethod(stops))
        with pytest.raises(Stopped):
            read(text).measured(tmp_path / "parts", lambda share: None)
        done.clear()
    monkeypatch.setattr(search.ColonyPoint, "do", staticmethod(lambda *a: done.append(1) or do(*a)))
    resumed = read(text).measured(tmp_path / "parts", lambda share: None)
    total = sum(math.ceil(len(one.values["deliveries"]) / 2) for one in whole.trials) + 2
    assert len(done) == total - after  # finished parts are not computed again
    assert resumed.best == whole.best
    for one, other in zip(resumed.trials, whole.trials, strict=True):
        assert (one.settings, one.state) == (other.settings, other.state)
        assert one.values["deliveries"].tolist() == other.values["deliveries"].tolist()


def test_a_finished_search_continues_with_more_trials(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    few = TEXT.replace("trials = 40", "trials = 5").replace("held_out = 12", "held_out = 4")
    do, done = search.ColonyPoint.do, []
    monkeypatch.setattr(search.ColonyPoint, "do", staticmethod(lambda *a: done.append(1) or do(*a)))
    counts = {}
    for out, trials in (("grown", 5), ("grown", 9), ("whole", 9), ("grown", 9), ("grown", 4)):
        done.clear()
        (tmp_path / "my.toml").write_text(few.replace("trials = 5", f"trials = {trials}"))
        status, _, err = call("sweep", ["my.toml", "--out", out, "--no-figures"], capsys)
        assert status == 2 * (trials == 4)
        counts.setdefault(out, []).append(len(done))
    assert "search.trials is 9 instead of 4" in err  # fewer trials are refused
    first, then, shown, refused = counts["grown"]
    assert (shown, refused) == (0, 0)
    assert first + then == counts["whole"][0] + 2  # the comparison with held-out seeds runs again
    for name in ("trials.csv", "held_out.csv", "best.toml", "report.txt"):
        assert (tmp_path / "grown" / name).read_text() == (tmp_path / "whole" / name).read_text()


def test_a_finished_search_continues_with_more_held_out_seeds(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    few = TEXT.replace("trials = 40", "trials = 4")
    do, done = search.ColonyPoint.do, []
    monkeypatch.setattr(search.ColonyPoint, "do", staticmethod(lambda *a: done.append(1) or do(*a)))
    for out, held_out in (("grown", "4"), ("grown", "[9, 8, 7, 6, 10]"), ("whole", "5")):
        done.clear()
        (tmp_path / "my.toml").write_text(few.replace("held_out = 12", f"held_out = {held_out}"))
        status, _, err = call("sweep", ["my.toml", "--out", out, "--no-figures"], capsys)
        assert (status, err) == (0, "")
        assert out == "whole" or held_out == "4" or len(done) == 2  # no trial runs again
    for name in ("trials.csv", "report.txt"):
        assert (tmp_path / "grown" / name).read_text() == (tmp_path / "whole" / name).read_text()
    (tmp_path / "my.toml").write_text(few.replace("held_out = 12", "held_out = [11, 12]"))
    status, _, err = call("sweep", ["my.toml", "--out", "grown", "--no-figures"], capsys)
    assert status == 2
    assert "(not the same search.held_out)" in err
    assert "  finished: results with 4 trials, since 2" in call("status", ["grown"], capsys)[1]


def test_the_state_of_a_search_that_was_stopped(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    do, done = search.ColonyPoint.do, []

    def stops(*arguments):
        if len(done) == 7:
            raise KeyboardInterrupt
        done.append(1)
        return do(*arguments)

    monkeypatch.setattr(search.ColonyPoint, "do", staticmethod(stops))
    monkeypatch.setattr(search, "_WRITE_EVERY", 0.0)
    (tmp_path / "my.toml").write_text(TEXT.replace("prune_after = 2", "prune = false"))
    assert call("sweep", ["my.toml", "--out", "out", "--no-figures"], capsys)[0] == 130
    _, out, _ = call("status", ["out"], capsys)
    assert "unfinished: 7 of 40 trials done, in 7 blocks" in out
    assert "left: about " in out
    assert "finished" not in out.replace("unfinished", "")
    rows = files.read_csv("out/unfinished/rows/trials.csv")
    best = max(rows, key=lambda one: one["deliveries"])
    assert f"best: trial {best['trial']:.0f}, deliveries {best['deliveries']:.4g}\n" in out
    storage = optuna.storages.JournalStorage(
        optuna.storages.journal.JournalFileBackend("out/unfinished/rows/optuna.journal")
    )
    stored = optuna.load_study(study_name="search", storage=storage)
    assert [one.value for one in stored.trials] == [one["deliveries"] for one in rows]


def test_trials_that_the_world_or_the_rules_refuse_only_fail(plain, tmp_path):
    """Also the first one; a search none of whose trials is allowed is refused at once."""
    many = TEXT.replace("vary.task.pheromone.level", "vary.ants = { from = 1, to = 900 }\n#")
    found = read(many.replace("trials = 40", "trials = 12")).measured(tmp_path, lambda share: None)
    failed = [one.settings["ants"] for one in found.trials if one.state == "failed"]
    others = [one.settings["ants"] for one in found.trials if one.state != "failed"]
    assert max(others) < min(failed)
    for seed in range(4):
        read(many.replace("trials = 40", f"trials = 12\nseed = {seed}"))
    with pytest.raises(AntsError, match="the number of ants"):
        read(many.replace("from = 1, to = 900", "from = 5000, to = 9000"))


WRONG = {
    "no table": ("[search]", "[task.life]\n[search.x]", ["`search.x` is not a setting"]),
    "key": ("trials = 40", "trails = 40", ["`search.trails`", "trials"]),
    "aim": ('maximise = "deliveries"', "", ["no aim", "maximise or minimise"]),
    "aims": ("trials =", 'minimise = "blocked"\ntrials =', ["maximise and minimise"]),
    "measure": ('"deliveries"', '"delivery"', ["'delivery'", "deliveries"]),
    "other measures": ("seeds = 6", 'seeds = 6\nmeasures = ["blocked"]', ["measures are blocked"]),
    "vary": ("[task]", "[vary]\nticks = [1, 2]\n[task]", ["vary and [search]", "[search.vary]"]),
    "design": ("seeds = 6", 'seeds = 6\ndesign = "sobol"', ["design and [search]"]),
    "trials": ("trials = 40", "trials = 0", ["search.trials is 0"]),
    "seed": ("trials = 40", 'seed = "a"', ["search.seed is 'a'"]),
    "prune": ("prune_after = 2", "prune = 2", ["search.prune is 2", "True or False"]),
    "group": ("prune_after = 2", "prune_after = 0", ["search.prune_after is 0"]),
    "no pruning": ("trials =", "prune = false\ntrials =", ["prune_after requires prune"]),
    "held out": ("held_out = 12", "held_out = 1", ["search.held_out is 1", "or a list"]),
    "held out of the search": ("held_out = 12", "held_out = [9, 3]", ["has the seed 3 of the"]),
    "one held out": ("held_out = 12", "held_out = [9]", ["has a single seed"]),
    "range": ("from = 1, to = 200", "from = 9, to = 1", ["level goes from 9 to 1"]),
    "log": ("from = 10, to = 1000", "from = 0, to = 1000", ["half_life.from is 0.0", "above 0"]),
    "steps": ("to = 200", "to = 200, steps = 4", ["level.steps is 4", "grids"]),
    "type": ('"half", "strongest"', '"half", 3', ["view` is 3"]),
    "setting": ("vary.task.pheromone.view", "vary.task.pheromone.vue", ["vue", "not a setting"]),
    "default": (
        'evaporation = "exponential"',
        'evaporation = "linear"',
        ["half_life`", "leave it out unless"],
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_are_named(name):
    old, new, words = WRONG[name]
    assert old in TEXT
    with pytest.raises(AntsError) as error:
        read(TEXT.replace(old, new, 1))
    for word in words:
        assert word in str(error.value)


def test_a_search_is_a_table():
    with pytest.raises(AntsError, match=r"search is 3; it must be a table, \[search\]"):
        Search.of({"search": 3})


@pytest.mark.parametrize("missing", ["optuna", "tomli_w"])
def test_a_missing_extra_is_named_with_the_command(missing, monkeypatch):
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(AntsError, match=rf'{missing}.* pip install -e "\.\[search\]"'):
        read()
