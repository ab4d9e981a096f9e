"""Studies: points over seeds. What a store lacks of them is cut into blocks, computed, and added.

The arrays of a run depend only on its point and seed, so neither the order nor the size of blocks
matters, nor who computes them.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import arguments
from taichi_ants.errors import AntsError, count, shown
from taichi_ants.features.support import COLONY
from taichi_ants.studies.executors import completed
from taichi_ants.studies.plugins import Code
from taichi_ants.studies.points import Drawn, Point, Progress, chain, columns_of, key_of
from taichi_ants.studies.store import Arrays, Store, parts_of

Q_VALUES = "q_values"
_HOPELESS = 3  # blocks that fail, and none that succeeds: a study stops
_NAMED = 3  # failed blocks, and values of a setting, at most, in a message

# (points, seeds, arrays of their outcome) -> more arrays (points, seeds, ...)
Measure = Callable[[Sequence[Any], Sequence[int], Arrays], Mapping[str, np.ndarray]]


class Block(NamedTuple):
    """Runs that are computed together, as indices of points and seeds."""

    points: tuple[int, ...]
    seeds: tuple[int, ...]


@dataclass(frozen=True)
class Study:
    """Points that all run with the same seeds.

    Attributes:
        arrays: The names of the arrays that are kept of each run: those of the outcome of its
            point, and those that `measure` adds.
        measure: A function at the top level of a module, or a `partial` of one.
        salt: Facts besides the settings that determine outcomes, such as the checksum of a plugin.

    Raises:
        AntsError: A world is too small for the ants, or seeds are not allowed.
    """

    points: tuple[Point, ...]
    seeds: tuple[int, ...]
    arrays: tuple[str, ...]
    measure: Measure | None = None
    salt: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", tuple(dict.fromkeys(self.points)))
        object.__setattr__(self, "seeds", arguments.checked_seeds(self.seeds))
        object.__setattr__(self, "arrays", tuple(self.arrays))
        if not self.points:
            raise AntsError("`points` is empty; give at least one point.")
        who = {"colony": ("a colony", COLONY), "runs": arguments.ALONE[:2]}[self.points[0].kind]
        for world, pool, ants in dict.fromkeys((p.world, p.pool, p.ants) for p in self.points):
            worlds: Any = map(world.of, self.seeds) if isinstance(world, Drawn) else [world]
            starts = [*zip(worlds, self.seeds, strict=False), *((drawn, 0) for drawn in pool or ())]
            for drawn, seed in starts:
                arguments.checked_world(drawn, True, *who).start(seed, ants)

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """The keys of the points; equal keys and seeds mean equal outcomes."""
        return tuple(key_of(point, *self.salt) for point in self.points)

    @cached_property
    def seconds(self) -> np.ndarray:
        """The approximate time of each run on one processor, float64 (points, seeds)."""
        of_points = np.array([[point.seconds] for point in self.points])
        return np.broadcast_to(of_points, (len(self.points), len(self.seeds)))

    @cached_property
    def families(self) -> tuple[int, ...]:
        """A number for each point, equal for points that learn from the same first point."""
        roots = [chain(point)[0] for point in self.points]
        return tuple(map(list(dict.fromkeys(roots)).index, roots))

    @cached_property
    def first(self) -> Study | None:
        """The study of the points `after` which others learn, if there are any."""
        points = dict.fromkeys(p.after for p in self.points if p.after is not None)
        arrays = tuple(dict.fromkeys((*self.arrays, Q_VALUES)))
        return replace(self, points=tuple(points), arrays=arrays) if points else None

    def missing(self, store: Store) -> np.ndarray:
        """Return the runs that a store lacks, bool (points, seeds)."""
        return store.where(self.keys, self.seeds, self.arrays)[0] < 0

    def blocks(self, runs: np.ndarray) -> Iterator[Block]:
        """Yield runs, bool (points, seeds), in blocks of points that run in one launch."""
        wanted = np.flatnonzero(runs.any(axis=1)).tolist()
        for _, group in itertools.groupby(
            wanted, lambda p: (self.points[p].alike, runs[p].tobytes())
        ):
            alike = list(group)
            seeds = np.flatnonzero(runs[alike[0]]).tolist()
            size = self.points[alike[0]].runs_of_a_block
            for points in _even(alike, max(1, size // len(seeds))):
                yield from (Block(points, part) for part in _even(seeds, size))

    def named(self, block: Block) -> str:
        """Return the settings of a block that are not those of all points, and its seeds."""
        parts = []
        for name, values in columns_of(self.points).items():
            if any(value != values[0] for value in values):
                texts = [*dict.fromkeys(shown(values[p]) for p in block.points)]
                more = " or others" if len(texts) > _NAMED else ""
                parts.append(f"{name} {' or '.join(texts[:_NAMED])}{more}")
        seeds = [self.seeds[s] for s in block.seeds]
        of_seeds = f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
        return ", ".join([*parts, of_seeds])


def _even(indices: list[int], most: int) -> Iterator[tuple[int, ...]]:
    """Yield parts of nearly equal length, each of at most `most`."""
    parts = np.array_split(indices, -(-len(indices) // most))
    return (tuple(part.tolist()) for part in parts)


def share_of(seconds: np.ndarray, families: Sequence[int], number: int, shards: int) -> np.ndarray:
    """Return the runs of one of several shards, bool (points, seeds); `number` is from 1.

    Shards have consecutive runs of equal work. All points of a family are in the same shard. A
    shard is a share of all wanted runs, not of the missing ones, so that shards never overlap.
    """
    of_point = np.array(families)
    work = np.zeros((of_point.max() + 1, seconds.shape[1]))
    np.add.at(work, of_point, seconds)
    middle = work.cumsum().reshape(work.shape) - work / 2
    return (np.floor(middle / work.sum() * shards) == number - 1)[of_point]


class FailedBlocksError(AntsError):
    """Blocks that cannot be computed, while others are finished; `blocks` names them all."""

    exit_status = 1

    def __init__(self, blocks: Sequence[str]) -> None:
        more = f" and {len(blocks) - _NAMED} more" if len(blocks) > _NAMED else ""
        super().__init__(
            f"{count(len(blocks), 'block')} failed: {'; '.join(blocks[:_NAMED])}{more}; all others "
            "are saved, so correct the cause and run the same command again, or with another --out "
            "if you change a plugin."
        )
        self.blocks = list(blocks)


def run(
    study: Study,
    store: Store,
    executor: Any = None,
    shard: tuple[int, int] = (1, 1),
    progress: Progress = lambda share: None,
    code: Sequence[Code] = (),
    **where: Any,
) -> None:
    """Compute and save the runs of a study that a store lacks, a file for each block.

    Args:
        executor, code: See `executors.completed`.
        shard: The number of a shard, from 1, and the number of shards, to compute only its runs.
        progress: A function that is called with the finished share of the work.
        where: The arguments `threads` and `arch` of `train`.

    Raises:
        FailedBlocksError: Blocks have failed; all others are saved.
        LostWorkersError: There are no more workers.
    """
    mine = share_of(study.seconds, study.families, *shard)
    stages = list(_stages(study, store, mine & study.missing(store)))
    left = sum(stage.seconds[runs].sum() for stage, runs in stages)
    total = left + study.seconds[mine & ~study.missing(store)].sum()
    failed: list[str] = []

    def show(more: float = 0.0) -> None:
        progress(1.0 - max(0.0, left - more) / max(total, 1e-9))

    show()
    for stage, runs in stages:
        work = partial(_work, stage, store, where, None if executor else show)
        wanted = runs & stage.missing(store)  # the stage before has computed some of them
        left -= stage.seconds[runs & ~wanted].sum()
        for block, outcome in completed(list(stage.blocks(wanted)), work, executor, code):
            if not isinstance(outcome, BaseException):
                keys = [stage.keys[p] for p in block.points]
                store.add(keys, [stage.seeds[s] for s in block.seeds], outcome)
                left -= stage.seconds[np.ix_(*block)].sum()
                show()
                continue
            text = " ".join(str(outcome).split()).rstrip(".")
            kind = "" if isinstance(outcome, AntsError) else f"{type(outcome).__name__}: "
            why = f"({kind}{text})"
            same = bool(failed) and failed[0].endswith(why)
            failed.append(f"{stage.named(block)} {'(for the same reason)' if same else why}")
            if len(failed) == _HOPELESS and not (mine & ~study.missing(store)).any():
                break
        if failed:
            raise FailedBlocksError(failed)


def _stages(study: Study, store: Store, runs: np.ndarray) -> Iterator[tuple[Study, np.ndarray]]:
    """Yield studies with their missing runs, so that each finds the tables that it starts from."""
    if (first := study.first) is not None:
        needed = np.zeros((len(first.points), len(study.seeds)), bool)
        for point, wanted in zip(study.points, runs, strict=True):
            if point.after is not None:
                needed[first.points.index(point.after)] |= wanted
        yield from _stages(first, store, needed & first.missing(store))
    yield study, runs


def _work(
    study: Study, store: Store, where: Mapping[str, Any], show: Progress | None, block: Block
) -> Callable[[], Arrays]:
    """Return the computation of a block as a call that can be pickled."""
    points: list[Any] = [study.points[p] for p in block.points]
    seeds, learned = tuple(study.seeds[s] for s in block.seeds), None
    if points[0].after is not None:  # a block of one point
        after, points = points[0].after, [copy.copy(points[0])]
        learned = store.read([key_of(after, *study.salt)], seeds, (Q_VALUES,))[Q_VALUES][0]
        object.__setattr__(points[0], "after", None)  # workers get its tables instead
    seconds = study.seconds[np.ix_(*block)].sum()
    progress = None if show is None else lambda share: show(share * seconds)
    return partial(outcome_of, points, seeds, learned, study.measure, study.arrays, where, progress)


def outcome_of(
    points: Sequence[Any],
    seeds: Sequence[int],
    learned: np.ndarray | None,
    measure: Measure | None,
    arrays: Sequence[str],
    where: Mapping[str, Any],
    progress: Progress | None,
) -> Arrays:
    """Return what is kept of a block, arrays (points, seeds, ...); this is what workers run.

    `learned` are the tables of the point `after`, float32 (seeds, n_states, 5), or None.
    """
    outcome = points[0].compute(points, seeds, learned, progress or (lambda share: None), where)
    outcome = {**outcome, **(measure(points, seeds, outcome) if measure else {})}
    for name in arrays:
        if not parts_of(name, outcome):
            raise AntsError(f"runs have no {name!r}; choose others of {', '.join(outcome)}")
    return {part: outcome[part] for name in arrays for part in parts_of(name, outcome)}
