"""The common parts of command lines: options, errors, interruption, progress."""

from __future__ import annotations

import argparse
import atexit
import gc
import os
import re
import sys
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from taichi_ants.errors import AntsError, without_middle, words_of
from taichi_ants.settings import Named, Settings, declared, nested
from taichi_ants.studies.interruption import stop_if_noted, stoppable

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World

EXIT_BAD_INPUT = 2
# Help for options that several commands have.
PLUGIN = "Python file that registers learners, observations, worlds, measures or rules"
# Names of worlds, because an import of their registry would import NumPy.
WORLDS = "paper, open, far_piles, double_bridge, or a map file; --world.SETTING: a setting"
AGAIN = "Stopped; finished parts are saved. Run the same command again to resume."


class _HelpFormatter(argparse.ArgumentDefaultsHelpFormatter):
    """A formatter that shows defaults, except None, flags and empty lists."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default = action.default
        if isinstance(default, (list, tuple)) and default:
            return f"{action.help} (default: {' '.join(map(str, default))})"
        is_silent = isinstance(default, bool) or default in (None, [])
        return action.help if is_silent else super()._get_help_string(action)


class _OneOrList(argparse.Action):
    """An action that stores True without a value, a single value, or a list of values."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option: str | None = None) -> None:
        setattr(namespace, self.dest, values if len(values) > 1 else values[0] if values else True)


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one sentence on standard error.

    The description is the first line of `about`, a module's docstring. `python -OO` removes
    docstrings, so `about` can be None.
    """

    open_settings: tuple[str, ...] = ()  # for example "world": accept any option --world.SETTING
    own_settings: Container[str] = ()  # full names of settings that the command determines itself
    program: str | None = None  # the name in --help; None: the name of the script

    def __init__(self, about: str | None = None, **settings: Any) -> None:
        summary, _, more = (about or "").partition("\n")
        usual: dict[str, Any] = {"description": summary, "epilog": more, "prog": self.program}
        usual |= {"formatter_class": _HelpFormatter, "allow_abbrev": False}
        super().__init__(**{**usual, **settings})

    def parse_given(self, arguments: list[str] | None = None) -> tuple[argparse.Namespace, dict]:
        """Return all settings, and the flags on the command line by the name of their setting."""
        words = sys.argv[1:] if arguments is None else arguments
        flags = [word.partition("=")[0] for word in words if word.startswith("--")]
        return self.parse_args(words), {flag[2:].replace("-", "_"): flag for flag in flags}

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """Return parsed and unknown arguments; refuse empty ones, as from unset variables."""
        words = sys.argv[1:] if args is None else list(args)
        for before, word in zip(["", *words], words, strict=False):
            if word == "" or (word.startswith("--") and word.endswith("=")):
                name = word[:-1] or f"the argument after {before!r}"
                self.error(f"{name} is empty; give a value or leave it out")
            flag = word.partition("=")[0]
            path = flag[2:].replace("-", "_")
            if path in self.own_settings:
                self.error(f"this command sets {flag} itself; leave it out")
            is_open = "." in path and path.partition(".")[0] in self.open_settings
            if is_open and flag not in self._option_string_actions:  # its value is checked later
                self.add_argument(flag, dest=path, type=_literal, nargs="*", action=_OneOrList)
        return super().parse_known_args(words, namespace)

    def error(self, message: str) -> NoReturn:
        text = without_middle(" ".join(message.splitlines())).removeprefix("argument ").rstrip(".")
        text = re.sub(r"invalid (whole )?\S+ value: (.*)", r"\2 is not a \1number", text)
        self.exit(EXIT_BAD_INPUT, f"error: {text}; see --help.\n")


def add_common(parser: argparse.ArgumentParser) -> None:
    """Add the options of all commands that compute something."""
    add = parser.add_argument
    add("--plugin", metavar="FILE", help=PLUGIN)
    add_threads(parser)
    arch = "processor: cpu, or cuda for an NVIDIA GPU"
    add("--arch", choices=("cpu", "cuda"), default="cpu", help=arch)


def add_threads(parser: argparse.ArgumentParser) -> None:
    """Add the option --threads."""
    words = "number of CPU threads (default: all)"
    parser.add_argument("--threads", type=whole_number(1, 1024), metavar="N", help=words)


def add_study(parser: argparse.ArgumentParser, name: str, quick: str = "") -> None:
    """Add the options of commands that run a study; `with_folder` sets the default of --out.

    `name` is the name of the folder of results, and `quick` the help text of --quick, if any.
    """
    add_common(parser)
    add_machines(parser)
    add, default = parser.add_argument, f"results/{name}"
    if quick:
        add("--quick", action="store_true", help=quick)
        default += f", with --quick {default}-quick"
    add("--out", type=Path, metavar="FOLDER", help=f"write the results here (default: {default})")
    add("--force", action="store_true", help="replace finished results in FOLDER")
    add("--no-figures", action="store_true", help="skip figures and animations")


def add_machines(parser: argparse.ArgumentParser) -> None:
    """Add the options of commands that can spread their work, see `command.executor_of`."""
    add = parser.add_mutually_exclusive_group().add_argument
    workers = "number of worker processes on this machine (default: all work in this process)"
    add("--workers", type=whole_number(1, 1024), metavar="N", help=workers)
    ray = "spread the work with Ray over this machine, or over its cluster at HOST:PORT"
    add("--ray", nargs="?", const=True, metavar="HOST:PORT", help=ray)
    shard = "compute the I-th of N equal parts; the last to finish in a folder writes the tables"
    parser.add_argument("--shard", type=_shard, metavar="I/N", help=shard)


def _shard(text: str) -> tuple[int, int]:
    number, _, shards = text.partition("/")
    if not (number.isdecimal() and shards.isdecimal() and 1 <= int(number) <= int(shards)):
        raise argparse.ArgumentTypeError(f"{text!r} is not a shard; write I/N, for example 2/3")
    return int(number), int(shards)


def with_folder(settings: argparse.Namespace, name: str) -> argparse.Namespace:
    """Return the settings with a folder for the results, which --quick changes."""
    name = f"{name}-quick" if getattr(settings, "quick", False) else name
    settings.out = settings.out or Path("results", name)
    return settings


def whole_number(least: int | None = None, most: int | None = None) -> Callable[[str], int]:
    """Return an argument type for whole numbers within bounds."""

    def parse(text: str) -> int:
        value = int(text)
        if (least is not None and value < least) or (most is not None and value > most):
            bounds = f"at least {least}" if most is None else f"from {least} to {most}"
            raise argparse.ArgumentTypeError(f"{value} is not allowed; it must be {bounds}")
        return value

    parse.__name__ = "whole number"  # for argparse's message about other text
    return parse


def add_settings(parser: Parser, base: Settings) -> None:
    """Add an option for each setting except `parser.own_settings`; `base` has the defaults.

    Options of the parameters of rules, fields and castes are accepted by any name.
    """
    parser.usage = "%(prog)s [options]"  # without the list of options, which is too long
    parser.open_settings += (base.path,)
    group = parser.add_argument_group(f"{base.path} settings")
    for setting in declared(type(base)):
        value = getattr(base, setting.name)
        if setting.kind is Named:
            option = f"--{setting.path.replace('_', '-')}.NAME.SETTING"
            names = [entry.name.replace("_", "-") for entry in declared(setting.entry)]
            one_of = ", ".join(names) or "the parameters of the rule"
            about = f"{option}: {setting.rule.help}; SETTING is one of {one_of}. "
            group.description = f"{group.description or ''}{about}"
        elif setting.path not in parser.own_settings and not (
            setting.is_group and not setting.kind.named()  # type: ignore[attr-defined]
        ):
            # The value is checked where it is used.
            how: dict[str, Any] = {"metavar": {int: "N", float: "X"}.get(setting.kind, "NAME")}
            if setting.kind is bool:
                how = {"nargs": "?", "const": True, "metavar": "true|false"}
            how |= {"dest": setting.path, "type": _literal, "default": argparse.SUPPRESS}
            about = setting.about(value).replace("%", "%%")
            group.add_argument(f"--{setting.path.replace('_', '-')}", **how, help=about)
        if setting.is_group:
            add_settings(parser, value)


def _literal(text: str) -> Any:
    """Return the number or flag that a text represents, else the text."""
    for read in (int, float):
        with suppress(ValueError):
            return read(text)
    return {"true": True, "false": False}.get(text, text)


def given_settings(settings: argparse.Namespace) -> dict[str, Any]:
    """Return the settings from options such as --task.delivery, as nested mappings."""
    return nested({path: value for path, value in vars(settings).items() if "." in path})


def given_world(settings: argparse.Namespace) -> World:
    """Return the world of `--world` with the settings of `--world.SETTING` options."""
    from taichi_ants import worlds

    given = given_settings(settings).get("world", {})
    if "seed" in given:
        worlds.registry.check_seed_counts(settings.world)
    return worlds.build(settings.world, **given)


@contextmanager
def reporting(interrupted: str = "Stopped.") -> Iterator[None]:
    """Return a context that reports an error or interruption in one sentence, and exits Python."""
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="replace")  # a terminal that lacks a character shows "?"
    os.environ["MPLBACKEND"] = "agg"  # figures are files, and the user's backend may be missing
    atexit.register(gc.freeze)  # so that Python ends without collections, which take 0.2 s
    status = 0
    try:
        with stoppable(interrupted):
            yield
        if sys.stdout is not None:  # it is None if the caller has closed it
            sys.stdout.flush()
    except BrokenPipeError:  # nobody reads the output any more, for example after `| head`
        _discard_output()
    except (AntsError, OSError, MemoryError) as error:
        _discard_output()
        notice(f"error: {words_of(error).rstrip('.')}.")
        status = getattr(error, "exit_status", EXIT_BAD_INPUT)
    sys.exit(status)


def run_command(command: Callable[[], None], interrupted: str = "Stopped.") -> None:
    """Run a command `reporting` its errors, and exit Python."""
    with reporting(interrupted):
        command()


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float], None]]:
    """Yield a function that shows the finished share of the work, 0 to 1, as a progress bar.

    The bar is on standard error, if that is a terminal. The function raises KeyboardInterrupt if a
    library has ignored a signal to stop.
    """
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(title, total=1.0)

        def update(share: float) -> None:
            stop_if_noted()
            bar.update(task, completed=share)

        stop_if_noted()
        yield update


def notice(text: str) -> None:
    """Print a text on one line of standard error."""
    print(without_middle(" ".join(text.splitlines()), 2000), file=sys.stderr)


def _discard_output() -> None:
    """Discard output that cannot be written, so that Python does not fail again at exit."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
