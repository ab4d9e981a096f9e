"""What the command lines of the experiments share: arguments, errors, interruption, progress."""

from __future__ import annotations

import argparse
import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

from taichi_ants.errors import AntsError
from taichi_ants.studies.interruption import stop_if_noted, stoppable

EXIT_BAD_INPUT = 2
_LEFT_OUT = object()


class _HelpFormatter(argparse.HelpFormatter):
    """Shows defaults as they would be typed, and none that says nothing."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default = action.default
        silent = default is None or default is False or default is argparse.SUPPRESS
        if not action.help or silent:
            return action.help
        shown = " ".join(map(str, default)) if isinstance(default, tuple) else default
        return f"{action.help} (default: {shown})"


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one sentence on standard error."""

    program: str | None = None  # what --help calls it; None: the name of the script

    def __init__(self, description: str, **settings: Any) -> None:
        settings.setdefault("prog", self.program)
        super().__init__(
            description=description,
            formatter_class=_HelpFormatter,
            allow_abbrev=False,
            **settings,
        )

    def parse_given(self, arguments: list[str] | None = None) -> tuple[argparse.Namespace, dict]:
        """Parse a command line, and tell what it holds from what is left to defaults.

        Returns:
            The settings; and of those that were given, even as their defaults, the flag by name.
        """
        actions = [one for one in self._actions if one.default is not argparse.SUPPRESS]
        blank = argparse.Namespace(**{action.dest: _LEFT_OUT for action in actions})
        settings, given = self.parse_args(arguments, blank), {}
        for action in actions:
            if getattr(settings, action.dest) is _LEFT_OUT:
                setattr(settings, action.dest, action.default)
            else:
                given[action.dest] = action.option_strings[0]
        return settings, given

    def error(self, message: str) -> NoReturn:
        text = _on_one_line(message).removeprefix("argument ").rstrip(".")
        self.exit(EXIT_BAD_INPUT, f"error: {text}; see --help.\n")


def add_common(parser: argparse.ArgumentParser) -> None:
    """The options of all commands that compute something."""
    add = parser.add_argument
    add("--plugin", metavar="FILE", help="a Python file that registers learners or worlds")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="CPU threads (default: all)")
    add("--arch", choices=("cpu", "cuda"), default="cpu", help="where kernels run")


def add_results(parser: argparse.ArgumentParser, place: str) -> None:
    """The options of commands with a folder of results."""
    add = parser.add_argument
    add("--out", type=Path, metavar="FOLDER", help=f"for the results (default: {place})")
    add("--force", action="store_true", help="replace what FOLDER holds")
    add("--no-figures", action="store_true", help="draw no figures")


BESIDE_DEFAULTS = "results/{0}, and behind it what differs from the defaults, as in results/{0}-{1}"
_NOT_IN_NAMES = ("out", "threads", "force", "no_figures", "no_render")  # they change no results
_NAMED_BY_VALUE = ("world", "plugin")  # without the flag


def default_folder(
    parser: Parser, command: str, settings: argparse.Namespace, **usual: Any
) -> Path:
    """Where the results of a command go by default: one folder for each way to call it.

    Args:
        parser: Knows the defaults, and the order of flags.
        command: The folder of the defaults is results/COMMAND.
        settings: What counts; behind the name comes what differs from the defaults.
        usual: Other defaults than the parser's.

    Returns:
        As results/compare-garden-quick or results/compare-seeds-20-discounts-0.8-0.9.
    """
    parts = [command]
    for action in parser._actions:
        value = getattr(settings, action.dest, argparse.SUPPRESS)
        default = usual.get(action.dest, action.default)
        if value in (argparse.SUPPRESS, default) or action.dest in _NOT_IN_NAMES:
            continue
        flag = [action.option_strings[0].removeprefix("--")]
        if action.dest in _NAMED_BY_VALUE:
            parts.append(Path(value).stem)
        elif value is True:
            parts += flag
        else:
            parts += flag + [str(one) for one in (value if isinstance(value, tuple) else (value,))]
    return Path("results", re.sub(r"[^\w.+-]+", "_", "-".join(parts)))


def whole_number(least: int | None = None, most: int | None = None) -> Callable[[str], int]:
    """An argument type: a whole number within bounds."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if (least is not None and value < least) or (most is not None and value > most):
            bounds = f"at least {least}" if most is None else f"from {least} to {most}"
            raise argparse.ArgumentTypeError(f"{value} is not allowed, it must be {bounds}")
        return value

    return parse


def number(text: str) -> float:
    """An argument type: a number."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None


class ListAction(argparse.Action):
    """Collects values that are separated by blanks or commas: `--x 1 2` and `--x 1,2` alike.

    Of equal ones the first counts, unless all are kept with `unique=False`.
    """

    def __init__(
        self,
        *args: Any,
        item: Callable[[str], object] = str,
        unique: bool = True,
        **settings: Any,
    ):
        super().__init__(*args, **{**settings, "nargs": "+"})
        self.item, self.unique = item, unique

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[str] | None,
        option_string: str | None = None,
    ) -> None:
        items = [part for value in values or () for part in value.split(",") if part]
        try:
            parsed = tuple(self.item(part) for part in items)
        except argparse.ArgumentTypeError as error:
            raise argparse.ArgumentError(self, str(error)) from None
        if not parsed:
            raise argparse.ArgumentError(self, "the list is empty, give at least one value")
        setattr(namespace, self.dest, tuple(dict.fromkeys(parsed)) if self.unique else parsed)


def run_command(command: Callable[[], None], interrupted: str = "Stopped.") -> NoReturn:
    """Run a command line to its exit: mistakes end in one sentence, never in a traceback.

    Args:
        command: The work.
        interrupted: What is said after Ctrl-C or SIGTERM.
    """
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="replace")  # a terminal that lacks a character shows "?"
    try:
        with stoppable(interrupted):
            command()
        if sys.stdout is not None:  # it is None if the caller has closed it
            sys.stdout.flush()
        status = 0
    except AntsError as error:
        notice(f"error: {error}")
        status = EXIT_BAD_INPUT
    except MemoryError:
        notice("error: this needs more memory than there is; ask for less at once.")
        status = EXIT_BAD_INPUT
    except BrokenPipeError:  # the reader of our output has gone, for example `| head`
        _discard_output()
        status = 0
    except OSError as error:
        _discard_output()
        place = "the output" if error.filename is None else repr(str(error.filename))
        notice(f"error: cannot read or write {place}: {error.strerror or error}.")
        status = EXIT_BAD_INPUT
    sys.exit(status)


def load_plugin(path: str) -> None:
    """Execute a Python file of the user's, which registers learners or worlds.

    Raises:
        AntsError: The file cannot be read, raises or exits.
    """
    spec = importlib.util.spec_from_file_location(f"plugin_{Path(path).stem}", path)
    if spec is None or spec.loader is None or not Path(path).is_file():
        raise AntsError(f"cannot read the plugin {path!r}; name a Python file (.py).")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # Taichi reads the source of functions by their module
    try:
        spec.loader.exec_module(module)
    except AntsError:
        raise
    except (Exception, SystemExit) as error:
        reason = f"{type(error).__name__}: {_on_one_line(str(error))}"
        raise AntsError(f"the plugin {path!r} failed with {reason}; mend the file.") from error


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float], None]]:
    """A progress bar with the time left on standard error; nothing where that is no terminal.

    Yields:
        To be called with the share of the work that is done, 0 to 1. It raises KeyboardInterrupt
        if a signal to stop came, but a library has swallowed it.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda share: stop_if_noted()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn(title),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(compact=True, elapsed_when_finished=True),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=1.0)

        def update(share: float) -> None:
            stop_if_noted()
            bar.update(task, completed=share)

        yield update


def notice(text: str) -> None:
    """Say something on one line of standard error."""
    if sys.stderr is not None:
        with suppress(OSError):
            print(_on_one_line(text), file=sys.stderr)


def _on_one_line(text: str) -> str:
    return " ".join(text.splitlines())


def _discard_output() -> None:
    """Drop what cannot be written, so that Python does not fail over it once more at exit."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
