"""ODD descriptions (Overview, Design concepts, Details) of the model of a study.

The protocol is that of Grimm et al. (2006, 2010, 2020). The template `odd.md` has the sentences,
and `odd_rules.toml` has the text of each rule. This module gives them the values of the settings,
which it reads from the manifest and the inputs of finished results. No code of plugins runs.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from taichi_ants import files, learners, measures, worlds
from taichi_ants.analysis.colony.study import OF_STUDY
from taichi_ants.analysis.paper.measures import MEASURES as OF_RUNS
from taichi_ants.analysis.tables import sentence
from taichi_ants.errors import count
from taichi_ants.interventions import INTERVENTIONS
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.registry import BUILT_IN as LEARNERS
from taichi_ants.protocol import EVENTS
from taichi_ants.report.page import text_of
from taichi_ants.settings import Setting, all_of, declared, flat, named_groups
from taichi_ants.studies.design import axes_of
from taichi_ants.studies.points import ColonyPoint, RunPoint
from taichi_ants.studies.sweep_file import MEASURES
from taichi_ants.task import Task, observations
from taichi_ants.worlds.registry import BUILT_IN as WORLDS

RULES: dict[str, dict[str, str]] = files.tomllib.loads(text_of("odd_rules.toml"))

_MOST = 6  # values of a setting that a sentence lists, and worlds of the table
_OWN = re.compile(r"\{([\w.]+)\}")  # the value of a setting in a text
_LISTS = ("measures", "protocol")  # settings whose value is a list
# Built-in worlds with the kinds of world of the colony study that are drawn from them.
_PRESETS = {
    "paper": {"paper"},
    "open": {"open", "rocks", "slow", "small", "wide", "large"},
    "far_piles": {"piles", "one_pile", "moving"},
}
# The settings of points that do not belong to a group.
_OF_POINTS = {
    "episodes": "episodes of training",
    "max_steps": "step limit of an episode",
    "rollouts": "episodes of evaluation",
    "ants": "ants at the start",
    "sharing": "whether ants learn into one table or into their own",
    "start": "where ants start that the world does not list",
    "capacity": "largest number of living ants",
    "ticks": "length of an episode (ticks)",
    "measures": "measures that are read during the evaluation",
    "measure_every": "ticks between two rows of the series of measures",
    "protocol": "events, see section 6",
    "during": "episodes in which the events happen",
}


class Model:
    """The model of a study: the values of its settings, over all of its points.

    Args:
        settings: The `settings` of a manifest.
        asked: The `asked` of the manifest.
        sweep: The contents of the sweep file, if there is one.
    """

    def __init__(
        self, settings: Mapping[str, Any], asked: Mapping[str, Any], sweep: Mapping[str, Any]
    ) -> None:
        self.sweep, self.search = sweep, sweep.get("search", {})
        self.searched = dict(axes_of(self.search.get("vary", {})))
        own = {name: _tried(settings.get(name), one) for name, one in self.searched.items()}
        self.settings = {**settings, **own}
        self.options, self.command = asked["options"], asked["command"]
        self.of_colony = "ants" in settings
        self.seeds = settings["seeds"]
        self.places = [one for place in settings["worlds"] for one in _list_of(place)]
        self.nests = max(len(one.get("queens", [0])) for one in self.places)

    def values(self, name: str) -> list[Any]:
        """Return the values of a setting over all points, each once."""
        value: Any = self.settings.get(name)
        is_shared = not isinstance(value, list) or (
            name in _LISTS and not any(one is None or isinstance(one, list) for one in value)
        )
        found: list[Any] = []
        for one in [value] if is_shared else value:
            if one not in found:
                found.append(one)
        return found

    def has(self, name: str, *values: Any) -> bool:
        """Return whether any point has one of these values, by default any but None and off."""
        found = self.values(name)
        return any(one in values for one in found) if values else any(found)

    def text(self, name: str, unit: str = "") -> str:
        """Return the values of a setting in words."""
        return _several([one for one in self.values(name) if one is not None] or [None], unit)

    def choices(self, name: str, table: str) -> Iterator[str]:
        """Yield the text of each rule that a setting selects, from a table of `odd_rules.toml`."""
        values = [one for one in self.values(name) if one is not None]
        group = name[: name.rfind(".") + 1]
        for value in values:
            unknown = f"The rule `{value}` is defined by the plugin of this study, see its source."
            words = self._filled(RULES[table].get(value, unknown), group)
            yield f'With `{name}` "{value}": {words}' if len(values) > 1 else words

    def _filled(self, text: str, group: str) -> str:
        """Return a text of a rule with the values of the settings of its group."""
        return _OWN.sub(lambda one: self.text(f"{group}{one[1]}"), text)

    def unit(self, group: str) -> str:
        """Return the unit of the levels of a pheromone: what evaporation does to them."""
        texts = (RULES["units"].get(one) for one in self.values(f"{group}.evaporation"))
        words = " or ".join(self._filled(one, f"{group}.") for one in texts if one)
        return f"level; {words}" if words else "level"

    def entries(self, group: str) -> list[str]:
        """Return the names of the entries in a named group of the task, such as its fields."""
        parts = [name.split(".") for name in self.settings]
        return list(dict.fromkeys(one[2] for one in parts if one[:2] == ["task", group]))

    @property
    def learns(self) -> bool:
        """Whether ants learn in this study."""
        return self.has("episodes")

    @property
    def lives(self) -> bool:
        """Whether ants are born or die, or food grows back."""
        values = (self.values(name) for name in self.settings if name.startswith("task.life."))
        used = [one for found in values for one in found if one is not None and one is not False]
        return bool(used or self.entries("foods"))

    @property
    def diffuses(self) -> bool:
        """Whether a pheromone spreads to other cells."""
        groups = ("pheromone", *(f"fields.{name}" for name in self.entries("fields")))
        return any(self.has(f"task.{group}.diffusion") for group in groups)

    def varied(self) -> list[str]:
        """Return the names of the settings that differ between points."""
        if self.searched:
            return _quoted(self.searched)
        if rows := self.settings.get("vary"):
            names = dict.fromkeys(name for row in rows for name in row)
            return [f"`{n}`" for n in names if len({str(row.get(n)) for row in rows}) > 1]
        if "world_kinds" in self.settings:
            return ["the kind of world", "the rules", "the number of ants in training"]
        return _quoted(name for name in self.settings if "." in name and self.values(name)[1:])

    def measures(self) -> dict[str, str]:
        """Return the measures in words, by name."""
        if self.command == "compare":
            return {name: one.words for name, one in OF_RUNS.items()}
        if "measures" not in self.settings:
            return dict(OF_STUDY)
        kind = "colony" if self.of_colony else "runs"
        known = {name: one.words for name, one in MEASURES[kind].items()}
        for name in measures.names():
            one = measures.get(name)
            known.setdefault(name, f"{one.summary}{f' ({one.unit})' if one.unit else ''}")
        wanted = _list_of(self.sweep.get("measures", self.settings["measures"]))
        unknown = "a measure of the plugin of this study"
        return {n: known.get(n, known.get(n.partition(".")[0], unknown)) for n in wanted}

    def observations(self) -> Iterator[tuple[str, str, int | None]]:
        """Yield the name, text and number of states of each observation; None if unknown."""
        for name in self.values("task.observation"):
            if name in observations.names():
                one = observations.get(name)
                yield name, one.summary, one.n_states
            else:
                yield name, "defined by the plugin", None

    def states(self) -> str:
        """Return the number of states that ants distinguish."""
        several = [n_states for *_, n_states in self.observations() if n_states]
        return _several(several) if several else "a number that the plugin defines of"

    def sizes(self) -> str:
        """Return the ranges and the numbers of cells of all worlds."""
        ranges = list(dict.fromkeys(tuple(one["ranges"]) for one in self.places))
        cells = [x * y + y * z + z * x - x - y - z + 1 for x, y, z in ranges]
        low, high = min(cells), max(cells)
        return f"{_several(ranges)}, which is {low if low == high else f'{low} to {high}'}"

    def learner_labels(self) -> list[str]:
        """Return the names of learners as readers know them."""
        return [learners.label(one) for one in self.values("training.learner") if one]

    def _given_of_worlds(self) -> dict[str, list[Any]]:
        given = flat({"world": self.sweep.get("world", {})}) if self.sweep else self.options
        found: dict[str, list[Any]] = {}
        tried = {name: self.values(name) for name in self.searched}
        for table in (given, *(self.settings.get("vary") or ()), tried):
            for name, value in table.items():
                if name == "world" or name.startswith("world."):
                    own = found.setdefault("preset" if name == "world" else name[6:], [])
                    several = value if table is tried else [value]
                    own += [one for one in several if one not in own]
        return found

    def world_settings(self) -> dict[str, list[Any]]:
        """Return the values of the settings of worlds, by their names without "world."."""
        return {name: one for name, one in self._given_of_worlds().items() if name != "preset"}

    def _presets(self) -> list[str]:
        if kinds := self.settings.get("world_kinds"):
            return [name for name, own in _PRESETS.items() if own & {*kinds}]
        return self._given_of_worlds().get("preset", ["paper"])

    def worlds(self) -> list[tuple[str, str]]:
        """Return the names of worlds with their texts, those of the package first."""
        unknown = "a text map or a world of the plugin, in the inputs of the results"
        several = [(name, RULES["worlds"].get(name, unknown)) for name in self._presets()]
        return sorted(several, key=lambda one: one[0] not in RULES["worlds"])

    def worlds_are_drawn(self) -> bool:
        """Return whether worlds are drawn from a seed."""
        return "world_kinds" in self.settings or any(
            one in ("open", "far_piles") for one in self._presets()
        )

    def seeds_in_words(self) -> str:
        """Return the seeds, as a range if they follow each other."""
        first, n = self.seeds[0], len(self.seeds)
        if n > 2 and list(self.seeds) == list(range(first, first + n)):
            return f"{first} to {self.seeds[-1]}"
        return ", ".join(map(str, self.seeds))

    def events(self) -> list[str]:
        """Return a text for each event with interventions; its settings can vary over points."""
        found: dict[tuple[str, int], list[dict[str, Any]]] = {}
        for events in self.values("protocol"):
            numbers: Counter[str] = Counter()
            for kind, facts in (item for event in events or () for item in event.items()):
                numbers[kind] += 1
                found.setdefault((kind, numbers[kind]), []).append(flat(facts))
        lines = []
        for (kind, number), variants in found.items():
            own = f"{kind}.{number}."
            tried = {k.removeprefix(own): v for k, v in self.searched.items() if k.startswith(own)}
            lines.append(f"*{kind}*: {_varied(kind, variants, tried)}")
        return lines

    def traffic(self) -> dict[str, str]:
        """Return the texts of the rules of traffic that a point has, by name."""
        return {
            n: one for n, one in RULES["traffic"].items() if self.has(f"task.traffic.{n}", True)
        }

    def has_usual_traffic(self) -> bool:
        """Return whether ants cannot enter the cells of others in some of the points."""
        used = self.traffic()
        return not {"swap", "follow"} <= {*used} or any(
            self.has(f"task.traffic.{one}", False) for one in used
        )

    def differences_of(self, caste: str) -> str:
        """Return the settings of a caste that differ from those of all ants."""
        own = [one for one in self.settings if one.startswith(f"task.castes.{caste}.")]
        given = [one for one in own if self.has(one) and not self.has(one, "none", "all")]
        return "; ".join(f"{one.split('.', 3)[3]} {self.text(one)}" for one in given)

    def changed(self) -> Iterator[tuple[str, str, str, str]]:
        """Yield the settings that differ from their defaults: values, default and meaning."""
        known = self._declarations()
        kind = ColonyPoint if self.of_colony else RunPoint
        of_points = {one.name: one.default for one in fields(kind) if one.name in _OF_POINTS}
        for name in self.settings:
            # Entries of named groups share declarations, which have NAME in place of the entry.
            one = known.get(re.sub(r"^(task\.(?:fields|foods|castes))\.\w+\.", r"\1.NAME.", name))
            values = self.values(name)
            if name == "protocol" and any(values):
                values = [count(len(self.events()), "event")]
            usual = one.default if one else of_points.get(name, MISSING)
            is_setting = one or name in of_points or name.split(".")[0] in ("task", "training")
            if not is_setting or all(value == usual for value in values):
                continue
            if one and values == [None] and usual is MISSING:
                continue
            default = "required" if usual is MISSING else _value(usual)
            unit = f" ({one.rule.unit})" if one and one.rule.unit else ""
            words = f"{one.rule.help}{unit}" if one else _OF_POINTS.get(name, "of the plugin")
            yield f"`{name}`", _several(values), default, sentence(words)
        of_worlds = [one for kind in WORLDS for one in worlds.settings_of(kind)]
        for name, found in self._given_of_worlds().items():
            if (name, found) != ("preset", ["paper"]):
                words = next(
                    (one.rule.help for one in of_worlds if one.name == name),
                    "world, or a setting of it",
                )
                yield f"`world.{name}`", _several(found), "that of the world", sentence(words)

    def _declarations(self) -> dict[str, Setting]:
        """Return the declarations of settings by their full names, of named groups with NAME."""
        several = [
            one
            for group in (Task, *(each.entry for each in named_groups(Task)))
            for one in all_of(group)
            if not one.is_group
        ]
        found = {one.path: one for one in (*several, *declared(TrainingConfig))}
        for name in self.values("training.learner"):
            if name in LEARNERS:
                for one in declared(learners.get(name).hyperparameters):
                    found[f"training.hyperparameters.{one.name}"] = one
        return found


def _tried(usual: Any, axis: Any) -> list[Any]:
    """Return the values of a setting in a search: the default, and choices or a range in words."""
    if isinstance(axis, Mapping):
        low, high = axis["from"], axis["to"]
        is_within = isinstance(usual, (int, float)) and low <= usual <= high
        return [f"{low} to {high}", *([] if is_within or usual is None else [usual])]
    return [*([] if usual is None or usual in axis else [usual]), *axis]


def odd_of(folder: Path, manifest: Mapping[str, Any]) -> str:
    """Return the ODD description of finished results, as Markdown."""
    asked = manifest["asked"]
    name = manifest["inputs"].get(str(asked["options"].get("file")))
    sweep = files.tomllib.loads(files.read_text(folder / name)) if name else {}
    return described(Model(manifest["settings"], asked, sweep), manifest["command"])


def described(model: Model, command: str) -> str:
    """Return the ODD description of a model, as Markdown."""
    from jinja2 import Environment, StrictUndefined

    how = Environment(
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, undefined=StrictUndefined
    )
    how.filters["joined"] = _joined
    facts = {"learns": model.learns, "lives": model.lives, "diffuses": model.diffuses}
    groups = {name: model.entries(name) for name in ("fields", "foods", "castes")}
    functions = (model.has, model.text, model.values, model.choices, count)
    return how.from_string(text_of("odd.md")).render(
        command=command,
        model=model,
        settings=model.settings,
        colony=model.of_colony,
        most=_MOST,
        texts=RULES,
        several=_several,
        quoted=_quoted,
        listed=_listed,
        **facts,
        **groups,
        **{one.__name__: one for one in functions},
    )


def _joined(text: str) -> str:
    """Return paragraphs as single lines; items of lists and rows of tables keep their lines."""
    blocks = [block.strip("\n") for block in re.split(r"\n\s*\n", text)]
    return "\n\n".join(re.sub(r"\n(?!- |\| |\d+\. )", " ", one) for one in blocks if one) + "\n"


def _varied(kind: str, variants: Sequence[Mapping[str, Any]], searched: Mapping[str, Any]) -> str:
    """Return the settings of an event with their values in all variants, or those in a search."""
    found = []
    for name in dict.fromkeys([*(name for facts in variants for name in facts), *searched]):
        group, _, own = name.rpartition(".")
        of = declared(INTERVENTIONS[group] if group in INTERVENTIONS else EVENTS[kind])
        usual = next((one.default for one in of if one.name == own), None)  # if it is left out
        values: list[Any] = _tried(usual, searched[name]) if name in searched else []
        for facts in variants if name not in searched else ():
            value = facts.get(name, usual)
            values += [value] if value not in values else []
        found.append(f"{name} {_several(values)}")
    return "; ".join(found)


def _list_of(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _quoted(names: Iterable[Any]) -> list[str]:
    return [f"`{one}`" for one in names]


def _listed(names: Sequence[str]) -> str:
    """Return names as "a, b and c"."""
    *others, last = names or [""]
    return f"{', '.join(others)} and {last}" if others else last


def _several(values: Sequence[Any], unit: str = "") -> str:
    """Return values as "a", "a, b or c", or as their range if they are many numbers."""
    ending = f" {unit}" if unit and any(value is not None for value in values) else ""
    numbers = [one for one in values if isinstance(one, (int, float)) and not isinstance(one, bool)]
    if len(values) > _MOST and len(numbers) == len(values):
        return f"{len(values)} values from {_value(min(numbers))} to {_value(max(numbers))}{ending}"
    *others, last = (_value(one) for one in values)
    return (f"{', '.join(others)} or {last}" if others else last) + ending


def _value(value: Any) -> str:
    if value is None or value == ():
        return "off" if value is None else "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.15g}"
    if isinstance(value, list) and all(isinstance(one, str) for one in value):
        return ", ".join(value)
    return str(value).replace("|", "\\|") if not isinstance(value, (list, dict)) else f"`{value}`"
