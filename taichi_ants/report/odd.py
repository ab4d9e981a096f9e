"""ODD descriptions (Overview, Design concepts, Details) of the model of a study.

They have the headings of the protocol (Grimm et al. 2020), and tables of what the manifest of
results and the declarations of settings say. The author writes the text. No code of plugins runs.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from taichi_ants import files, learners, rules
from taichi_ants.analysis.tables import Table
from taichi_ants.errors import AntsError
from taichi_ants.features import FEATURES
from taichi_ants.features.choice import WITHOUT_VALUES
from taichi_ants.features.feature import Feature
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures import finished
from taichi_ants.settings import DeclaredSetting, Named, Settings, all_of, declared, flat
from taichi_ants.studies.folder import asked_in
from taichi_ants.studies.sweep_file import KINDS, declaration_of
from taichi_ants.task import Task, observations

Row = tuple[str, ...]

_MOST = 6  # values of a setting in a cell, and worlds in the table
_OF_POINTS = {  # settings of points: unit and meaning
    "world.preset": ("", "name of the world, or its map"),
    "world.seed": ("", "seed from which the world is drawn"),
    "world.per_seed": ("", "whether each seed has a world of its own"),
    "world_kinds": ("", "kinds of world of the study of colonies"),
    "policy.name": ("", "policy that ants follow"),
    "policy.sha256": ("", "checksum of its action values"),
}
_OF_POINTS |= {s.name: (s.rule.unit, s.rule.help) for of in KINDS.values() for s in declared(of)}
# Groups of settings that have no effect on a lone ant, whose episode ends at its delivery.
_OF_COLONIES = ("task.traffic", "task.life", "task.labour", "task.reward", "task.turns_at_queen")
_OF_LEARNING = re.compile(
    r"training\..*|sharing|task\.(delivery|evaporation_in_training)"
    r"|task\.castes\.\w+\.(learning_rate|discount)"
)
_EVENT = re.compile(r"`?((at|every|when)\.\d+\.)")


class Model:
    """The settings of a study, over all of its points.

    Args:
        settings: The `settings` of a manifest.
        sweep: The contents of the sweep file; empty if there is none.
    """

    def __init__(self, settings: Mapping[str, Any], sweep: Mapping[str, Any]) -> None:
        self.settings, self.sweep, self.of_colony = settings, sweep, "ants" in settings
        self.rows = list(self._points())
        self.places = [world for entry in settings["worlds"] for world in _list_of(entry)]
        self.world = flat({"world": sweep.get("world", {})})

    def _points(self) -> Iterator[dict[str, Any]]:
        """Yield the settings of each point, with those of its events and of its evaluation."""
        values = {
            name: value
            for name, value in self.settings.items()
            if name.startswith(("task.", "training.")) or name in (*_OF_POINTS, "protocol")
        }
        varies = {name for name, value in values.items() if isinstance(value, list)}
        if all(isinstance(event, dict) for event in values.get("protocol") or ()):
            varies -= {"protocol"}
        for n in range(max([1, *(len(values[name]) for name in varies)])):
            row = {name: value[n] if name in varies else value for name, value in values.items()}
            kinds = [kind for event in row.get("protocol") or () for kind in event]
            for number, event in enumerate(row.pop("protocol", None) or ()):
                ((kind, facts),) = event.items()
                row |= flat(facts, f"{kind}.{kinds[: number + 1].count(kind)}")
            if self.of_colony and row.get("evaluation_epsilon") is None:
                least = min(row["training.epsilon"], row["training.min_epsilon"])
                row["evaluation_epsilon"] = 0.0 if row.get("policy.name") else least
            yield row

    def declaration(self, name: str, row: Mapping[str, Any]) -> DeclaredSetting | None:
        """Return the declaration of a setting; None for settings of points and of plugins."""
        *group, own = name.split(".")
        if group != ["training", "hyperparameters"]:
            return declaration_of(name, self.world)
        learner = row["training.learner"]
        known = learner in learners.names() and declared(learners.get(learner).hyperparameters)
        return next((setting for setting in known or () if setting.name == own), None)

    def uses(self, row: Mapping[str, Any], name: str, setting: DeclaredSetting | None) -> bool:
        """Return whether a setting has an effect at a point, as far as declarations tell."""
        group, _, own = name.rpartition(".")
        if _EVENT.match(name):
            return True
        if group == "training.hyperparameters" and row[name] is None:
            return False
        if _OF_LEARNING.fullmatch(name) and not row["episodes"]:
            return False
        if not self.of_colony and name.startswith(_OF_COLONIES):
            return name.startswith("task.rewards.")
        if own == "view":  # of a pheromone that is a cue
            field = "trail" if group == "task.pheromone" else group.split(".")[-1]
            return any(value == field for other, value in row.items() if other.endswith("_cue"))
        if name in ("task.rewards.pick_up", "task.rewards.deliver"):  # kinds of food have their own
            return not any(other.startswith("task.foods.") for other in row)
        if own == "distribution" and row["task.labour.rule"] == "none":
            return False
        if name == "evaluation_epsilon":
            return row["task.choice.rule"] not in WITHOUT_VALUES
        if setting is None or setting.rule.only is None:
            return True
        other, *needed = setting.rule.only
        return row.get(f"{group}.{other}") in needed

    def uses_feature(self, feature: Feature) -> bool:
        """Return whether a point uses a feature: a setting of its group differs from the default.

        If the feature has a switch, it is that setting, of the group or of a caste.
        """
        path = re.escape(f"task.{feature.group}.")
        if feature.switch:
            path = rf"({path}|task\.castes\.\w+\.){feature.switch}$"
        for row in self.rows:
            for name in filter(re.compile(path).match, row):
                setting = self.declaration(name, row)
                if setting is None or row[name] != setting.default:
                    return True
        return False

    def parameters(self) -> list[Row]:
        """Return the names, values, units and meanings of all settings that have an effect."""
        vary = self.settings.get("vary") or [{"world_kinds": self.settings.get("world_kinds")}]
        varied = [{k: v for k, v in row.items() if k.startswith("world")} for row in vary]
        rows = [self.world, *varied, *self.rows]
        table: list[Row] = []
        for name in dict.fromkeys(name for row in rows for name in row):
            event = _EVENT.match(name)
            some = [
                row
                for row in rows
                if name in row or (event and any(other.startswith(event[1]) for other in row))
            ]
            setting = self.declaration(name, some[0])
            default = setting.default if setting else None  # facts of events leave out defaults
            values = [row.get(name, default) for row in some if self.uses(row, name, setting)]
            if any(value is not None for value in values):
                unit, words = _OF_POINTS.get(name, ("", "of a plugin"))
                unit, words = (setting.rule.unit, setting.rule.help) if setting else (unit, words)
                table.append((f"`{name}`", _several(values), unit, words))
        return table

    def groups(self) -> Iterator[tuple[str, type[Settings], str]]:
        """Yield the groups of settings of the task: path, class, and title."""
        yield "task", Task, "Task"
        for group in all_of(Task):
            if group.is_group:
                yield group.path, group.kind, group.name.replace("_", " ").capitalize()
            elif group.kind is Named:
                for entry in self.entries(group.name):
                    title = f"{group.entry.__name__} `{entry}`"
                    yield f"{group.path}.{entry}", group.entry, title

    def sentences(self, path: str, cls: type[Settings]) -> Iterator[str]:
        """Yield the sentences that hold for the settings of a group, at some of the points."""
        defaults = {setting.path: setting.default for setting in all_of(cls)}
        for key, sentence in cls.sentences.items():
            name, _, wanted = key.partition("=")
            values = self.values(f"{path}.{name}") if name else [True]
            default = defaults.get(f"{cls.path}.{name}")
            said = [v for v in values if (in_words(v) == wanted if wanted else v != default)]
            if not wanted:  # unless the value has its own sentence
                said = [v for v in said if f"{name}={in_words(v)}" not in cls.sentences]
            for other in re.findall(r"\{([\w.]+)\}", sentence):
                shown = said if other == name else self.values(f"{path}.{other}")
                shown = [value for value in shown if value is not None] or [None]
                sentence = sentence.replace(f"{{{other}}}", _several(shown))
            if said:
                everywhere = len(said) == len(values)
                yield sentence if everywhere else f"In some of the points: {sentence}"

    def values(self, name: str) -> list[Any]:
        """Return the values of a setting at the points in which it has an effect."""
        rows = [row for row in self.rows if name in row]
        return [row[name] for row in rows if self.uses(row, name, self.declaration(name, row))]

    def submodels(self) -> Iterator[str]:
        """Yield a paragraph on each group of settings, and on each rule that is a function."""
        for path, cls, title in self.groups():
            is_used = self.of_colony or not path.startswith(_OF_COLONIES)
            if path == "task.rewards":
                is_used = any(row["episodes"] for row in self.rows)
            if said := list(self.sentences(path, cls)) if is_used else []:
                yield f"*{title}.* {' '.join(said)}"
        for name in self.entries("rules"):
            is_known = name in rules.names()
            words = inspect.getdoc(rules.get(name).function) if is_known else None
            yield f"*Rule `{name}`.* {words or 'See the plugin.'}"

    def learning(self) -> str:
        """Return what is said about learning."""
        rows = [row for row in self.rows if row["episodes"] and "training.learner" in row]
        if not rows:
            policies = dict.fromkeys(filter(None, (row.get("policy.name") for row in self.rows)))
            follows = f" They follow the policy {_several(policies)}." if policies else ""
            return f"Ants do not learn.{follows}"
        known = {row["training.learner"]: None for row in rows}
        by = [f"`{n}` ({learners.get(n).summary})" for n in known if n in learners.names()]
        learner = f"The learner is {' or '.join(by or map('`{}`'.format, known))}."
        return " ".join([*self.sentences("training", TrainingConfig), learner])

    def sensing(self) -> str:
        """Return what is said about observations."""
        known = dict.fromkeys(row["task.observation"] for row in self.rows)
        summaries = [(n, observations.get(n).summary) for n in known if n in observations.names()]
        return " ".join(f"Observation `{name}`: {summary}." for name, summary in summaries)

    def entries(self, group: str) -> list[str]:
        """Return the names of the entries of a named group of the task, such as its fields."""
        parts = [name.split(".") for name in self.rows[0]]
        return list(dict.fromkeys(part[2] for part in parts if part[:2] == ["task", group]))

    def entities(self) -> list[Row]:
        """Return the kinds of entities with their numbers in a world."""
        ranges = (world["ranges"] for world in self.places)
        cells = {x * y + y * z + z * x - x - y - z + 1 for x, y, z in ranges}
        named = {
            "castes of ants": self.entries("castes"),
            "kinds of food": self.entries("foods"),
            "further pheromones": self.entries("fields"),
        }
        return [
            ("cells", _several(sorted(cells))),
            ("nests, each with a queen", _several(sorted({*map(_nests, self.places)}))),
            ("ants at the start", _several([row.get("ants", 1) for row in self.rows])),
            *((words, f"{len(n)}: {', '.join(n)}") for words, n in named.items() if n),
        ]

    def schedule(self) -> str:
        """Return the steps of a tick, in order, without those that the study never takes."""

        def has(pattern: str, *never: Any) -> bool:
            names = {name for row in self.rows for name in row if re.search(pattern, name)}
            return any(row.get(name, None) not in never for row in self.rows for name in names)

        steps = {
            "Ants choose actions": True,
            "of the ants that want one cell or food item, one wins": self.of_colony,
            "ants act, get their rewards, and deposit": True,
            "pheromones evaporate and spread": has(r"\.evaporation$", "none", None),
            "ants are born and die": has(r"\.(births|lifespan)$", None, False),
            "food grows back, and piles move": has(r"\.(regrowth|pile_move_interval)$", None),
            "ants observe": True,
            "ants learn": any(row["episodes"] for row in self.rows),
        }
        listed = "; ".join(step for step, is_there in steps.items() if is_there)
        return f"{listed}. All ants finish a step before the next one begins."

    def state_variables(self) -> list[Row]:
        """Return the state variables: entity, name, values and unit."""
        names = {row["task.observation"] for row in self.rows} & {*observations.names()}
        states = sorted(observations.get(name).n_states for name in names)
        number, castes = "at least 0", self.entries("castes")
        rows = {
            ("cell", "content", "empty, rock, food, queen", ""): True,
            **{
                ("cell", f"level of `{field}`", number, "level"): True
                for field in ("trail", *self.entries("fields"))
            },
            ("nest", "food received", number, "items"): True,
            ("ant", "cell", "", ""): True,
            ("ant", "heading", "0 to 5, clockwise; 0 is up", "60 degrees"): True,
            ("ant", "has food", "yes, no", ""): True,
            ("ant", "observation", f"one of {_several(states)} states", ""): states,
            ("ant", "caste", ", ".join(castes), ""): castes,
            **{
                (array.per, array.words, array.values, array.unit): self.uses_feature(feature)
                for feature in FEATURES
                for array in feature.arrays
                if array.words
            },
            ("ant", "time since its load changed", number, "ticks"): any(
                self.values(name) for name in self.rows[0] if name.endswith(".slope")
            ),
            ("learner", "action values Q(s, a)", "", "reward"): self.values("training.learner"),
        }
        return [row for row, is_used in rows.items() if is_used]

    def measures(self) -> Iterator[Row]:
        """Yield the names and meanings of the measures."""
        kind = "colony" if self.of_colony else "runs"
        for name in _list_of(self.settings.get("measures", [*finished.FINISHED[kind]])):
            try:
                words = finished.of_runs(kind, name).label
            except AntsError:
                words = "of a plugin"
            yield f"`{name}`", words


def odd_of(folder: Path, manifest: Mapping[str, Any]) -> str:
    """Return the ODD description of finished results, as Markdown."""
    asked = asked_in(folder)
    name = asked["inputs"].get(str(asked["options"].get("file")))
    sweep = files.tomllib.loads(files.read_text(folder / name)) if name else {}
    return described(Model(asked["settings"], sweep), manifest["command"])


def described(model: Model, command: str) -> str:
    """Return the ODD description of the model of a study, which a command has run."""
    rows, heads = model.parameters(), ("Parameter", "Value", "Unit", "Meaning")
    sizes = ("ranges", "foods", "obstacles", "trails", "ants")
    worlds = [
        (*(str(world[size]) for size in sizes), str(_nests(world)), f"`{world['sha256'][:16]}`")
        for world in model.places[:_MOST]
    ]
    of_worlds = ("Ranges", "Food items", "Rock", "Trail cells", "Listed ants", "Nests", "SHA-256")
    variables = ("Entity", "State variable", "Values", "Unit")
    parts = {
        "command": command,
        "entities": _table(("Entity", "Number in a world"), model.entities()),
        "schedule": model.schedule(),
        "state_variables": _table(variables, model.state_variables()),
        "learning": model.learning(),
        "sensing": model.sensing(),
        "submodels": "\n\n".join(model.submodels()),
        "seeds": ", ".join(map(str, model.settings["seeds"])),
        "measures": _table(("Measure", "Meaning"), model.measures()),
        "worlds": _table(of_worlds, worlds),
        "number": len(model.places),
        "events": _table(("Event", *heads[1:]), [row for row in rows if _EVENT.match(row[0])])
        or "Nothing from outside changes the model while it runs.",
        "parameters": _table(heads, [row for row in rows if not _EVENT.match(row[0])]),
    }
    text = resources.files(__package__).joinpath("odd.md").read_text("utf-8").format(**parts)
    return re.sub("\n{3,}", "\n\n", text).rstrip() + "\n"


def _table(heads: Row, rows: Iterable[Row]) -> str:
    """Return a table as Markdown, "" without rows."""
    cells = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    return Table("", heads, cells, text_columns=len(heads)).markdown().rstrip()


def _nests(world: Mapping[str, Any]) -> int:
    return len(world.get("queens", "Q"))


def _list_of(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _several(values: Iterable[Any]) -> str:
    """Return values, each once, or their range if they are many numbers."""
    values = list({in_words(value): value for value in values}.values())
    if len(values) > _MOST and all(type(value) in (int, float) for value in values):
        return f"{len(values)} values from {in_words(min(values))} to {in_words(max(values))}"
    return ", ".join(map(in_words, values))


def in_words(value: Any) -> str:
    """Return the value of a setting as text."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "off" if value is None else f"{value:.15g}" if type(value) is float else str(value)
