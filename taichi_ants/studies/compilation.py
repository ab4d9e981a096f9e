"""Kernels that one worker compiles for all workers of its machine."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants import __version__, files, runtime
from taichi_ants.settings import flat

if TYPE_CHECKING:
    from taichi_ants.studies.executors import Work

_LENGTHS = ("episodes", "max_steps", "ticks", "rollouts")
_seen: set[str] = set()  # kinds of kernels that this process can read


def compile_once(work: Work, *others: Any) -> bool:
    """Compile the kernels of some work, unless this or another process of the machine has.

    If another process compiles them now, this function waits for it. `others` determine the kernels
    too. Errors are ignored, because the work reports them.

    Returns:
        Whether this process has compiled them.
    """
    kind = _kind(work, others)
    if kind in _seen:
        return False
    _seen.add(kind)
    compiles, place = False, runtime.cache_folder().parent / "compiled"
    with suppress(OSError, ImportError), _alone(place, kind):
        compiles = not (place / kind).exists()
        if compiles:
            with suppress(Exception):
                _shortest(work).do()
        with _alone(place, "all"):  # Taichi saves nothing while another process saves
            runtime.refresh()
        (place / kind).touch()
    return compiles


def _kind(work: Work, others: Any) -> str:
    """Return a checksum of what determines the kernels of some work, mostly.

    Kernels differ by names, and by whether a number is zero. Work of one kind can still need
    different kernels; each worker then compiles the rest.
    """
    point = work.points[0]
    world = point.world[0] if isinstance(point.world, tuple) else point.world
    settings = flat({"task": point.task.as_dict(), "training": point.training.as_dict()})
    facts = {
        name: value if isinstance(value, (str, bool)) or value is None else bool(value)
        for name, value in settings.items()
    }
    more = [world.n_nests, len(world.food_kinds) > 0, point.episodes > 0, repr(others)]
    more += [getattr(point, name, None) for name in ("sharing", "measures")]
    parts = [__version__, type(point).__name__, dict(work.where), facts, more]
    return hashlib.sha256(files.to_json(parts).encode()).hexdigest()[:32]


def _shortest(work: Work) -> Work:
    """Return the work of one seed and of the least length, which uses nearly the same kernels."""
    point = copy.copy(work.points[0])
    few: dict[str, Any] = {n: min(1, getattr(point, n)) for n in _LENGTHS if hasattr(point, n)}
    if isinstance(point.world, tuple):
        few["world"] = point.world[:1]
    if hasattr(point, "protocol"):
        few["protocol"] = ()  # its events can be later than the end
    for name, value in few.items():  # without checks, because tables replace `after`
        object.__setattr__(point, name, value)
    learned = None if work.learned is None else work.learned[:1]
    return replace(work, points=(point,), seeds=work.seeds[:1], learned=learned)


@contextmanager
def _alone(folder: Path, name: str) -> Iterator[None]:
    """Return a context that one process of this machine at a time enters, by folder and name."""
    import fcntl  # which Windows lacks

    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / f"{name}.lock", "wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # released when the file is closed, also by a crash
        yield
