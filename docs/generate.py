"""Write what the reference takes from declarations: python docs/generate.py.

A page names a table in a comment, `<!-- generated: settings Task -->`; the script writes the table
behind it, up to `<!-- end -->`. The pages in `reference/api/` are made from the public names. A
test fails if a page is not what the script writes.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from inspect import isclass, ismodule
from pathlib import Path
from typing import Any
from unittest import mock

DOCS = Path(__file__).parent
REFERENCE = DOCS / "reference"
sys.path.insert(0, str(DOCS.parent))

import taichi_ants  # noqa: E402
from taichi_ants import envs, learners, measures, rules, task, worlds  # noqa: E402, F401
from taichi_ants.commands import COMMANDS  # noqa: E402
from taichi_ants.settings import Named, all_of, declared  # noqa: E402
from taichi_ants.studies import command_line  # noqa: E402
from taichi_ants.task import observations  # noqa: E402


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown."""
    heads = list(heads)
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(' '.join(c.split()) for c in line)} |" for line in lines)


def rows_of(owner: Any) -> Iterator[list[str]]:
    """Yield the settings of a class or function, and of its groups."""
    for one in all_of(owner):
        values, default, meaning = one.in_words
        if one.kind is Named or not one.is_group:
            yield [f"`{one.path}`", values, default, meaning]
        if one.kind is Named:
            yield from rows_of(one.entry)


def settings(name: str) -> str:
    """Return the settings of a class, of a learner, of the built-in rules, or of a world."""
    kind, _, entry = name.partition(":")
    if kind == "learner":
        owner: Any = learners.get(entry).hyperparameters
    elif kind == "world":
        owner = worlds.registry.WORLDS.get(entry)
    elif kind == "rule":
        owner = rules.get(entry).settings
    else:
        owner = getattr(taichi_ants, kind)
    return table(("Setting", "Values", "Default", "Meaning"), rows_of(owner))


def listed(registry: str) -> str:
    """Return the entries of a registry with what they declare."""
    if registry == "observations":
        every = [observations.get(name) for name in observations.names()]
        return table(
            ("Name", "States", "Parts", "Cells in view", "What the ant sees"),
            (
                [f"`{o.name}`", f"{o.n_states}", " x ".join(map(str, o.parts)),
                 ", ".join(map(str, o.cells)), o.summary]
                for o in every
            ),
        )  # fmt: skip
    if registry == "learners":
        kinds = [learners.get(name) for name in learners.names()]
        return table(
            ("Name", "What it is", "Hyperparameters", "Can share a table"),
            (
                [f"`{one.name}`", one.summary,
                 ", ".join(f"`{s.name}`" for s in declared(one.hyperparameters)) or "none",
                 "yes" if one.td_error else "no"]
                for one in kinds
            ),
        )  # fmt: skip
    return table(
        ("Name", "Reads", "Unit", "Meaning"),
        (
            [f"`{one.name}`", {None: "a state", "counts": "counts", "run": "finished runs"}[one.of],
             one.unit, one.summary]
            for one in measures.BUILT_IN.values()
        ),
    )  # fmt: skip


def inputs(kind: str) -> str:
    """Return the result and the inputs of a kind of rule."""
    form = rules.KINDS[kind]
    number = "a whole number" if form.is_whole else "a number"
    result = f"It returns {form.result}: {number} from {form.least} to {form.most}."
    lines = (
        [f"`{name}`", f"{one.length} numbers" if one.length else "a number", one.meaning]
        for name, one in form.inputs.items()
    )
    return f"{result}\n\n" + table(("Input", "Form", "Meaning"), lines)


class Captured(Exception):
    """A parser, in place of what it would parse."""


def parser_of(command: str) -> argparse.ArgumentParser:
    """Return the parser of a command."""

    def capture(parser: Any, *_: Any, **__: Any) -> None:
        raise Captured(parser)

    module = import_module(f"taichi_ants.commands.{command}")
    with (
        mock.patch.object(command_line.Parser, "parse_args", capture),
        mock.patch.object(command_line.Parser, "parse_given", capture),
        mock.patch.object(command_line.Parser, "program", f"taichi-ants {command}"),
    ):
        try:
            module.parse_arguments([])
        except Captured as captured:
            return captured.args[0]
    raise RuntimeError(f"{command} parses nothing")


def command(name: str) -> str:
    """Return the description and the options of a command, and of its kinds."""
    parts = []
    top = parser_of(name)
    kinds = [a for a in top._actions if isinstance(a, argparse._SubParsersAction)]
    parsers = list(kinds[0].choices.values()) if kinds else [top]
    for parser in parsers:
        usage = f"usage: {parser.prog} [options]"
        lines, more = [], ""
        for action in parser._actions:
            if "." in action.dest:
                more = "\n\nIt also has an option for each [setting](settings.md), such as "
                more += f"`{action.option_strings[0]}`."
            elif not isinstance(action, (argparse._HelpAction, argparse._SubParsersAction)):
                formatter = parser._get_formatter()
                words = formatter._format_action_invocation(action)
                short = not action.option_strings
                usage += f" {words}" if short else ""
                lines.append([f"`{words}`", formatter._expand_help(action) if action.help else ""])
        about = " ".join((parser.description or "").split())
        head = f"### `{parser.prog}`\n\n" if kinds else ""
        what = table(("Option", "Meaning"), ([a.replace("|", "\\|"), b.replace("|", "\\|")] for a, b in lines))
        parts.append(f"{head}{about}\n\n```\n{usage.removeprefix('usage: ')}\n```\n\n{what}{more}")
    return "\n\n".join(parts)


def commands(_: str) -> str:
    """Return the commands, each with its options."""
    return "\n\n".join(f"## {name}\n\n{command(name)}" for name in COMMANDS)


def spaces(name: str) -> str:
    """Return the observation and action space of an environment, of each format."""
    import gymnasium

    made = gymnasium.make_vec(f"taichi_ants/{name}", num_envs=2)
    return table(
        ("Space", "Value"),
        [["observation", f"`{made.single_observation_space}`"],
         ["action", f"`{made.single_action_space}`"],
         ["observation, of 2 environments", f"`{made.observation_space}`"]],
    )  # fmt: skip


MAKERS: dict[str, Callable[[str], str]] = {
    "settings": settings,
    "list": listed,
    "inputs": inputs,
    "commands": commands,
    "spaces": spaces,
}
_BLOCK = re.compile(r"(<!-- generated: (\w+) ?(\S*) -->\n).*?(\n<!-- end -->)", re.DOTALL)


def filled(page: str) -> str:
    """Return a page with its generated parts."""
    return _BLOCK.sub(lambda m: f"{m[1]}\n{MAKERS[m[2]](m[3])}\n{m[4]}", page)


MODULES = (
    *("", "worlds", "task", "learners", "measures", "rules", "envs", "rendering", "offline"),
    *("analysis", "testing", "reference"),
)


def public_names(module: Any) -> list[str]:
    """Return the public names of a module that are not modules."""
    return [
        name
        for name in module.__all__
        if not name.startswith("_") and not ismodule(getattr(module, name))
    ]


def api(module: str) -> str:
    """Return the page of a module: a directive for each public name, which Sphinx fills."""
    name = f"taichi_ants.{module}".rstrip(".")
    found = import_module(name)
    about = (found.__doc__ or "").strip()
    lines = [f"# {name}", "", about.replace("::\n", ":\n"), "", "```{eval-rst}"]
    lines += [f".. currentmodule:: {name}", ""]
    for public in sorted(public_names(found), key=str.lower):
        value = getattr(found, public)
        kind = "class" if isclass(value) else "function" if callable(value) else "data"
        lines += [f".. auto{kind}:: {public}", *(["   :members:"] if kind == "class" else []), ""]
    return "\n".join([*lines, "```", ""])


def pages() -> dict[Path, str]:
    """Return the text of each generated page, and of each page with generated parts."""
    made = {
        REFERENCE / "api" / f"{module or 'taichi_ants'}.md": api(module) for module in MODULES
    }
    for path in sorted(REFERENCE.glob("*.md")):
        text = path.read_text("utf-8")
        if _BLOCK.search(text):
            made[path] = filled(text)
    return made


if __name__ == "__main__":
    os.environ["COLUMNS"] = "100"
    for page, text in pages().items():
        page.parent.mkdir(exist_ok=True)
        page.write_text(text, encoding="utf-8")
