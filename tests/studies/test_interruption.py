"""Signals that end a command, whatever it is doing."""

import re
import signal
import subprocess
import sys
import weakref

import pytest
from command_lines import EXPERIMENTS, ROOT, environment

from taichi_ants.studies.interruption import held, stop_if_noted, stoppable


def stopped_by(number, work):
    """The exit status of work that a signal stops."""
    before = signal.getsignal(number), sys.unraisablehook
    with pytest.raises(SystemExit) as end, stoppable("Halted."):
        work()
    assert (signal.getsignal(number), sys.unraisablehook) == before
    with stoppable():  # the next one starts afresh
        stop_if_noted()
    return end.value.code


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_work_with_a_line(number, status, capsys):
    assert stopped_by(number, lambda: signal.raise_signal(number)) == status
    assert capsys.readouterr() == ("", "Halted.\n")


def test_an_error_that_a_library_makes_of_it_is_still_it(capsys):
    """As an import of a C extension does: "ImportError: initialization failed"."""

    def work():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None

    assert stopped_by(signal.SIGINT, work) == 130
    assert capsys.readouterr().err == "Halted.\n"


class Thing:
    pass


def test_in_a_callback_it_is_noted_without_a_traceback(capsys):
    def work():
        thing = Thing()
        reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
        del thing
        assert reference() is None
        stop_if_noted()

    assert stopped_by(signal.SIGINT, work) == 130
    assert capsys.readouterr().err == "Halted.\n"


def test_other_errors_in_callbacks_are_told(capsys):
    with stoppable():
        thing = Thing()
        reference = weakref.ref(thing, lambda _: 1 / 0)
        del thing
        assert reference() is None
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_what_is_held_can_ask_whether_to_end(capsys):
    told = []

    def work():
        with held() as stopped:
            told.append(stopped())
            signal.raise_signal(signal.SIGINT)
            stop_if_noted()  # not where it waits
            told.append(stopped())
            raise KeyboardInterrupt("Stopped at tick 3.")

    assert stopped_by(signal.SIGINT, work) == 130
    assert told == [False, True]
    assert capsys.readouterr().err == "Stopped at tick 3.\n"


def test_a_third_signal_is_not_held_up():
    steps = []

    def work():
        with held():
            for _ in range(3):
                signal.raise_signal(signal.SIGINT)
                steps.append("waits")

    assert stopped_by(signal.SIGINT, work) == 130
    assert steps == ["waits", "waits"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_is_ignored_on_purpose_stays_ignored(number):
    """As of `nohup`, or of a shell for its background processes."""
    before = signal.signal(number, signal.SIG_IGN)
    try:
        with stoppable():
            signal.raise_signal(number)
            stop_if_noted()
    finally:
        signal.signal(number, before)


def test_what_is_inside_another_leaves_the_end_to_it(capsys):
    def work():
        with stoppable("Inner."):
            pass
        signal.raise_signal(signal.SIGINT)

    assert stopped_by(signal.SIGINT, work) == 130
    assert capsys.readouterr().err == "Halted.\n"


COMMANDS = ("compare", "goss", "taichi-ants")
COUNTING = """
import runpy, signal, sys

class Interrupting:
    left = {imports}

    def find_spec(self, name, path=None, target=None):
        if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            self.left -= 1
            if self.left == 0:
                signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Interrupting())
{start}
"""


@pytest.mark.parametrize("name", COMMANDS)
def test_while_a_command_is_imported(name, tmp_path):
    """Not before its first import: Python itself and what little that one needs come before it."""
    path = str(EXPERIMENTS / f"{name}.py")
    start = f"sys.argv = ['', '--help']\nrunpy.run_path({path!r}, run_name='__main__')"
    if name == "taichi-ants":
        start = "sys.argv[1:] = ['sweep', 'a']\nrunpy.run_module('taichi_ants', {}, '__main__')"
    script = COUNTING.format(imports=(1, 8, 30)[COMMANDS.index(name) % 3], start=start)
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env=environment(tmp_path),
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "Stopped.\n")


def test_all_scripts_begin_as_those_above():
    texts = [path.read_text().split('"""', 2)[2] for path in EXPERIMENTS.glob("*.py")]
    own = [text for text in texts if "run_command" in text or "reporting(" in text]
    assert len(own) > 10
    for text in own:
        first, then = re.findall(r"^(?:from|import|with) (?!__future__|os$).*", text, re.M)[:2]
        assert first == "from taichi_ants.studies.interruption import stoppable"
        assert then.startswith("with stoppable():")


def test_little_is_imported_before_a_command_can_be_stopped(tmp_path):
    script = (
        "import sys, taichi_ants.commands\n"
        "print({'argparse', 'multiprocessing', 'tempfile'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-S", "-c", script],
        cwd=ROOT,
        env=environment(tmp_path),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "set()\n"
