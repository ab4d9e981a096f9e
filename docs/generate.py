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
from dataclasses import fields, is_dataclass
from functools import cached_property
from importlib import import_module
from inspect import isclass, isfunction, ismodule
from pathlib import Path
from typing import Any
from unittest import mock

DOCS = Path(__file__).parent
REFERENCE = DOCS / "reference"
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "experiments")]

import taichi_ants  # noqa: E402
from taichi_ants import envs, learners, measures, rules, task, worlds  # noqa: E402, F401
from taichi_ants.commands import COMMANDS  # noqa: E402
from taichi_ants.files import tomllib  # noqa: E402
from taichi_ants.measures.finished import FINISHED  # noqa: E402
from taichi_ants.protocol import EVENTS  # noqa: E402
from taichi_ants.settings import Named, declared  # noqa: E402
from taichi_ants.studies import command_line  # noqa: E402
from taichi_ants.studies.design import Design  # noqa: E402
from taichi_ants.studies.sweep_file import KEYS, KINDS  # noqa: E402
from taichi_ants.task import observations  # noqa: E402


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown."""
    heads = list(heads)
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(' '.join(c.split()) for c in line)} |" for line in lines)


def settings_table(owner: Any, path: str = "") -> str:
    """Return the settings of a class or function, without those of its groups."""
    rows = []
    for one in declared(owner):
        values, default, meaning = one.in_words
        if one.is_group:
            anchor = f"{one.path.replace('.', '')}-{one.kind.__name__}".lower()
            values = f"{values}; see [below](#{anchor})"
        rows.append([f"`{one.path}`", values, default, meaning])
    return table(("Setting", "Values", "Default", "Meaning"), rows)


def groups_of(owner: Any) -> Iterator[str]:
    """Yield the tables of a class of settings and of its groups, each after its docstring."""
    about = re.split(r"\n\n(?:Attributes:|>>> )", owner.__doc__ or "")[0]
    yield f"### `{owner.path}`: {owner.__name__}\n\n{about}"
    if declared(owner):
        yield settings_table(owner)
    for one in declared(owner):
        if one.is_group or one.kind is Named:
            yield from groups_of(one.entry if one.kind is Named else one.kind)


def settings(kind: str) -> str:
    """Return the settings of a class with its groups, or of all learners or worlds."""
    if kind == "learners":
        owners = {name: learners.get(name).hyperparameters for name in learners.names()}
    elif kind == "worlds":
        owners = {name: worlds.registry.WORLDS.get(name) for name in worlds.names()}
    else:
        return "\n\n".join(groups_of(getattr(taichi_ants, kind)))
    return "\n\n".join(
        f"### `{name}`\n\n{settings_table(owner)}"
        for name, owner in owners.items()
        if declared(owner)
    )


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
        return all_learners()
    return table(
        ("Name", "Reads", "Unit", "Meaning"),
        (
            [f"`{one.name}`", {None: "a state", "counts": "counts", "run": "finished runs"}[one.of],
             one.unit, one.summary]
            for one in measures.BUILT_IN.values()
        ),
    )  # fmt: skip


def all_learners() -> str:
    """Return what learners declare, then the update of each, as its module describes it."""
    rows, updates = [], []
    for name in learners.names():
        one = learners.get(name)
        memory = one.memory(one.hyperparameters(), 128)
        tables = {1: "1 table"}.get(n := memory.tables + 1, f"{n} tables")
        numbers = memory.floats + memory.integers
        own = [f"`{setting.name}`" for setting in declared(one.hyperparameters)]
        stored = tables + (f", {numbers} numbers" if numbers else "")
        yes_or_no = ["yes" if is_so else "no" for is_so in (one.draws_next_action, one.td_error)]
        rows.append([f"[`{name}`](#{name})", ", ".join(own) or "none", stored, *yes_or_no])
        about = import_module(f"taichi_ants.learners.{name}").__doc__ or ""
        updates.append(f"### `{name}`\n\n{about.strip()}")
    heads = (
        "Hyperparameters",
        "Memory for 128 states",
        "Draws the next action",
        "Can share a table",
    )
    return "\n\n".join([table(("Learner", *heads), rows), *updates])


def measures_of(kind: str) -> str:
    """Return the measures of finished runs of a kind."""
    rows = ([f"`{one.name}`", one.unit, one.summary] for one in FINISHED[kind].values())
    return table(("Measure", "Unit", "Meaning"), rows)


def tables(command: str) -> str:
    """Return the tables that a command writes, with all their columns."""
    every = tomllib.loads((REFERENCE / "columns.toml").read_text("utf-8"))[command]
    if command == "names":
        rows = ([f"`{name}`", one["meaning"]] for name, one in every.items())
        return table(("In a name", "Stands for"), rows)
    return "\n\n".join(
        f"### `{name}` of `{command}`\n\nIt has a row for each {one['row']}.\n\n"
        + table(("Column", "Meaning"), ([f"`{c}`", about] for c, about in one["columns"].items()))
        for name, one in every.items()
    )


def sweep_keys(part: str) -> str:
    """Return the keys of sweep files: "file", "world", "events", or those of a kind of point."""
    if part == "events":
        rows = [[f"`[[{name}]]`", kind.__doc__.split("\n\n")[0]] for name, kind in EVENTS.items()]
    elif part in KINDS:
        own = [one for one in declared(KINDS[part]) if one.name not in KEYS]
        rows = [[f"`{one.name}`", *one.in_words] for one in own]
        return table(("Key", "Values", "Default", "Meaning"), rows).replace("'", '"')
    else:
        meanings = tomllib.loads((REFERENCE / "sweep_keys.toml").read_text("utf-8"))[part]
        for one in declared(Design) if part == "file" else ():
            values, default, _ = one.in_words
            meanings[one.name] = f"{one.rule.help}; {values} (default: {default})"
        rows = [[f"`{name}`", meanings[name]] for name in (KEYS if part == "file" else meanings)]
    return table(("Key", "Meaning"), rows).replace("`'", '`"').replace("'`", '"`')


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


class Captured(Exception):  # noqa: N818
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
                shown = f"[{words}]" if action.nargs == "?" else words
                usage += f" {shown}" if short else ""
                lines.append([f"`{words}`", formatter._expand_help(action) if action.help else ""])
        about = " ".join((parser.description or "").split())
        head = f"### `{parser.prog}`\n\n" if kinds else ""
        what = table(
            ("Option", "Meaning"),
            ([a.replace("|", "\\|"), b.replace("|", "\\|")] for a, b in lines),
        )
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
         ["action", f"`{made.single_action_space}`"]],
    )  # fmt: skip


MAKERS: dict[str, Callable[[str], str]] = {
    "settings": settings,
    "list": listed,
    "inputs": inputs,
    "commands": commands,
    "measures": measures_of,
    "spaces": spaces,
    "sweep": sweep_keys,
    "tables": tables,
}
_BLOCK = re.compile(r"(<!-- generated: (\w+) (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)


def filled(page: str) -> str:
    """Return a page with its generated parts."""
    return _BLOCK.sub(lambda m: f"{m[1]}\n{MAKERS[m[2]](m[3])}\n\n{m[4]}", page)


MODULES = (
    *("", "worlds", "task", "task.observations", "task.states", "interventions", "learners"),
    *(
        "learners.policies",
        "learners.memory",
        "measures",
        "rules",
        "envs",
        "envs.forage",
        "envs.colony",
        "envs.colony_v0",
    ),
    *("rendering", "viewer", "offline", "analysis.statistics", "analysis.behaviour"),
    *("analysis.bounds", "analysis.style", "testing", "reference"),
)


def imported(module: str) -> Any:
    """Return a module of the package; "" is the package."""
    return import_module(f"taichi_ants.{module}".rstrip("."))


def public_names(module: Any) -> list[str]:
    """Return the public names of a module that are not modules; by default, what it defines."""
    names = getattr(module, "__all__", None)
    if names is None:
        own = {n: v for n, v in vars(module).items() if isclass(v) or isfunction(v)}
        names = [n for n, v in own.items() if v.__module__ == module.__name__]
    return [n for n in names if not n.startswith("_") and not ismodule(getattr(module, n))]


# Members of public classes that only the package uses: pages leave them out, and they may change.
INTERNAL = {
    "Caste": "pheromones_laid",
    "Choice": "needs_table own_rule weights",
    "ColonyEpisodes": "measured of_world",
    "Every": "check",
    "Field": "counts_without_food numbers",
    "Interventions": "set_task state stream",
    "Intervention": "check check_in",
    "Learner": "memory_for settings",
    "Measure": "check_state computed label uses_iqm",
    "Move": "check",
    "Observation": "ahead",
    "Parameters": "entry_named",
    "Pheromone": "darkest decay fades_after lasting numbers own_deposit own_evaporation share",
    "Place": "check check_in",
    "ProtocolEvent": "check times",
    "ReferenceColony": "add castes fill new_ant observe table_of",
    "Rewards": "by_event largest",
    "Rollouts": "measured",
    "Rule": "result",
    "Run": "of_colony of_lone_ant",
    "SetLearningRate": "check_in",
    "SetTask": "as_dict changed check check_in converted",
    "SetTrail": "check_in",
    "Setting": "replace",
    "ColonyState": "nbytes next_actions streams tables_of_ants",
    "Recording": "to_bytes",
    "Dataset": "described facts",
    "Settings": "check converted entry_named named uses",
    "ShorthandSettings": "as_dict converted facts from_dict replace",
    "Snapshot": "ordered",
    "Task": "all_cues ants_change check cues_of food_changes needs_table number_of numbers sees"
    " own_reward own_rules pheromones_while uses",
    "Threshold": "converted exists",
    "Tidy": "columns measured",
    "Traffic": "shared",
    "TrainingConfig": "least_learning_rate next_epsilon next_learning_rate",
    "TrainingResult": "measured",
    "When": "check",
    "World": "closer first_starts nests_of uses",
    "_OfAnts": "check",
}


_MEMBERS = (classmethod, staticmethod, property, cached_property)


def public_members(kind: Any) -> dict[str, Any]:
    """Return the methods and properties of a class that its page describes, by name."""
    if not isclass(kind):
        return {}
    hidden = {field.name for field in fields(kind)} if is_dataclass(kind) else set()
    hidden |= {*getattr(kind, "_fields", ())}
    found: dict[str, Any] = {}
    for base in kind.__mro__:
        if not base.__module__.startswith("taichi_ants."):
            continue
        hidden |= {*INTERNAL.get(base.__name__, "").split()} - found.keys()
        for name, value in vars(base).items():
            # The docstring of the class describes properties that have no docstring.
            is_member = callable(value) or (isinstance(value, _MEMBERS) and value.__doc__)
            if is_member and name[0] != "_" and name not in hidden:
                found.setdefault(name, value)
    return found


# Data of the package, whose values have no docstrings.
DATA = {
    "At": "The start of the memory of a run: the offsets `table`, `floats` and `integers`, i32.",
    "BEHAVIOURS": "The behaviours of `classify` in words; a behaviour is an index.",
    "BUILT_IN": "The measures of the package by name, see [measures](../measures.md).",
    "CELL_LETTERS": "The letters of codes, of an ant without food and of one with food.",
    "KINDS": "The kinds of rules by name, with their results and [inputs](../rule_inputs.md).",
    "LEARNERS": "The learners of the reference by name, in plain Python.",
    "OBSERVATIONS": "The observations of the reference by name, in plain Python.",
    "REACHABLE_STATES": "The 100 indices of states that can occur under the rules, ascending.",
    "TASK_NAMES": "The words for the load of an ant without food and of one with food.",
    "Transition": "A step of an ant: `state`, `action`, `next_state`, `next_action` (-1 if none was"
    " drawn), `terminated` and `truncated`, i32, and `reward`, f32.",
    "PAUSE": "Seconds for which an animation shows its last picture.",
}


def api(module: str, seen: dict[int, str]) -> str:
    """Return the page of a module: a directive for each public name, which Sphinx fills.

    Names in `seen`, of pages before, are links.
    """
    found = imported(module)
    name = found.__name__
    here, elsewhere, data = [], [], []
    for public in sorted(public_names(found), key=str.lower):
        value = getattr(found, public)
        if public in DATA and not isclass(value):
            data.append(f"`{public}`\n: {DATA[public]}\n")
        elif id(value) in seen:
            elsewhere.append(f"{{py:obj}}`{seen[id(value)]}`")
        else:
            seen[id(value)] = f"{name}.{public}"
            members = ", ".join(public_members(value))
            more = [f"   :members: {members}"] if members else []
            here += [f".. auto{'class' if isclass(value) else 'function'}:: {public}", *more, ""]
    lines = [f"# {name}", "", (found.__doc__ or "").strip().replace("::\n", ":\n"), ""]
    if elsewhere:
        lines += [f"Also here: {', '.join(elsewhere)}.", ""]
    if here:
        lines += ["```{eval-rst}", f".. currentmodule:: {name}", "", *here, "```", ""]
    return "\n".join([*lines, *data])


def pages() -> dict[Path, str]:
    """Return the text of each generated page, and of each page with generated parts."""
    seen: dict[int, str] = {}
    made = {
        REFERENCE / "api" / f"{module or 'taichi_ants'}.md": api(module, seen) for module in MODULES
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
