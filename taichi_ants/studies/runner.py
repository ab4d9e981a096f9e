"""Studies: points over seeds, computed in blocks that are saved as they finish.

A block is a group of similar points and seeds. Each finished block is a file, so a stopped study
can resume. The outcome of a run depends only on its point and seed, so the order of blocks does not
matter.
"""

from __future__ import annotations

import copy
import hashlib
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Generic, NamedTuple

import numpy as np

from taichi_ants import PHYSICS, arguments, files
from taichi_ants.errors import AntsError, checked_whole, count, shown
from taichi_ants.features import COLONY, LONE
from taichi_ants.studies.blocks import Blocks, Outcome
from taichi_ants.studies.executors import Executor, Plugin, Reduce, Work, completed
from taichi_ants.studies.interruption import stop_if_noted
from taichi_ants.studies.points import (
    ColonyPoint,
    PointKind,
    Progress,
    chain,
    facts_of,
    in_order,
    part_of,
    settings_of,
    world_facts,
)

_HOPELESS = 3  # blocks that fail, and none that succeeds: a study stops
_NAMED = 3  # failed blocks, at most, in a message
VALUE = "value_"  # begins the names of numbers of runs in outcomes, which functions `Reduce` make


@dataclass(frozen=True)
class Study(Generic[PointKind]):
    """Points that all run with the same seeds.

    Raises:
        AntsError: A world is too small for the ants, or worlds and seeds differ in number.
    """

    points: tuple[PointKind, ...]
    seeds: tuple[int, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "seeds", arguments.checked_seeds(self.seeds))
        if not self.points:
            raise AntsError("`points` is empty; give at least one point.")
        places: Any = dict.fromkeys((one.world, one.pool, one.ants) for one in self.points)
        for world, pool, ants in places:
            several = world if isinstance(world, tuple) else (world,)
            if len(several) not in (1, len(self.seeds)):
                raise AntsError(
                    f"there are {len(several)} worlds for {len(self.seeds)} seeds; give one world, "
                    "or one for each seed."
                )
            starts = [*zip(several, self.seeds, strict=False), *((one, 0) for one in pool or ())]
            for one, seed in starts:
                of_colony = isinstance(self.points[0], ColonyPoint)
                who = ("a colony", COLONY) if of_colony else ("a run of one ant", LONE)
                arguments.checked_world(one, True, *who).start(seed, ants)

    @cached_property
    def in_order(self) -> tuple[PointKind, ...]:
        """All points once; a point that is the `after` of another one comes first."""
        return in_order(self.points)

    def blocks(self, missing: np.ndarray | None = None) -> Iterator[Piece]:
        """Yield the blocks of the runs that are True in `missing`, bool (points, seeds), or of all.

        The points are those of `in_order`.
        """
        order = self.in_order
        runs = np.ones((len(order), len(self.seeds)), bool) if missing is None else missing
        places = np.flatnonzero(runs.any(axis=1)).tolist()
        for _, group in itertools.groupby(
            places, lambda place: (order[place].alike, runs[place].tobytes())
        ):
            some = list(group)
            at, size = np.flatnonzero(runs[some[0]]).tolist(), order[some[0]].runs_of_a_block
            step = max(1, size // len(at))
            for p, s in itertools.product(range(0, len(some), step), range(0, len(at), size)):
                yield Piece(tuple(some[p : p + step]), tuple(at[s : s + size]))

    def settings(self) -> dict[str, Any]:
        """Return everything that determines the results; equal settings give equal results."""
        return settings_of(self.points, self.seeds)

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """For each point of `in_order`, a checksum of all that determines its outcomes.

        If there is a world for each seed, the names of seeds contain its checksum instead.
        """
        known: dict[Any, Any] = {}  # by worlds and points

        def number_of(name: str, value: Any) -> Any:
            if value not in known:
                several = value if isinstance(value, tuple) else (value,)
                known[value] = [world_facts(one) for one in several]
            return None if name == "world" and isinstance(value, tuple) else known[value]

        for point in self.in_order:
            facts = {"physics": PHYSICS, **facts_of(point, number_of)}
            known[point] = hashlib.sha256(files.to_json(facts).encode()).hexdigest()[:32]
        return tuple(known[point] for point in self.in_order)

    @cached_property
    def names(self) -> tuple[tuple[str, ...], ...]:
        """For each point of `in_order`, the names of the seeds, with the worlds of each seed."""
        known: dict[Any, tuple[str, ...]] = {}
        for point in self.in_order:
            worlds = tuple(one.world for one in chain(point) if isinstance(one.world, tuple))
            if worlds not in known:
                sums = [[world_facts(one)["sha256"] for one in several] for several in worlds]
                parts = zip(map(str, self.seeds), *sums, strict=True)
                known[worlds] = tuple("@".join(one) for one in parts)
            known[point] = known[worlds]
        return tuple(known[point] for point in self.in_order)

    def runs(self, shard: tuple[int, int] = (1, 1)) -> dict[str, Any]:
        """Return what identifies the runs of a shard, for manifests.

        Returns:
            `points`: the `keys`. `seeds`: lists of names of seeds. `seeds_of`: for each point, the
            index of its list. `weights`: for each point, the work of a seed. `rows`: for each of
            `Study.points`, its index. `shard`: for each point, the range of its seeds.
        """
        place = {point: n for n, point in enumerate(self.in_order)}
        lists = {names: n for n, names in enumerate(dict.fromkeys(self.names))}
        share = [np.flatnonzero(row) for row in self.share(*shard)]
        return {
            "points": self.keys,
            "seeds": list(lists),
            "seeds_of": [lists[names] for names in self.names],
            "weights": self.weights[:, 0],
            "rows": [place[point] for point in self.points],
            "shard": [[int(at[0]), int(at[-1]) + 1] if len(at) else [0, 0] for at in share],
        }

    @cached_property
    def weights(self) -> np.ndarray:
        """The approximate work of each run, float64 (points of `in_order`, seeds)."""
        several = np.array([[float(one.weight)] for one in self.in_order])
        return np.broadcast_to(several, (len(several), len(self.seeds)))

    def share(self, number: int, shards: int) -> np.ndarray:
        """Return the runs of one of several shards with equal work, bool as `weights`.

        `number` is from 1 to `shards`. Points that start from the table of another one are in the
        same shard as that one.
        """
        if shards == 1:
            return np.ones(self.weights.shape, bool)
        roots = [chain(one)[0] for one in self.in_order]
        families = {root: n for n, root in enumerate(dict.fromkeys(roots))}
        of_point = np.array([families[root] for root in roots])
        weights = np.zeros((len(families), len(self.seeds)))
        np.add.at(weights, of_point, self.weights)
        middle = weights.cumsum().reshape(weights.shape) - weights / 2
        return (np.floor(middle / weights.sum() * shards) == number - 1)[of_point]

    def run(
        self, folder: Path, progress: Progress = lambda share: None, **how: Any
    ) -> dict[PointKind, Outcome]:
        """Return all outcomes, or none of a shard; arguments and errors as of `in_blocks`."""
        for _ in self.in_blocks(folder, progress, **how):
            pass
        order, is_whole = self.in_order, how.get("shard", (1, 1))[1] == 1
        places = range(len(order)) if is_whole else ()
        return {order[place]: outcome for place, outcome in self.read(folder, places)}

    def reduced(
        self,
        folder: Path,
        reduce: Reduce,
        progress: Progress = lambda share: None,
        each: Callable[[Block], None] = lambda block: None,
        **how: Any,
    ) -> dict[str, np.ndarray]:
        """Return the `VALUE` arrays of all runs (points, seeds), by their names without `VALUE`.

        `each` is called with each block; the other arguments and errors are those of `in_blocks`.
        """
        order = self.in_order
        found: dict[str, np.ndarray] = {}
        for block in self.in_blocks(folder, progress, reduce=reduce, **how):
            for name, array in values_in(block.outcome).items():
                shape = len(order), len(self.seeds)
                of_all = found.setdefault(name, np.empty(shape, array.dtype))
                of_all[np.ix_(block.points, block.seeds)] = array
            each(block)
        if order == self.points:
            return found
        place = {point: number for number, point in enumerate(order)}  # points may repeat
        return {name: array[[place[one] for one in self.points]] for name, array in found.items()}

    def in_blocks(
        self,
        folder: Path,
        progress: Progress = lambda share: None,
        shard: tuple[int, int] = (1, 1),
        **how: Any,
    ) -> Iterator[Block]:
        """Yield all blocks in any order; compute and save those that the folder lacks.

        Args:
            folder: The folder of finished blocks of this study.
            progress: A function that is called with the finished share of the work.
            shard: The arguments of `share`; only this part of the study is computed.
            how: See `_computed`, whose errors are raised.
        """
        saved, wanted = Blocks(folder), self.share(*shard)
        missing, total = wanted.copy(), self.weights[wanted].sum()
        progress(0.0)
        for block in self._saved(saved):
            at = np.ix_(block.points, block.seeds)
            if missing[at].any():
                missing[at] = False
                progress(1.0 - self.weights[missing].sum() / total)
                yield block
        yield from self._computed(saved, missing, total, progress, **how)

    def complete(
        self,
        folder: Path,
        runs: np.ndarray,
        array: str,
        progress: Progress = lambda share: None,
        shard: tuple[int, int] = (1, 1),
        **how: Any,
    ) -> None:
        """Compute and save the runs, bool as `weights`, for which the folder lacks an array.

        The other arguments are those of `in_blocks`.
        """
        saved = Blocks(folder)
        rows = zip(self.keys, self.names, strict=True)
        has = np.array([[saved.has(key, name, array) for name in names] for key, names in rows])
        missing = runs & self.share(*shard) & ~has
        total = max(self.weights[missing].sum(), 1.0)
        for _ in self._computed(saved, missing, total, progress, **how):
            pass

    def _computed(
        self,
        saved: Blocks,
        missing: np.ndarray,
        total: float,
        progress: Progress,
        *,
        reduce: Reduce | None = None,
        bytes_of_a_run: Callable[[Any], int] = lambda point: point.bytes_of_a_run,
        executor: Executor | None = None,
        in_flight: int | None = None,
        plugins: Sequence[Plugin] = (),
        **where: Any,
    ) -> Iterator[Block]:
        """Yield blocks of the missing runs, after they were computed and saved.

        Args:
            saved: The finished blocks.
            missing: The runs to compute, bool as `weights`.
            total: The work from which `progress` counts.
            progress: See `in_blocks`.
            reduce: What is saved of an outcome, see `Work`; None means all of it.
            bytes_of_a_run: The upper bound on the bytes of a run of a point on disk.
            executor: The executor that computes blocks, see `studies.executors`; None computes them
                in this process.
            in_flight: The number of blocks that the executor has at the same time; None means
                twice the number of its workers.
            plugins: The plugins that the workers of the executor need.
            where: The arguments `threads` and `arch` of `train`.

        Raises:
            AntsError: The disk is too small for all blocks, or an argument is not allowed.
            FailedBlocksError: Some blocks cannot be computed; the others are finished.
        """
        if in_flight is not None:
            checked_whole("in_flight", in_flight)
        order, weights = self.in_order, self.weights
        place_of: dict[Any, int] = {point: place for place, point in enumerate(order)}
        after = [place_of.get(point.after, -1) for point in order]
        for place in reversed(range(len(order))):  # those that need the tables of another point
            if (a := after[place]) >= 0 and missing[place].any():
                lacks = [not saved.has(self.keys[a], n, "q_values") for n in self.names[a]]
                missing[a] |= missing[place] & lacks
        needed = zip(map(bytes_of_a_run, order), missing.sum(axis=1).tolist(), strict=True)
        files.check_room(saved.folder, sum(size * runs for size, runs in needed))
        failed: dict[Piece, Exception] = {}
        succeeded = not missing.all()

        left = weights[missing].sum()

        def show(more: float = 0.0) -> None:
            progress(1.0 - (left - more) / total)

        def here(pieces: Iterable[Piece]) -> Iterator[tuple[Piece, Outcome | Exception]]:
            for piece in pieces:
                work = self._work(piece, saved, reduce, where)
                try:
                    yield piece, work.do(part_of(show, 0.0, weights[np.ix_(*piece)].sum()))
                except Exception as error:
                    stop_if_noted()
                    yield piece, error

        depths = np.array([[len(chain(one))] for one in order])
        for depth in range(1, depths.max() + 1):
            ready = missing & (depths == depth)
            for place, a in enumerate(after):
                ready[place] &= (a < 0) | ~missing[a]
            if executor is None:
                found = here(self.blocks(ready))
            else:
                work_of = partial(self._work, saved=saved, reduce=reduce, where=where)
                found = completed(self.blocks(ready), work_of, executor, in_flight, plugins)
            for piece, outcome in found:
                if isinstance(outcome, Exception):
                    failed[piece] = outcome
                    if not succeeded and len(failed) == _HOPELESS:
                        break
                    continue
                keys = [self.keys[place] for place in piece.points]
                names = self.names[piece.points[0]]
                saved.add(keys, [names[s] for s in piece.seeds], outcome)
                missing[np.ix_(*piece)], succeeded = False, True
                left -= weights[np.ix_(*piece)].sum()
                show()
                yield Block(*piece, outcome)
            if failed and not succeeded:
                raise next(iter(failed.values()))
        if failed:
            said = [f"{self.named(piece)} ({_said(error)})" for piece, error in failed.items()]
            raise FailedBlocksError(said)

    def _saved(self, saved: Blocks) -> Iterator[Block]:
        """Yield the finished blocks of this study."""
        place_of = {key: place for place, key in enumerate(self.keys)}
        for keys, names, outcome in saved:
            rows = [row for row, key in enumerate(keys) if key in place_of]
            if not rows:
                continue
            places = tuple(place_of[keys[row]] for row in rows)
            own = {name: s for s, name in enumerate(self.names[places[0]])}
            columns = [column for column, name in enumerate(names) if name in own]
            at = tuple(own[names[column]] for column in columns)
            if len(rows) < len(keys) or len(columns) < len(names):
                outcome = {n: array[np.ix_(rows, columns)] for n, array in outcome.items()}
            if at:
                yield Block(places, at, outcome)

    def _work(
        self, piece: Piece, saved: Blocks, reduce: Reduce | None, where: Mapping[str, Any]
    ) -> Work:
        """Return the work of a block; AntsError if the tables of `after` cannot be read."""
        points: list[Any] = [self.in_order[place] for place in piece.points]
        seeds, learned = tuple(self.seeds[s] for s in piece.seeds), None
        if isinstance(points[0].world, tuple):  # a block of one point, with a world for each seed
            own = points[0].world
            points = [replace(points[0], world=tuple(own[s] for s in piece.seeds))]
        if points[0].after is not None:
            place = self.in_order.index(points[0].after)
            names = [self.names[place][s] for s in piece.seeds]
            learned = saved.read(self.keys[place], names, "q_values")["q_values"]
            points = [copy.copy(points[0])]
            object.__setattr__(points[0], "after", None)  # workers get its tables instead
        return Work(tuple(points), seeds, learned, reduce, where)

    def read(
        self, folder: Path, points: Iterable[int], array: str | None = None
    ) -> Iterator[tuple[int, Outcome]]:
        """Yield outcomes of points from finished blocks, by indices into `in_order`.

        With `array`, the blocks are those that have this array.

        Raises:
            AntsError: A block cannot be read.
        """
        saved = Blocks(folder)
        for place in sorted(set(points)):
            yield place, saved.read(self.keys[place], self.names[place], array)

    def named(self, piece: Piece) -> str:
        """Return the settings of a block that are not those of all points, and its seeds."""
        worlds: dict[Any, int] = {}
        rows = [
            facts_of(point, lambda name, value: worlds.setdefault(value, len(worlds)))
            for point in self.in_order
        ]
        own = [rows[place] for place in piece.points]
        parts = []
        for name in dict.fromkeys(name for row in rows for name in row):
            if any(row.get(name) != rows[0].get(name) for row in rows):
                values = dict.fromkeys(shown(row.get(name)) for row in own)
                parts.append(f"{name} {' or '.join(values)}")
        seeds = [self.seeds[s] for s in piece.seeds]
        of_seeds = f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
        return ", ".join([*parts, of_seeds])


def values_in(outcome: Outcome) -> Outcome:
    """Return the `VALUE` arrays of an outcome by their names without `VALUE`."""
    return {n.removeprefix(VALUE): array for n, array in outcome.items() if n.startswith(VALUE)}


class FailedBlocksError(AntsError):
    """Blocks that cannot be computed, while others are finished; `several` names them all."""

    exit_status = 1

    def __init__(self, several: Sequence[str]) -> None:
        more = f" and {len(several) - _NAMED} more" if len(several) > _NAMED else ""
        super().__init__(
            f"{count(len(several), 'block')} failed: {'; '.join(several[:_NAMED])}{more}; all "
            "others are saved, so correct the cause and run the same command again, or with "
            "another --out if you change a plugin."
        )
        self.several = list(several)


class Piece(NamedTuple):
    """A block that is not computed yet: indices into `in_order` and into the seeds."""

    points: tuple[int, ...]
    seeds: tuple[int, ...]


class Block(NamedTuple):
    """Indices into `in_order` and into the seeds, with their outcome (points, seeds, ...)."""

    points: tuple[int, ...]
    seeds: tuple[int, ...]
    outcome: Outcome


def _said(error: Exception) -> str:
    """Return an error as messages show it."""
    text = " ".join(str(error).split()).rstrip(".")
    return text if isinstance(error, AntsError) else f"{type(error).__name__}: {text}"
