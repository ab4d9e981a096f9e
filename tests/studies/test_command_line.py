"""What the command lines share: arguments, exits, plugins, progress."""

import signal
import sys
from pathlib import Path

import pytest

from taichi_ants.errors import AntsError
from taichi_ants.studies import command_line
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
from taichi_ants.studies.plugins import load_code, load_plugin, read_plugin


@pytest.fixture
def parser():
    parser = Parser("Does something.")
    parser.add_argument("--size", type=whole_number(1, 9), default=3, help="how large")
    parser.add_argument("--seed", type=whole_number(), default=0, help="the first")
    parser.add_argument("--count", type=whole_number(2), help="how many")
    parser.add_argument(
        "--rates", nargs="+", type=float, metavar="X", default=(0.1, 2.0), help="how fast"
    )
    parser.add_argument("--loud", action="store_true", help="whether")
    return parser


def refused(parser, arguments, capsys):
    with pytest.raises(SystemExit) as end:
        parser.parse_args(arguments)
    assert end.value.code == 2
    return capsys.readouterr().err


def test_what_was_given_is_told_even_where_it_is_the_default(parser):
    settings, given = parser.parse_given(["--size=3", "--rates", "1", "-2", "--loud"])
    assert given == {"size": "--size", "rates": "--rates", "loud": "--loud"}
    assert (settings.size, settings.rates, settings.seed) == (3, [1.0, -2.0], 0)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--size", "0"], "--size: 0 is not allowed; it must be from 1 to 9"),
        (["--size", "10"], "--size: 10 is not allowed; it must be from 1 to 9"),
        (["--size", "2.5"], "--size: '2.5' is not a whole number"),
        (["--count", "1"], "--count: 1 is not allowed; it must be at least 2"),
        (["--rates", "1", "x"], "--rates: 'x' is not a number"),
        (["--rates"], "--rates: expected at least one argument"),
        (["--siz", "3"], "unrecognized arguments: --siz 3"),
        (["--size", ""], "the argument after '--size' is empty; give a value or leave it out"),
        (["--size="], "--size is empty; give a value or leave it out"),
        (["a", ""], "the argument after 'a' is empty; give a value or leave it out"),
        (["a\nb"], "unrecognized arguments: a b"),
    ],
)
def test_mistakes_are_one_sentence(arguments, sentence, parser, capsys):
    assert refused(parser, arguments, capsys) == f"error: {sentence}; see --help.\n"


def test_help_shows_the_defaults_that_say_something(parser, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    lines = [" ".join(line.split()) for line in parser.format_help().splitlines()]
    assert "--size SIZE how large (default: 3)" in lines
    assert "--seed SEED the first (default: 0)" in lines
    assert "--count COUNT how many" in lines
    assert "--rates X [X ...] how fast (default: 0.1 2.0)" in lines
    assert "--loud whether" in lines


def fail_with(error):
    def command():
        print("before")
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "status", "says"),
    [
        (AntsError("the world is flat."), 2, "error: the world is flat.\n"),
        (AntsError("one\ntwo."), 2, "error: one two.\n"),
        (
            MemoryError("Unable to allocate 64.0 GiB for an array"),
            2,
            "error: there is too little memory for this; choose smaller numbers.\n",
        ),
        (KeyboardInterrupt(), 130, "Halted.\n"),
        (BrokenPipeError(32, "Broken pipe"), 0, ""),
        (
            FileNotFoundError(2, "No such file or directory", "x.txt"),
            2,
            "error: [Errno 2] No such file or directory: 'x.txt'.\n",
        ),
    ],
)
def test_how_commands_end(error, status, says, capsys):
    with pytest.raises(SystemExit) as end:
        run_command(fail_with(error), "Halted.")
    assert end.value.code == status
    assert capsys.readouterr() == ("before\n", says)


def test_mistakes_of_ours_are_not_hidden():
    with pytest.raises(ZeroDivisionError):
        run_command(lambda: 1 / 0)


def test_an_interruption_that_a_library_swallows_is_found_later(capsys):
    steps = []

    def command():
        try:
            signal.raise_signal(signal.SIGINT)
        except BaseException:
            steps.append("swallowed")
        with progress_bar("title") as progress:
            steps.append("not reached")
            progress(0.1)

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(SystemExit) as end:
        run_command(command)
    assert end.value.code == 130
    assert capsys.readouterr().err == "Stopped.\n"
    assert steps == ["swallowed"]
    assert signal.getsignal(signal.SIGINT) is before

    with pytest.raises(SystemExit) as end:  # the next command starts afresh
        run_command(lambda: progress_bar("title").__enter__()(0.1))
    assert end.value.code == 0


def test_plugins_are_executed(tmp_path, monkeypatch):
    monkeypatch.setattr(command_line, "seen_by_plugin", [], raising=False)
    file = tmp_path / "own file.py"
    file.write_text(
        "from taichi_ants.studies import command_line\n"
        "def f(): pass\n"
        "command_line.seen_by_plugin.append((__name__, __file__))\n"
    )
    load_plugin(str(file))
    assert command_line.seen_by_plugin == [("plugin_own file", str(file))]
    assert "def f()" in sys.modules["plugin_own file"].__loader__.get_source("plugin_own file")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1 / 0", r"own\.py.*ZeroDivisionError: division by zero"),
        ("(", "own.py.*SyntaxError"),
        ("raise SystemExit(0)", "own.py.*SystemExit"),
        ("raise ValueError('a\\nb')", "own.py.*ValueError: a b"),
        ("import nosuchmodule", "'nosuchmodule'; install it, or save it in the plugin's folder."),
        ("import random", r"random\.py' has an installed module's name; rename it"),
        ("from numpy import pi", r"numpy\.py' has an installed module's name; rename it"),
        ("import broken", "SyntaxError: .*broken.py"),
        ("from taichi_ants import AntsError\nraise AntsError('It says so.')", r"^It says so\.$"),
    ],
)
def test_plugins_that_fail(text, says, tmp_path):
    for name in ("random", "numpy", "broken"):
        (tmp_path / f"{name}.py").write_text("(")
    (tmp_path / "own.py").write_text(text)
    with pytest.raises(AntsError, match=says):
        load_plugin(str(tmp_path / "own.py"))


def test_a_plugin_imports_files_of_its_folder(tmp_path, monkeypatch):
    (tmp_path / "own.py").write_text("def late():\n    import third_file\n\nimport second_file\n")
    (tmp_path / "second_file.py").write_text("import third_file\nVALUE = third_file.VALUE\n")
    (tmp_path / "third_file.py").write_text("VALUE = 1\n")
    (tmp_path / "fourth_file.py").write_text("")
    files = [str(tmp_path / f"{one}.py") for one in ("own", "third_file", "second_file")]
    assert sorted(read_plugin(files[0])) == sorted(files)
    assert next(iter(read_plugin(files[0]))) == files[0]
    assert read_plugin(files[0])[files[1]] == b"VALUE = 1\n"
    assert read_plugin(None) == {}
    load_plugin(files[0])
    assert sys.modules["second_file"].VALUE == 1
    other = tmp_path / "other"  # another plugin, whose file has the same name
    other.mkdir()
    (other / "own.py").write_text("import second_file\n")
    (other / "second_file.py").write_text("VALUE = 22\n")
    monkeypatch.chdir(other)
    load_plugin("own.py")
    assert sys.modules["second_file"].VALUE == 22


def test_the_packages_and_texts_of_a_plugin_travel_with_it(tmp_path):
    (tmp_path / "study.py").write_text("import parts.inner\nVALUE = parts.inner.VALUE\n")
    (tmp_path / "study_words.toml").write_text("")
    (tmp_path / "parts").mkdir()
    for name, text in {"__init__.py": "", "inner.py": "VALUE = 3\n", "page.html": ""}.items():
        (tmp_path / "parts" / name).write_text(text)
    code = read_plugin(str(tmp_path / "study.py"))
    names = ["study.py", "study_words.toml", "parts/__init__.py", "parts/inner.py"]
    assert list(code) == [str(tmp_path / name) for name in (*names, "parts/page.html")]
    load_code([code])
    assert sys.modules["plugin_study"].VALUE == 3
    assert Path(sys.modules["parts"].__file__).parents[1] != tmp_path
    with pytest.raises(AntsError, match=r"loaded another file 'study\.py'; start new workers"):
        load_code([{**code, "more": b""}])


@pytest.mark.parametrize("name", ["missing.py", "folder.py", "text.txt", "a\0b.py", ""])
def test_what_is_no_plugin(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.py").mkdir()
    (tmp_path / "text.txt").write_text("x = 1")
    with pytest.raises(AntsError, match="cannot read the plugin"):
        load_plugin(name)
