"""The only place where Taichi is started.

Importing the package does not start Taichi; the first call that needs a kernel does.
"""

from __future__ import annotations

import contextlib
import io
import os
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from taichi_ants.environment import fallback_folder, is_writable_folder
from taichi_ants.errors import AntsError

ARCHITECTURES = ("cpu", "cuda")
MAX_THREADS = 1024


@dataclass(frozen=True)
class Runtime:
    """How Taichi runs: `arch` is "cpu" or "cuda", `threads` the number of CPU threads."""

    arch: str
    threads: int


_current: Runtime | None = None


def available_threads() -> int:
    """The number of CPU threads that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def start(threads: int | None = None, arch: str | None = None) -> Runtime:
    """Start Taichi, or restart it if other settings are asked for.

    Args:
        threads: CPU threads, 1 to 1024; None keeps what runs, or takes all that are available.
        arch: "cpu" or "cuda"; None keeps what runs, or takes the CPU.

    Returns:
        The settings in force.

    Raises:
        AntsError: A setting is not allowed, "cuda" finds no device, or Taichi was started by
            somebody else with fast_math on, which would change results in the last bit.
    """
    global _current
    wanted = Runtime(arch or _running_arch(), _checked_threads(threads))
    if wanted.arch not in ARCHITECTURES:
        raise AntsError(f"arch is {arch!r}; it must be one of {', '.join(ARCHITECTURES)}.")
    import taichi as ti

    if _program(ti) is None:
        _current = None
    elif _current is None:
        _current = _adopt_foreign(ti)
        wanted = _current if threads is None and arch is None else wanted
    if _current != wanted:
        _init(ti, wanted)
        _current = wanted
    return wanted


def _running_arch() -> str:
    return _current.arch if _current else "cpu"


def _checked_threads(threads: int | None) -> int:
    if threads is None:
        return _current.threads if _current else available_threads()
    if isinstance(threads, bool) or not hasattr(threads, "__index__"):
        raise AntsError(f"threads is {threads!r}; it must be a whole number.")
    if not 1 <= threads <= MAX_THREADS:
        raise AntsError(f"threads is {threads}; it must lie between 1 and {MAX_THREADS}.")
    return int(threads)


def _program(ti: ModuleType) -> object | None:
    return ti.lang.impl.get_runtime().prog


def _adopt_foreign(ti: ModuleType) -> Runtime:
    """Use a Taichi that the caller has started, so that the caller's fields stay alive."""
    config = ti.lang.impl.current_cfg()
    if config.fast_math:
        raise AntsError(
            "Taichi is running with fast_math=True, which changes results in the last bit; "
            "call ti.init(..., fast_math=False), or let taichi_ants start Taichi."
        )
    arch = "cuda" if config.arch == ti.cuda else "cpu"
    return Runtime(arch, int(config.cpu_max_num_threads))


def _init(ti: ModuleType, wanted: Runtime) -> None:
    settings = {
        "fast_math": False,  # no reordering of floats: the same bits everywhere
        "cpu_max_num_threads": wanted.threads,
        "make_cpu_multithreading_loop": False,  # hand out runs one by one, they are uneven
        "offline_cache": True,
        "offline_cache_file_path": str(_cache_folder()),
    }
    arch = ti.cuda if wanted.arch == "cuda" else ti.cpu
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(arch=arch, log_level=ti.ERROR, **settings)
    if wanted.arch == "cuda" and ti.lang.impl.current_cfg().arch != ti.cuda:
        ti.reset()
        raise AntsError("arch is 'cuda', but no CUDA device can be used here; choose 'cpu'.")


def _cache_folder() -> Path:
    """Where compiled kernels are kept between processes; a temporary folder if need be."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.environ["HOME"], ".cache")
    folder = Path(base) / "taichi_ants" / "kernels"
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    return folder if is_writable_folder(str(folder)) else Path(fallback_folder()) / "kernels"
