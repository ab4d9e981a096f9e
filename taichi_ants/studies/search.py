"""Searches: Optuna looks for the settings with the best measure, over seeds as repeated trials.

A search is a sequence of trials. Each trial runs a point with the seeds in small groups, and stops
after a group whose mean so far is worse than the median of earlier trials. A trial depends only on
the seed of the search and on the results of earlier trials. So a search that was stopped resumes by
suggesting the same settings again, and reads their results from finished blocks.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from taichi_ants import checks, files
from taichi_ants.analysis import searches, style, sweeps
from taichi_ants.analysis.findings import Contrast, above, judge
from taichi_ants.errors import AntsError, checked_flag, checked_whole, imported, shown
from taichi_ants.files.results import REPORT, ROWS
from taichi_ants.measures import finished
from taichi_ants.settings import flat, nested, not_a_setting
from taichi_ants.studies import design, sweep
from taichi_ants.studies.blocks import Blocks
from taichi_ants.studies.design import Axis, Range
from taichi_ants.studies.points import ColonyPoint, Progress
from taichi_ants.studies.runner import VALUE, Study
from taichi_ants.studies.sweep import Sweep
from taichi_ants.studies.sweep_file import (
    Base,
    Settings,
    axes_of,
    check_training,
    contents,
)

if TYPE_CHECKING:
    import optuna

TRIALS, HELD_OUT, BEST, STORAGE = "trials.csv", "held_out.csv", "best.toml", "optuna.journal"
# Folders of blocks: of each trial, whose number follows, and of the held-out seeds.
TRIAL_BLOCKS, HELD_OUT_BLOCKS = "trial-", "held-out"
COMPLETE, PRUNED, FAILED = "complete", "pruned", "failed"
_WRITE_EVERY = 5.0  # seconds, at least, between two tables of the trials so far
_TRIED = 20  # trials, at most, of which one must be allowed before the search begins
_KEYS = ("maximise", "minimise", "trials", "seed", "prune", "prune_after", "held_out", "vary")
_OF_SWEEPS = ("vary", "against", "margin", "measure_every", *design.KEYS)
_VERDICTS = {"supported": "better", "contradicted": "worse", "equivalent": "equal"}


class Trial(NamedTuple):
    """A finished trial: its settings, state, and each measure, float64 (seeds that have run,)."""

    settings: Settings
    state: str
    values: dict[str, np.ndarray]


class Found(NamedTuple):
    """The results of a search; `held_out` has each measure of the default and the best settings.

    Its arrays are float64 (2, held-out seeds).
    """

    trials: list[Trial]
    best: int
    held_out: dict[str, np.ndarray]
    study: optuna.Study


@dataclass(frozen=True)
class Search:
    """A search, read from a file.

    Attributes:
        base: The fixed settings, which are also the default to compare with.
        axes: The values or ranges of the settings that the search chooses.
        measure: The measure that decides.
        maximises: Whether large values of it are good.
        prune_after: The number of seeds in a group; None for trials that are never pruned.
        held_out: Seeds that only compare the best settings with the default.
        file: The contents of the file.
    """

    base: Base
    axes: dict[str, Axis]
    measure: str
    maximises: bool
    trials: int
    seed: int
    prune_after: int | None
    held_out: tuple[int, ...]
    file: Settings

    @classmethod
    def of(cls, file: Settings) -> Search:
        """Return the search of the contents of a file; AntsError if a setting is not allowed."""
        own = _table(file)
        (way,) = {*_KEYS[:2]} & own.keys()
        measure = own[way]
        base = Base.of({"measures": [measure], **file})
        if measure not in base.measures:
            raise AntsError(
                f"{way} is {shown(measure)}, but measures are {', '.join(base.measures)}; add it "
                "to measures."
            )
        asked = cls(
            base,
            _axes(own, base),
            measure,
            way == "maximise",
            checked_whole("search.trials", own.get("trials", 50), 1, 100_000),
            checked_whole("search.seed", own.get("seed", 0), 0, 2**63 - 1),
            _group(own),
            _held_out(own.get("held_out", 20), base.seeds),
            file,
        )
        for module in ("optuna", "tomli_w"):
            imported("[search]", module, "search")
        asked._check_trials()
        return asked

    def _check_trials(self) -> None:
        """Raise AntsError if the default is not allowed, or none of the first trials."""
        self._studies({})
        if "episodes" not in self.axes:
            check_training([*self.base.fixed, *self.axes], [self.base.point({}, {})])
        study, errors = self._study(), list[AntsError]()
        for number in range(min(self.trials, _TRIED)):
            trial, row = self._asked(study, number)
            try:
                self._studies(row)
                return
            except AntsError as error:
                errors.append(error)
                self._tell(study, trial, Trial(row, FAILED, {}))
        raise errors[0]

    def _studies(self, row: Settings) -> list[tuple[slice, Study[Any]]]:
        """Return the groups of seeds with their studies; AntsError if they are not allowed."""
        point = self.base.point(row, {})
        return [(at, self._part(point, at)) for at in self._groups()]

    def facts(self) -> dict[str, Any]:
        """Return everything that determines the results."""
        import optuna

        default: Any = self.base.point({}, {})
        own = {
            **{"maximise" if self.maximises else "minimise": self.measure, "trials": self.trials},
            **{"seed": self.seed, "prune_after": self.prune_after, "held_out": self.held_out},
            "optuna": optuna.__version__,
            "vary": {name: vars(axis) for name, axis in self.axes.items()},
        }
        study: Study[Any] = Study((default,), self.base.seeds)
        return {
            **study.settings(),
            "measures": self.base.measures,
            **flat({"search": own}),
        }

    def measured(self, blocks: Path, progress: Progress, **where: Any) -> Found:
        """Return the results; compute what the folder of blocks lacks.

        Arguments are those of `Study.in_blocks`. The trials so far are written beside the blocks,
        every few seconds. Raises AntsError if no trial has a value.
        """
        study, tried, written = self._study(), list[Trial](), -_WRITE_EVERY
        total = self.trials * len(self.base.seeds) + 2 * len(self.held_out)

        def part(done: float, share: float) -> Progress:
            return lambda now: progress((done + share * now) / total)

        for number in range(self.trials):
            trial, row = self._asked(study, number)
            tried.append(self._tried(trial, row, blocks, part, where))
            self._tell(study, trial, tried[-1])
            if time.monotonic() - written >= _WRITE_EVERY or number == self.trials - 1:
                self._write_trials(tried, study, blocks.parent / ROWS)
                written = time.monotonic()
        done = [n for n, one in enumerate(tried) if one.state == COMPLETE]
        if not done:
            raise AntsError(
                f"no trial of {self.trials} has a value of {self.measure}; widen [search.vary], or "
                "choose another measure."
            )
        best = study.best_trial.number
        own = self.base._replace(seeds=self.held_out)
        built: dict[str, Any] = {}
        points = own.point({}, built), own.point(tried[best].settings, built)
        last = part(total - 2 * len(self.held_out), 2 * len(self.held_out))
        values = self._measures(Study(points, self.held_out), blocks / HELD_OUT_BLOCKS, last, where)
        return Found(tried, best, values, study)

    def take(self, folder: Path, runs: Mapping[str, Any], blocks: Blocks) -> None:
        """Add the trials of finished results to the blocks; `runs` has no effect."""
        import optuna

        study = self._study()
        journal = optuna.storages.journal.JournalFileBackend(str(folder / STORAGE))
        stored = optuna.storages.JournalStorage(journal)
        for number, one in enumerate(optuna.load_study(study_name=None, storage=stored).trials):
            trial, row = self._asked(study, number)
            values = {n: np.array(v, float) for n, v in one.user_attrs["values"].items()}
            has_run = len(next(iter(values.values()), ()))
            for at in self._groups() if has_run else ():
                if at.stop <= has_run:
                    place = self._place(blocks.folder, number, at)
                    part = self._part(self.base.point(row, {}), at)
                    outcome = {f"{VALUE}{n}": array[None, at] for n, array in values.items()}
                    Blocks(place).add(part.keys, part.names[0], outcome)
            state = FAILED if one.state.name == "FAIL" else one.state.name.lower()
            self._tell(study, trial, Trial(row, state, values))

    @staticmethod
    def _place(blocks: Path, number: int, at: slice) -> Path:
        """Return the folder of the blocks of a group of seeds of a trial."""
        return files.check_writable_folder(
            blocks / f"{TRIAL_BLOCKS}{number:05d}" / f"{at.start:05d}"
        )

    def _part(self, point: Any, at: slice) -> Study[Any]:
        """Return the study of a point and a group of seeds."""
        return Study((_with_worlds(point, at),), self.base.seeds[at])

    def _study(self) -> optuna.Study:
        import optuna

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        return optuna.create_study(
            storage=optuna.storages.InMemoryStorage(),
            study_name="search",
            direction="maximize" if self.maximises else "minimize",
            pruner=optuna.pruners.MedianPruner(),
        )

    def _asked(self, study: optuna.Study, number: int) -> tuple[optuna.Trial, Settings]:
        """Return the next trial, and its settings.

        Each trial has a new sampler with another seed, so that it does not depend on random numbers
        that an earlier process has drawn.
        """
        import optuna

        seed = int(np.random.SeedSequence((self.seed, number)).generate_state(1)[0])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            study.sampler = optuna.samplers.TPESampler(seed=seed, multivariate=True)
        trial = study.ask({name: _distribution(axis) for name, axis in self.axes.items()})
        row = dict(trial.params)
        for name, axis in self.axes.items():
            if not isinstance(axis, Range):
                row[name] = _labels(axis)[row[name]]
        return trial, {name: row[name] for name in self.axes}

    def _tried(
        self, trial: optuna.Trial, row: Settings, blocks: Path, part: Any, where: dict[str, Any]
    ) -> Trial:
        """Return a trial that has run, until it was pruned."""
        try:
            studies = self._studies(row)
        except AntsError:  # the rules or the world do not allow these settings together
            return Trial(row, FAILED, {})
        seeds = self.base.seeds
        found: dict[str, list[np.ndarray]] = {name: [] for name in self.base.measures}
        state = COMPLETE
        for at, study in studies:
            place = self._place(blocks, trial.number, at)
            progress = part(trial.number * len(seeds) + at.start, at.stop - at.start)
            for name, array in self._measures(study, place, progress, where).items():
                found.setdefault(name, []).append(array[0])
            if not found[self.measure]:
                parts = ", ".join(name for name, several in found.items() if several)
                raise AntsError(f"{self.measure} has several parts; choose one of {parts}.")
            mean = np.concatenate(found[self.measure]).mean()
            if at.stop < len(seeds) and not math.isnan(mean):
                trial.report(mean, at.stop)
                if trial.should_prune():
                    state = PRUNED
                    break
        values = {name: np.concatenate(several) for name, several in found.items() if several}
        if state == COMPLETE and not np.isfinite(values[self.measure]).all():
            state = FAILED
        return Trial(row, state, values)

    def _tell(self, study: optuna.Study, trial: optuna.Trial, done: Trial) -> None:
        from optuna.trial import TrialState

        trial.set_user_attr("values", {n: array.tolist() for n, array in done.values.items()})
        if done.state == COMPLETE:
            study.tell(trial, done.values[self.measure].mean())
        else:
            study.tell(trial, state=TrialState.PRUNED if done.state == PRUNED else TrialState.FAIL)

    def _groups(self) -> Iterator[slice]:
        seeds = len(self.base.seeds)
        step = self.prune_after or seeds
        yield from (slice(start, min(start + step, seeds)) for start in range(0, seeds, step))

    def _measures(
        self, study: Study[Any], folder: Path, progress: Progress, where: dict[str, Any]
    ) -> dict[str, np.ndarray]:
        """Return each measure, float64 (points, seeds)."""
        files.check_writable_folder(folder)
        rows: tuple[Settings, ...] = tuple({} for _ in study.points)
        own = (self.base.measures, None, None, 0.0)
        return Sweep(self.base.kind, study, rows, (), *own).measured(folder, progress, **where)

    def _write_trials(
        self, trials: Sequence[Trial], study: optuna.Study, folder: Path
    ) -> list[Settings]:
        """Write the trials as a table and in Optuna's format; return the rows of the table."""
        rows = [
            {
                **{"trial": number, "state": one.state},
                "seeds": len(one.values.get(self.measure, ())),
                **one.settings,
                **{name: array.mean() for name, array in one.values.items()},
            }
            for number, one in enumerate(trials)
        ]
        files.check_writable_folder(folder)
        files.write_csv(folder / TRIALS, rows, sweeps.columns_of(rows))
        with files.writing(folder), files.unfinished(folder / STORAGE) as place:
            self._store(study, place)
            place.replace(folder / STORAGE)
        return rows

    def write(self, found: Found, folder: Path, draws: bool) -> None:
        """Write all results; `found` is what `measured` returned."""
        rows = self._write_trials(found.trials, found.study, folder)
        default, best = found.held_out[self.measure]
        pairs = zip(self.held_out, default, best, best - default, strict=True)
        columns = "seed", "default", "best", "difference"
        several = [dict(zip(columns, pair, strict=True)) for pair in pairs]
        files.write_csv(folder / HELD_OUT, several, columns)
        files.write_text(folder / BEST, self.best_file(found))
        files.write_text(folder / REPORT, self._report(found, rows))
        if draws:
            words = finished.of_runs(self.base.kind, self.measure).label
            names, logs = list(design.varying(self.axes)), design.logarithmic(self.axes)
            path = folder / sweep.FIGURES / "search.png"
            files.check_writable_folder(path.parent)
            with style.all_or_none(path.parent):
                searches.draw(path, rows, names, logs, (self.measure, words), self.maximises)

    def best_file(self, found: Found) -> str:
        """Return a sweep file (TOML) that runs the best settings with the held-out seeds."""
        import tomli_w

        fixed = {name: value for name, value in self.file.items() if name != "search"}
        rest = {name: one for name, one in flat(fixed).items() if name not in self.axes}
        vary = {name: [value] for name, value in found.trials[found.best].settings.items()}
        own = {"measures": list(self.base.measures), "seeds": list(self.held_out)}
        text = tomli_w.dumps({**nested(rest), **own, "vary": nested(vary)})
        return f"# The best settings of a search (trial {found.best}) with held-out seeds.\n{text}"

    def _store(self, study: optuna.Study, path: Path) -> None:
        """Write the trials in a file that Optuna and its dashboard read."""
        import optuna
        from optuna.storages.journal import JournalFileBackend

        to = optuna.storages.JournalStorage(JournalFileBackend(str(path)))
        source: Any = study._storage
        optuna.copy_study(from_study_name=study.study_name, from_storage=source, to_storage=to)

    def _report(self, found: Found, rows: list[Settings]) -> str:
        default, best = found.held_out[self.measure]
        sign = 1 if self.maximises else -1
        (finding,) = judge([Contrast("", sign * (best - default), above())])
        low, high = sorted((sign * finding.low, sign * finding.high))
        words = _VERDICTS.get(finding.verdict.value, "undecided")
        usual = flat(_settings_of(self.base.point({}, {})))
        chosen = found.trials[found.best].settings
        choices = [(name, usual.get(name), value) for name, value in chosen.items()]
        wanted = f"{'highest' if self.maximises else 'lowest'} {self.measure}"
        head = searches.summary(rows, len(self.base.seeds), wanted, found.best)
        numbers = sign * finding.effect, low, high
        return searches.report(head, choices, found.held_out, self.measure, numbers, words)


def read(
    path: Path, text: str | None = None, progress: Progress = lambda share: None
) -> Sweep | Search:
    """Return the sweep or the search of a file, or of its text; see `sweep_of` for `progress`.

    Raises:
        AntsError: The file cannot be read, or a setting is not allowed.
    """
    with contents(path, text) as file:
        return Search.of(file) if "search" in file else sweep.sweep_of(file, progress)


def _table(file: Settings) -> Settings:
    """Return the table [search] of a file, which has one aim."""
    own = file["search"]
    if not isinstance(own, dict):
        raise AntsError(f"search is {shown(own)}; it must be a table, [search].")
    for key in own:
        if key not in _KEYS:
            raise AntsError(f"`search.{key}` {not_a_setting(key, _KEYS)}")
    for key in _OF_SWEEPS:
        if key in file:
            more = "; move its settings to [search.vary]" if key == "vary" else ""
            raise AntsError(f"{key} and [search] are in the same file; remove one{more}.")
    ways = [one for one in _KEYS[:2] if one in own]
    if len(ways) != 1:
        raise AntsError(
            f"[search] has {' and '.join(ways) or 'no aim'}; write maximise or minimise with the "
            "name of a measure."
        )
    return own


def _axes(own: Settings, base: Base) -> dict[str, Axis]:
    """Return the ranges and choices of a table [search]; fixed values of these are the default."""
    table = own.get("vary", {})
    names = {name for name, _ in design.axes_of(table)} if isinstance(table, dict) else set()
    fixed = {name: value for name, value in base.fixed.items() if name not in names}
    axes = axes_of(base.kind, table, fixed)
    for name, axis in axes.items():
        if isinstance(axis, Range) and axis.steps:
            raise AntsError(f"{name}.steps is {axis.steps}, but is for grids; leave it out.")
    if not design.varying(axes):
        raise AntsError("no setting in [search.vary] varies; give it a range.")
    return axes


def _group(own: Settings) -> int | None:
    if not checked_flag("search.prune", own.get("prune", True)):
        if "prune_after" in own:
            raise AntsError("search.prune_after requires prune = true; leave it out.")
        return None
    return checked_whole("search.prune_after", own.get("prune_after", 4))


def _held_out(given: Any, seeds: tuple[int, ...]) -> tuple[int, ...]:
    """Return the held-out seeds of their number or a list."""
    if not isinstance(given, list):
        n = checked_whole("search.held_out", given, 2, 100_000, ", or a list of seeds")
        return tuple(range(max(seeds) + 1, max(seeds) + 1 + n))
    found = checks.checked_seeds(given)
    both = sorted(set(found) & set(seeds))
    if both or len(found) < 2:
        wrong = f"the seed {both[0]} of the search" if both else "a single seed"
        raise AntsError(f"search.held_out has {wrong}; give at least two other seeds.")
    return found


def _distribution(axis: Axis) -> Any:
    from optuna import distributions

    if not isinstance(axis, Range):
        return distributions.CategoricalDistribution(tuple(_labels(axis)))
    kind = distributions.IntDistribution if axis.whole else distributions.FloatDistribution
    return kind(axis.low, axis.high, log=axis.log)


def _labels(axis: Any) -> dict[Any, Any]:
    """Return the choices by the values that Optuna can store, which are not lists."""
    plain = str, int, float, bool
    return {v if isinstance(v, plain) else files.to_json(v): v for v in axis.several}


def _with_worlds(point: Any, at: slice) -> Any:
    several = isinstance(point, ColonyPoint) and isinstance(point.world, tuple)
    return replace(point, world=point.world[at]) if several else point


def _settings_of(point: Any) -> dict[str, Any]:
    own = {n: value for n, value in vars(point).items() if isinstance(value, (int, float, str))}
    return {**own, "task": point.task.as_dict(), "training": point.training.as_dict()}
