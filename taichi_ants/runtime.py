"""The start of Taichi, which no other module starts.

Importing the package does not start Taichi; the first call that needs a kernel starts it.
"""

import ast
import atexit
import contextlib
import ctypes
import gc
import inspect
import io
import math
import os
import platform
import sys
import textwrap
import threading
import time
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, NamedTuple

from taichi_ants.errors import AntsError, check_one_of, checked_whole
from taichi_ants.process_variables import fallback_folder, is_writable_folder

ARCHITECTURES = ("cpu", "cuda")
MAX_THREADS = 1024
_LONGEST_LOCK = 60.0  # seconds
_trees: dict[str, Any] = {}  # syntax trees of functions in kernels, by source
inspect.modulesbyfile["<frozen importlib._bootstrap>"] = ""  # or Taichi's decorators search for it

_Modes = ctypes.c_uint32 * 4  # C's `femode_t`; the second number is MXCSR
_FLUSH_TO_ZERO = 1 << 15
_read_modes: Any = lambda modes: None  # noqa: E731
_set_modes: Any = _read_modes
if platform.machine() == "x86_64" and platform.libc_ver()[0] == "glibc":
    _libm = ctypes.PyDLL("libm.so.6")
    _read_modes, _set_modes = _libm.fegetmode, _libm.fesetmode

# Whether kernels for a CPU are compiled and launched as those for a GPU, with the same results, so
# that tests can compare the two on machines without one.
gpu_kernels_on_cpu = False

# A lock for several threads, because Taichi starts, compiles and launches for one thread.
alone = threading.RLock()


class Runtime(NamedTuple):
    """The settings of Taichi: `arch` is "cpu" or "cuda", `threads` the number of CPU threads."""

    arch: str
    threads: int


@cache
def available_threads() -> int:
    """Return the number of CPU threads that this process may use, within a container's quota."""
    n = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with contextlib.suppress(OSError, ValueError):  # no file, or no quota
        quota, period = map(float, Path("/sys/fs/cgroup/cpu.max").read_text().split())
        n = min(n, max(1, math.ceil(quota / period)))
    return n


@cache
def processor() -> str:
    """Return the name of the processor, or of its architecture if the name is unknown."""
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
        line = next(line for line in lines if line.startswith("model name"))
        return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def start(threads: int | None = None, arch: str | None = None) -> Runtime:
    """Return the settings of Taichi, after it was started, or restarted for other settings.

    Call this before each kernel launch, because the user may have reset Taichi. If the user has
    started Taichi, or has fields, this function never restarts it.

    Args:
        threads: CPU threads, 1 to 1024; None keeps the present number, or starts with all threads.
        arch: "cpu" or "cuda"; None keeps the present one, or starts on the CPU.

    Raises:
        AntsError: A setting is not allowed, there is no CUDA device, or the process was forked from
            one in which Taichi ran. Or Taichi is running already, and cannot be restarted, uses
            fast_math, which changes results in the last bit, or uses untested hardware.
    """
    if arch is not None:
        check_one_of("arch", arch, ARCHITECTURES)
    if threads is not None:
        checked_whole("threads", threads, 1, MAX_THREADS)
    import taichi as ti

    with alone:
        running = _running(ti)
        if running is None:
            wanted = Runtime(arch or "cpu", threads or available_threads())
        else:
            wanted = Runtime(arch or running.arch, threads or running.threads)
        if wanted == running:
            return wanted
        if running is not None:
            ours = getattr(ti.lang.impl.get_runtime(), "is_ours", False)
            # Those of the user's program, and of colonies and environments on a GPU.
            data = ti.Field, ti.Ndarray, ti.Texture
            has_data = _exists(data)
            if has_data:
                gc.collect()  # Taichi keeps arrays that kernels were compiled for in cycles
                has_data = _exists(data)
            if not ours or has_data:
                why = "has fields or arrays" if ours else "was not started by taichi_ants"
                raise AntsError(
                    f"arch={wanted.arch!r}, threads={wanted.threads} requires a restart of Taichi, "
                    f"but it runs with {running.arch!r}, {running.threads} threads, and {why}; "
                    "leave out threads and arch, or call ti.reset() first, which destroys all "
                    "fields and arrays."
                )
        _init(ti, wanted)
        return wanted


def stop() -> None:
    """End Taichi if it runs; it then saves the kernels that it has compiled."""
    if "taichi" in sys.modules:
        sys.modules["taichi"].reset()


def _exists(kinds: tuple[type, ...]) -> bool:
    # There are half a million objects, but only a few thousand types.
    types = {type(thing) for thing in gc.get_objects()}
    return any(issubclass(one, kinds) for one in types)


def compiles_for_gpu() -> bool:
    """Return whether kernels are compiled for a GPU, by a Taichi that runs."""
    import taichi as ti

    return gpu_kernels_on_cpu or ti.lang.impl.current_cfg().arch == ti.cuda


def start_with_checks() -> None:
    """Restart Taichi on one thread, with checks of the bounds of arrays."""
    import taichi as ti

    _init(ti, Runtime("cpu", 1), debug=True, offline_cache=False)


class Flushing:
    """A context in which this thread flushes subnormal numbers to zero, as those of Taichi do.

    On x86-64, Taichi sets the processor's flag for this in the thread that starts it and in its own
    threads. Kernels also compute in the calling thread, whose other arithmetic keeps them.
    """

    def __init__(self) -> None:
        self._kept, self._flushing = _Modes(), _Modes()
        _read_modes(self._flushing)
        self._flushing[1] |= _FLUSH_TO_ZERO

    def __enter__(self) -> None:
        _read_modes(self._kept)
        _set_modes(self._flushing)

    def __exit__(self, *_: object) -> None:
        _set_modes(self._kept)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Return a context in which Taichi compiles and launches our kernels.

    It warns neither of numbers that kernels narrow on purpose, nor of long loops that are unrolled.
    The default types are f32 and i32, not the user's. Errors show their line without a mark of the
    place, because marks for all expressions take half of the time in which Taichi loads a cached
    kernel. Taichi reads and parses a function at each call of it in a kernel; here, once.
    """
    import taichi as ti
    from taichi._lib import core
    from taichi.lang import kernel_impl
    from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext as Context

    levels = ("trace", "debug", "info", "warn", "error")
    before = next((level for level in levels if core.logging_effective(level)), "critical")
    core.set_logging_level("error")
    marked, Context.get_pos_info = Context.get_pos_info, _line_of
    reads = {name: getattr(kernel_impl, name) for name in _READS}
    vars(kernel_impl).update(_READS)
    running, config = ti.lang.impl.get_runtime(), ti.lang.impl.current_cfg()
    types = running.default_fp, running.default_ip  # those of `config` would be references
    try:
        for options in (running, config):
            options.default_fp, options.default_ip = ti.f32, ti.i32
        with Flushing(), warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)
            yield
    finally:
        for options in (running, config):
            options.default_fp, options.default_ip = types
        Context.get_pos_info = marked
        vars(kernel_impl).update(reads)
        core.set_logging_level(before)


@cache
def _source_lines(function: Any) -> tuple[list[str], int]:
    from taichi.lang._wrap_inspect import getsourcelines

    return getsourcelines(function)


def _parse(source: str) -> Any:
    """Return the syntax tree of a function, one that no call uses."""
    tree: Any = _trees.pop(source, None) or ast.parse(source)
    tree.source = source
    return tree


def _transform(tree: Any, context: Any) -> Any:
    from taichi.lang.ast import transform_tree

    result = transform_tree(tree, context)
    if not (context.is_kernel or context.is_real_function):  # Taichi changes their trees
        _trees[tree.source] = tree
    return result


# Functions with which Taichi reads source, but once for each.
_READS = {
    "ast": SimpleNamespace(parse=_parse),
    "getsourcelines": _source_lines,
    "textwrap": SimpleNamespace(fill=cache(textwrap.fill), dedent=cache(textwrap.dedent)),
    "transform_tree": _transform,
}


def _line_of(context: Any, node: Any) -> str:
    """Return the line of a node of a kernel, in Taichi's format."""
    vars(node).pop("caller", None)  # from an earlier use of the tree
    number, function = context.lineno_offset + node.lineno, context.func.func.__name__
    return f'File "{context.file}", line {number}, in {function}:\n{context.src[node.lineno - 1]}\n'


def _running(ti: ModuleType) -> Runtime | None:
    """Return the settings of a running Taichi, or None."""
    runtime = ti.lang.impl.get_runtime()
    if runtime.prog is None:
        return None
    if getattr(runtime, "is_forked", False):
        raise AntsError(
            "this process was forked from one in which Taichi runs, and Taichi does not work after "
            'a fork; start processes with multiprocessing.get_context("spawn") or "forkserver".'
        )
    config = ti.lang.impl.current_cfg()
    arch = {ti.x64: "cpu", ti.arm64: "cpu", ti.cuda: "cuda"}.get(config.arch)
    if arch is None or config.fast_math:
        how = "with fast_math=True, which changes results in the last bit"
        how = how if arch else f"on {config.arch}, on which the kernels are not tested"
        raise AntsError(
            f"Taichi is running {how}; call ti.init(arch=ti.cpu, fast_math=False), or call "
            "ti.reset() and let taichi_ants start Taichi; both destroy all fields and arrays."
        )
    return Runtime(arch, int(config.cpu_max_num_threads))


def _init(ti: ModuleType, wanted: Runtime, **others: object) -> None:
    settings = {
        "fast_math": False,  # so that results are the same bits everywhere
        "cpu_max_num_threads": wanted.threads,
        "make_cpu_multithreading_loop": False,  # distribute runs one by one, as they are uneven
        "cfg_optimization": False,  # takes half of the time to compile, and LLVM does it as well
        "default_fp": ti.f32,
        "default_ip": ti.i32,
        "offline_cache_file_path": str(cache_folder()),
        **others,
    }
    arch = ti.cuda if wanted.arch == "cuda" else ti.cpu
    # These environment variables would change the settings, or make Taichi warn.
    names = [f"TI_{name.upper()}" for name in ("arch", "log_level", *settings)]
    hidden = {name: os.environ.pop(name) for name in names if name in os.environ}
    with contextlib.redirect_stdout(io.StringIO()), Flushing():
        try:
            ti.init(arch=arch, log_level=ti.ERROR, **settings)
        finally:
            os.environ.update(hidden)
    ti.lang.impl.get_runtime().is_ours = True
    atexit.register(stop)  # which saves kernels; otherwise, a collection of garbage would do so
    ti.lang.impl.get_runtime().materialize()  # other threads may not
    if wanted.arch == "cuda" and ti.lang.impl.current_cfg().arch != ti.cuda:
        ti.reset()
        raise AntsError("arch is 'cuda', but no CUDA device is usable here; choose 'cpu'.")


def cache_folder() -> Path:
    """Return the folder of the kernel cache, or a temporary one if it is not writable."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.environ["HOME"], ".cache")
    chosen = os.environ.get("TI_OFFLINE_CACHE_FILE_PATH")  # Taichi's own variable for it
    folder = Path(chosen) if chosen else Path(base) / "taichi_ants" / "kernels"
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        # Taichi uses this lock for moments. An old one is from a killed process, and would keep
        # all others from adding kernels.
        lock = folder / "ticache.lock"
        if time.time() - lock.stat().st_mtime > _LONGEST_LOCK:
            lock.unlink()
    return folder if is_writable_folder(str(folder)) else Path(fallback_folder()) / "kernels"
