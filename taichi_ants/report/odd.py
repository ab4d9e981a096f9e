"""ODD descriptions (Overview, Design concepts, Details) of the model of a study.

The protocol is that of Grimm et al. (2006, 2010, 2020). The text is generated from the manifest and
the inputs of finished results. No code of plugins runs.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from taichi_ants import files, learners, measures, worlds
from taichi_ants.analysis.colony.study import OF_STUDY
from taichi_ants.analysis.paper.measures import MEASURES as OF_RUNS
from taichi_ants.analysis.tables import sentence
from taichi_ants.errors import count
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.registry import BUILT_IN as LEARNERS
from taichi_ants.report import odd_rules as rules
from taichi_ants.settings import Setting, all_of, declared, flat, named_groups
from taichi_ants.studies.runner import ColonyPoint, RunPoint
from taichi_ants.studies.sweep import MEASURES
from taichi_ants.task import Task, observations
from taichi_ants.task.field import COMPASS, TRAIL
from taichi_ants.worlds.registry import BUILT_IN as WORLDS

_MOST = 6  # values of a setting that a sentence lists
_OWN = re.compile(r"\{(\w+)\}")  # the value of a setting in a text
_CUES = ("outbound", "homing")
_LISTS = ("measures", "protocol")  # settings whose value is a list
# Built-in worlds with the kinds of world of the colony study that are drawn from them.
_PRESETS = {
    "paper": {"paper"},
    "open": {"open", "rocks", "slow", "small", "wide", "large"},
    "far_piles": {"piles", "one_pile", "moving"},
}
_TITLE = """# ODD description of the model

This description follows the ODD protocol (Overview, Design concepts, Details) of Grimm et al.
(2006, 2010, 2020). It was generated from the settings of this study: {command}
"""
_REFERENCES = """## References

- Deneubourg, J.-L., Aron, S., Goss, S. and Pasteels, J. M. (1990). The self-organizing exploratory
  pattern of the Argentine ant. Journal of Insect Behavior 3, 159-168.
- Grimm, V. et al. (2006). A standard protocol for describing individual-based and agent-based
  models. Ecological Modelling 198, 115-126.
- Grimm, V. et al. (2010). The ODD protocol: a review and first update. Ecological Modelling 221,
  2760-2768.
- Grimm, V. et al. (2020). The ODD protocol for describing agent-based and other simulation models:
  a second update to improve clarity, replication, and structural realism. Journal of Artificial
  Societies and Social Simulation 23 (2), 7.
- Sutton, R. S. and Barto, A. G. (2018). Reinforcement Learning: An Introduction. 2nd edition, MIT
  Press.
"""


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
        self.settings, self.options, self.command = settings, asked["options"], asked["command"]
        self.sweep = sweep
        self.of_colony = "ants" in settings
        self.seeds = settings["seeds"]
        if self.of_colony:
            self.places = [one for place in settings["worlds"] for one in _listed(place)]
        else:
            self.places = settings["worlds"]

    def all(self, name: str) -> list[Any]:
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
        found = self.all(name)
        return any(one in values for one in found) if values else any(found)

    def text(self, name: str, unit: str = "") -> str:
        """Return the values of a setting in words."""
        return _several([one for one in self.all(name) if one is not None] or [None], unit)

    def choices(self, name: str, texts: Mapping[str, str], group: str) -> Iterator[str]:
        """Yield the text of each rule that a setting selects, with the values of its group."""
        values = [one for one in self.all(name) if one is not None]
        for value in values:
            unknown = f"The rule `{value}` is defined by the plugin of this study, see its source."
            words = _OWN.sub(lambda one: self.text(f"{group}{one[1]}"), texts.get(value, unknown))
            yield f'With `{name}` "{value}": {words}' if len(values) > 1 else words

    def fields(self) -> list[str]:
        """Return the names of further pheromones."""
        return self._entries("task.fields.")

    def foods(self) -> list[str]:
        """Return the names of kinds of food."""
        return self._entries("task.foods.")

    def castes(self) -> list[str]:
        """Return the names of castes of ants."""
        return self._entries("task.castes.")

    def _entries(self, group: str) -> list[str]:
        found = (one[len(group) :].split(".")[0] for one in self.settings if one.startswith(group))
        return list(dict.fromkeys(found))

    @property
    def learns(self) -> bool:
        """Whether ants learn in this study."""
        return self.has("episodes")

    def world_settings(self) -> dict[str, list[Any]]:
        """Return the values of the settings of worlds, by their names without "world."."""
        found: dict[str, list[Any]] = {}
        given = flat({"world": self.sweep.get("world", {})}) if self.sweep else self.options
        several = [given, *(self.settings.get("vary") or ())]
        for name, value in (pair for one in several for pair in one.items()):
            if name == "world" or name.startswith("world."):
                own = found.setdefault("preset" if name == "world" else name[6:], [])
                own += [value] if value not in own else []
        return found


def odd_of(folder: Path, manifest: Mapping[str, Any]) -> str:
    """Return the ODD description of finished results, as Markdown."""
    asked = manifest["asked"]
    name = manifest["inputs"].get(str(asked["options"].get("file")))
    sweep = files.tomllib.loads(files.read_text(folder / name)) if name else {}
    return described(Model(manifest["settings"], asked, sweep), manifest["command"])


def described(model: Model, command: str) -> str:
    """Return the ODD description of a model, as Markdown."""
    parts: dict[str, Callable[[Model], Iterable[str]]] = {
        "1. Purpose and patterns": _purpose,
        "2. Entities, state variables and scales": _entities,
        "3. Process overview and scheduling": _schedule,
        "4. Design concepts": _concepts,
        "5. Initialisation": _initialisation,
        "6. Input data": _input,
        "7. Submodels": _submodels,
        "8. Settings of this study": _settings,
    }
    texts = [_TITLE.format(command=f"`{command}`.")]
    for title, part in parts.items():
        texts.append("\n\n".join([f"## {title}", *filter(None, part(model))]) + "\n")
    return "\n".join([*texts, _REFERENCES])


def _purpose(model: Model) -> Iterator[str]:
    who, end = ("colonies of ants", "") if model.of_colony else ("one ant", "s")
    how = "learn{} by reinforcement to forage" if model.learns else "forage{} by a fixed rule"
    varied = _varied(model)
    verb = "affects" if len(varied) == 1 else "affect"
    yield (
        f"The model describes how {who} on a hexagonal grid {how.format(end)}, with pheromone "
        f"trails. Its purpose in this study is to measure how "
        f"{_words(varied) or 'the settings below'} {verb} the measures listed here. Each "
        f"combination of settings runs with {count(len(model.seeds), 'seed')}."
    )
    lines = [f"- `{name}`: {words}" for name, words in _measures(model).items()]
    yield "Patterns by which the model is judged:\n\n" + "\n".join(lines)


def _varied(model: Model) -> list[str]:
    """Return the names of the settings that differ between points."""
    if rows := model.settings.get("vary"):
        names = dict.fromkeys(name for row in rows for name in row)
        return [f"`{n}`" for n in names if len({str(row.get(n)) for row in rows}) > 1]
    if "world_kinds" in model.settings:
        return ["the kind of world", "the rules", "the number of ants in training"]
    names = dict.fromkeys(model.settings)
    return [f"`{name}`" for name in names if "." in name and len(model.all(name)) > 1]


def _measures(model: Model) -> dict[str, str]:
    if model.command == "compare":
        return {name: one.words for name, one in OF_RUNS.items()}
    if "measures" not in model.settings:
        return dict(OF_STUDY)
    kind = "colony" if model.of_colony else "runs"
    known = {name: one.words for name, one in MEASURES[kind].items()}
    for name in measures.names():
        one = measures.get(name)
        known.setdefault(name, f"{one.summary}{f' ({one.unit})' if one.unit else ''}")
    wanted = _listed(model.sweep.get("measures", model.settings["measures"]))
    unknown = "a measure of the plugin of this study"
    return {name: known.get(name, known.get(name.partition(".")[0], unknown)) for name in wanted}


def _entities(model: Model) -> Iterator[str]:
    yield (
        "**Cells.** The world is a grid of hexagonal cells. A cell has cube coordinates (x, y, z), "
        "equal up to adding the same number to all three. State variables of a cell:"
    )
    rows = [("content", "empty, obstacle, food, or queen", "-")]
    unit = "level; linear evaporation removes 1 per tick"
    rows.append(("trail", "level of the pheromone that ants lay", unit))
    rows += [(f"`{name}`", "level of a further pheromone", unit) for name in model.fields()]
    if model.foods():
        rows.append(("loads", "food items in the cell, and their kind", "items"))
    yield _table(("Variable", "Meaning", "Unit"), rows)
    yield f"**Ants.** {_number_of_ants(model)} State variables of an ant:"
    rows = [
        ("cell", "where the ant is", "coordinates"),
        ("heading", "one of six directions, clockwise from 0 (up)", "60 degrees"),
        ("load", "whether the ant carries a food item", "-"),
        ("state", f"what the ant sees, one of {_states(model)} states", "-"),
    ]
    if model.castes():
        rows.append(("caste", f"one of {_words(model.castes())}", "-"))
    if model.has("task.labour.rule", "thresholds"):
        rows.append(("idle", "whether the ant waits at its nest instead of foraging", "-"))
    if model.has("task.life.lifespan") or model.has("task.life.births", True):
        rows.append(("age", "time since the ant was born", "ticks"))
    if model.has("task.pheromone.deposit", "fading") or model.fields():
        rows.append(("time since its load changed", "decides the size of deposits", "ticks"))
    if model.learns:
        rows.append(("Q(s, a)", "value of each action in each state", "reward"))
    yield _table(("Variable", "Meaning", "Unit"), rows)
    nests = max(len(one.get("queens", [0])) for one in model.places)
    yield (
        f"**Queens.** {count(nests, 'queen')} per world, at fixed cells, to whom ants give food. "
        "A queen has a position and the number of food items that she received."
    )
    steps = "max_steps" if not model.of_colony else "ticks"
    yield (
        "**Scales.** Time is discrete: in a tick every ant acts once. An episode has at most "
        f"{model.text(steps, 'ticks')}. {_sizes(model)} Neither the tick nor the cell "
        "corresponds to a physical unit."
    )


def _number_of_ants(model: Model) -> str:
    if not model.of_colony:
        return "One ant lives in the world."
    return f"The number of ants at the start is {model.text('ants')}."


def _states(model: Model) -> str:
    known = observations.names()
    several = [
        observations.get(one).n_states for one in model.all("task.observation") if one in known
    ]
    return _several(several) if several else "a number that the plugin defines of"


def _sizes(model: Model) -> str:
    cells = [_cells(one["ranges"]) for one in model.places]
    ranges = [tuple(one["ranges"]) for one in model.places]
    low, high = min(cells), max(cells)
    own = f"Worlds have ranges {_several(list(dict.fromkeys(ranges)))}"
    return f"{own}, which is {low if low == high else f'{low} to {high}'} cells."


def _cells(ranges: Sequence[int]) -> int:
    x, y, z = ranges
    return x * y + y * z + z * x - x - y - z + 1


def _schedule(model: Model) -> Iterator[str]:
    yield "Each tick has these steps, in this order. All ants do a step before the next one starts."
    steps = [
        "*Choose.* Each ant chooses an action in its state (7.2).",
        "*Resolve.* Conflicts over cells and food items are decided (7.4).",
        "*Act.* Ants turn, move, pick up and give, and get rewards (7.3).",
        "*Deposit.* Ants lay pheromone (7.5).",
        f"*{_change_of_levels(model)}.* Levels of all cells change (7.5).",
    ]
    if _lives(model):
        steps.append("*Live.* Births, deaths and the regrowth of food (7.7).")
    steps.append("*Observe.* Each ant sees the cells around it, which gives its next state (7.1).")
    if model.learns:
        steps.append("*Learn.* Each ant updates its action values (7.6).")
    yield "\n".join(f"{number}. {step}" for number, step in enumerate(steps, start=1))
    if model.has("protocol"):
        yield "The events of section 6 happen between two ticks."
    end = (
        "at its first delivery or after its last tick"
        if not model.of_colony
        else ("after its last tick; deliveries do not end it")
    )
    runs = (
        f"A run has {model.text('episodes')} episodes of training"
        if model.learns
        else ("A run has no training")
    )
    yield (
        f"An episode ends {end}, and each starts from the initial state of the world. {runs} and "
        f"{model.text('rollouts')} episodes of evaluation without learning. The updates of one "
        "tick are synchronous: no result depends on the order in which ants are processed."
    )


def _change_of_levels(model: Model) -> str:
    groups = ("task.pheromone", *(f"task.fields.{name}" for name in model.fields()))
    diffuse = any(model.has(f"{group}.diffusion") for group in groups)
    return "Evaporate and diffuse" if diffuse else "Evaporate"


def _lives(model: Model) -> bool:
    found = [name for name in model.settings if name.startswith("task.life.")]
    return bool(model.foods()) or any(
        value is not None and value is not False for name in found for value in model.all(name)
    )


def _concepts(model: Model) -> Iterator[str]:
    choice = model.text("task.choice.rule")
    nests = max(len(one.get("queens", [0])) for one in model.places)
    interaction = (
        "Ants block each other, compete for cells and food (7.4), and influence each other by "
        "pheromone (7.5)."
        if model.of_colony
        else "One ant is alone; it meets only its own trail (7.5)."
    )
    learning = (
        f"Ants learn action values by {_names_of_learners(model)} during training (7.6). During "
        "the evaluation they do not learn."
        if model.learns
        else "None: ants follow a fixed rule or policy."
    )
    rewards = (
        "Ants seek a large discounted sum of rewards (7.3)."
        if model.learns
        else "Ants do not maximise anything explicitly."
    )
    concepts = {
        "Basic principles": (
            "Stigmergy: ants coordinate by marks that they leave in their environment. "
            "Reinforcement learning: ants adapt to rewards (Sutton and Barto 2018)."
            if model.learns
            else "Stigmergy: ants coordinate by marks that they leave in their environment."
        ),
        "Emergence": (
            "Trails, paths between food and queen, and the number of deliveries emerge from the "
            "actions of single ants."
        ),
        "Adaptation": (
            f"In each tick, an ant chooses one of five actions by the rule {choice} (7.2)."
        ),
        "Objectives": rewards,
        "Learning": learning,
        "Prediction": (
            "Action values predict the discounted sum of future rewards, with the discount factor "
            f"{model.text('training.discount')}."
            if model.learns
            else "None."
        ),
        "Sensing": (
            "An ant senses only the cells around it, its load, and its heading (7.1)"
            + (
                ", and the direction to its queen."
                if model.has("task.homing_cue", "compass")
                else "."
            )
            + (
                f" It misreads a cell with probability {model.text('task.noise.misread')}."
                if model.has("task.noise.misread")
                else " It senses without error."
            )
        ),
        "Interaction": interaction,
        "Stochasticity": (
            "Each ant draws from its own stream of random numbers, which its seed and its number "
            "determine: exploration, ties, and the choice among several food items"
            + (", and slips of actions" if model.has("task.noise.slip") else "")
            + ". "
            + ("The world is drawn from a seed. " if _is_drawn(model) else "")
            + "The same seed gives the same run, to the bit."
        ),
        "Collectives": _castes_in_words(model)
        + (
            f"Ants belong to {nests} nests, each with its queen."
            if nests > 1
            else "All ants form one colony."
            if model.of_colony
            else "None: there is one ant."
        ),
        "Observation": (
            "The measures of section 1 are taken in each run. Tables contain them for each seed, "
            "and means with 95 % confidence intervals over seeds (bootstrap, BCa)."
        ),
    }
    yield "\n\n".join(f"**{name}.** {words}" for name, words in concepts.items())


def _names_of_learners(model: Model) -> str:
    return _several([learners.label(one) for one in model.all("training.learner") if one])


def _is_drawn(model: Model) -> bool:
    presets = model.world_settings().get("preset", ["paper"])
    return "world_kinds" in model.settings or any(one in ("open", "far_piles") for one in presets)


def _initialisation(model: Model) -> Iterator[str]:
    given = model.world_settings()
    if "world_kinds" in model.settings:
        kinds = _several(model.settings["world_kinds"])
        yield (
            f"The study has worlds of the kinds {kinds}. Each seed has one world of each drawn "
            "kind for the evaluation, and draws a world for each training episode from 64 others."
        )
        presets = [one for one, own in _PRESETS.items() if own & {*model.settings["world_kinds"]}]
    else:
        presets = given.pop("preset", ["paper"])
    known = [f"- `{one}`: {rules.WORLDS[one]}" for one in presets if one in rules.WORLDS]
    known += [
        f"- `{one}`: a text map or a world of the plugin, in the inputs of the results"
        for one in presets
        if one not in rules.WORLDS
    ]
    yield "Worlds:\n\n" + "\n".join(known)
    named = [f"`world.{name}` is {_several(values)}" for name, values in given.items()]
    if named:
        yield f"Settings of the worlds: {'; '.join(named)}."
    columns = ("ranges", "foods", "obstacles", "trails", "sha256")
    rows = [[str(one.get(name)) for name in columns] for one in model.places[:_MOST]]
    rows = [[*row[:-1], f"`{row[-1][:16]}`"] for row in rows]
    yield _table(("Ranges", "Food items", "Obstacles", "Trail cells", "SHA-256 begins"), rows)
    if len(model.places) > _MOST:
        yield f"The table has the first {_MOST} of {len(model.places)} worlds; see the manifest."
    start = {
        "nest": "Ants that the world does not list start on the free cells nearest to the queen.",
        "spread": "Ants that the world does not list start on free cells drawn at random.",
    }
    yield " ".join(start[one] for one in model.all("start") if one in start) or (
        "The ant starts at the place that the world lists, or on a free cell next to the queen."
    )
    values = f"{model.text('training.initial_q')}" if model.learns else ""
    yield (
        "Ants carry nothing."
        + (" Further pheromones start at level 0." if model.fields() else "")
        + (f" Action values start at {values}." if values else "")
        + f" Seeds: {_seeds(model.seeds)}."
    )
    if policies := [one for one in model.all("policy.name") if one]:
        sums = [f"`{one}`" for one in model.all("policy.sha256") if one]
        yield f"Ants follow the policy {_several(policies)}, with SHA-256 {', '.join(sums)}."


def _seeds(seeds: Sequence[int]) -> str:
    if len(seeds) > 2 and list(seeds) == list(range(seeds[0], seeds[0] + len(seeds))):
        return f"{seeds[0]} to {seeds[-1]}"
    return ", ".join(map(str, seeds))


def _input(model: Model) -> Iterator[str]:
    events = [one for several in model.all("protocol") if several for one in _listed(several)]
    if not events:
        yield "The model uses no input data: nothing from outside drives it while it runs."
        return
    yield (
        f"These events change the colony in episodes of {model.text('during')}, as experiments "
        "would. Each lists when it happens, and the interventions:"
    )
    lines = []
    for event in events:
        for kind, facts in event.items():
            shown = ", ".join(f"{name} {value}" for name, value in flat(facts).items())
            lines.append(f"- *{kind}*: {shown}")
    yield "\n".join(dict.fromkeys(lines))


def _submodels(model: Model) -> Iterator[str]:
    yield "### 7.1 Observation"
    yield from _observation(model)
    yield "### 7.2 Choice of an action"
    yield from model.choices("task.choice.rule", rules.CHOICE, "task.choice.")
    if model.has("task.noise.slip"):
        yield (
            f"With probability {model.text('task.noise.slip')}, the ant executes one of the five "
            "actions, drawn uniformly, instead of the chosen one."
        )
    yield "### 7.3 Actions and rewards"
    yield from _actions(model)
    yield "### 7.4 Conflicts and traffic"
    yield from _traffic(model)
    yield "### 7.5 Pheromone"
    yield from _pheromones(model)
    if model.learns:
        yield "### 7.6 Learning"
        yield from _learning(model)
    if _lives(model):
        yield "### 7.7 Life and food"
        yield from _life(model)
    if model.castes():
        yield "### 7.8 Castes and division of labour"
        yield from _castes(model)


def _observation(model: Model) -> Iterator[str]:
    known = observations.names()
    for name in model.all("task.observation"):
        words = observations.get(name).summary if name in known else "defined by the plugin"
        yield f"Observation `{name}`: {words}."
    outbound, homing = ([f"`{one}`" for one in model.all(f"task.{cue}_cue")] for cue in _CUES)
    seen_as_t = f"T: by the levels of {_several(outbound)}, see below"
    yield _table(
        ("Code", "Ant without food", "Ant with food"),
        [
            ("0", "E: an empty cell that is not T", "E: an empty cell that is not S"),
            (
                "1",
                "O: an obstacle, an ant, a queen, or no cell",
                "O: an obstacle, an ant, food, or no cell",
            ),
            ("2", seen_as_t, _seen_as_s(homing)),
            ("3", "F: food", "Q: its queen"),
        ],
    )
    for cue in dict.fromkeys(one for name in _CUES for one in model.all(f"task.{name}_cue")):
        group = "task.pheromone." if cue == TRAIL else f"task.fields.{cue}."
        for words in model.choices(f"{group}view", rules.VIEW, group):
            yield f"By the levels of `{cue}`, a cell is T (for ants with food S) if it is: {words}."
    yield (
        "With the observation `paper`, the ant sees the three cells ahead. Its state index is "
        "`64 · load + 16 · left + 4 · forward + right`."
        if model.has("task.observation", "paper")
        else ""
    )
    if model.has("task.noise.misread"):
        yield (
            f"With probability {model.text('task.noise.misread')}, the ant sees a cell as one of "
            "the three other codes, drawn uniformly."
        )


def _seen_as_s(homing: Sequence[str]) -> str:
    """Return what ants with food see as S, by their cues."""
    nearer = "S: an empty cell nearer to the queen than the ant's own cell"
    others = [one for one in homing if one != f"`{COMPASS}`"]
    if not others:
        return nearer
    by_levels = f"by the levels of {_several(others)}, see below"
    both = f"{nearer} (with the homing cue `{COMPASS}`), or {by_levels}"
    return both if len(others) < len(homing) else f"S: {by_levels}"


def _actions(model: Model) -> Iterator[str]:
    reward = {
        one: model.text(f"task.rewards.{one}")
        for one in ("empty", "shaping", "failed", "pick_up", "deliver")
    }
    yield _table(
        ("Action", "Succeeds if", "Effect", "Reward"),
        [
            (
                "left, forward, right",
                "the cell is seen as E",
                "the ant turns and enters the cell",
                reward["empty"],
            ),
            (
                "left, forward, right",
                "the cell is seen as T or S",
                "the ant turns and enters the cell",
                reward["shaping"],
            ),
            (
                "pick up",
                "the ant has no food and sees food",
                "it carries that item and turns round",
                reward["pick_up"],
            ),
            (
                "give",
                "the ant has food and sees its queen",
                "the queen receives the item",
                reward["deliver"],
            ),
            ("any", "otherwise", "none; a blocked move still turns the ant", reward["failed"]),
        ],
    )
    for name in model.all("task.reward"):
        if name not in (None, "by_event"):
            yield f"Rewards follow the rule `{name}` of the plugin instead, see its source."
    if model.has("task.turns_at_queen", True):
        some = " in some points" if model.has("task.turns_at_queen", False) else ""
        yield f"After a delivery the ant turns round{some} (`task.turns_at_queen`)."


def _traffic(model: Model) -> Iterator[str]:
    if not model.of_colony:
        yield "There is one ant, so there are no conflicts."
        return
    yield rules.CONFLICTS
    used = [one for one in rules.TRAFFIC if model.has(f"task.traffic.{one}", True)]
    if any(not model.has(f"task.traffic.{one}", True) for one in ("swap", "follow")) or any(
        len(model.all(f"task.traffic.{one}")) > 1 for one in used
    ):
        yield rules.NO_TRAFFIC + (" Exceptions follow." if used else "")
    for one in used:
        partly = " (in some of the points)" if model.has(f"task.traffic.{one}", False) else ""
        yield f"- `{one}`{partly}: {rules.TRAFFIC[one]}"


def _pheromones(model: Model) -> Iterator[str]:
    yield "*Trail.* " + rules.LAID["with_food"]
    yield from _pheromone(model, "task.pheromone.")
    for name in model.fields():
        group = f"task.fields.{name}."
        laid = list(model.choices(f"{group}laid", rules.LAID, group))
        yield f"*Field `{name}`.* {' '.join(laid)}"
        yield from _pheromone(model, group)
    phases = {
        "task.evaporation_in_training": "training",
        "task.evaporation_in_evaluation": "the evaluation",
    }
    for name, phase in phases.items():
        if not model.learns and phase == "training":
            continue
        if model.has(name, False):
            some = " in some of the points" if model.has(name, True) else ""
            yield f"During {phase}, levels do not evaporate{some} (`{name}`)."


def _pheromone(model: Model, group: str) -> Iterator[str]:
    yield from model.choices(f"{group}deposit", rules.DEPOSIT, group)
    yield from model.choices(f"{group}evaporation", rules.EVAPORATION, group)
    if model.has(f"{group}diffusion"):
        yield rules.DIFFUSION.replace("{diffusion}", model.text(f"{group}diffusion"))


def _learning(model: Model) -> Iterator[str]:
    yield "After each step from state s by action a to state s' with reward r, a value changes by"
    yield "    Q(s, a) ← Q(s, a) + α · (target - Q(s, a))"
    targets = model.choices("training.learner", rules.LEARNERS, "training.hyperparameters.")
    lines = [f"- {_with_label(model, number)}{target}" for number, target in enumerate(targets)]
    yield "with this target:\n\n" + "\n".join(lines)
    yield (
        f"The discount factor γ is {model.text('training.discount')}. "
        f"{_decay(model, 'learning rate α', 'learning_rate')} "
        f"{_decay(model, 'exploration rate ε', 'epsilon')} The evaluation uses "
        + ("the lowest ε." if model.of_colony else "ε = 0.")
    )
    yield from model.choices("task.delivery", rules.DELIVERY, "task.")
    if model.of_colony:
        yield from model.choices("sharing", rules.SHARING, "")


def _decay(model: Model, words: str, name: str) -> str:
    """Return how a rate changes over episodes, in words."""
    first, decay = model.text(f"training.{name}"), model.text(f"training.{name}_decay")
    if model.all(f"training.{name}_decay") == [1.0]:
        return f"The {words} is {first} in all episodes."
    least = model.text(f"training.min_{name}")
    return (
        f"The {words} starts at {first}; after each episode, the factor {decay} multiplies it, but "
        f"it does not fall below {least} (or its start, if that is smaller)."
    )


def _with_label(model: Model, number: int) -> str:
    several = [one for one in model.all("training.learner") if one]
    return f"{learners.label(several[number])}: " if len(several) == 1 else ""


def _life(model: Model) -> Iterator[str]:
    if model.has("task.life.births", True):
        yield (
            "The queen turns each food item that she receives into an ant on a free cell next to "
            f"her. At most {model.text('capacity')} ants live at the same time."
        )
    if model.has("task.life.lifespan"):
        yield (
            f"An ant dies at age {model.text('task.life.lifespan', 'ticks')} and leaves its food "
            "in its cell."
        )
    if any(one is not None for one in model.all("task.life.regrowth")):
        yield (
            f"Food grows back in its cell {model.text('task.life.regrowth', 'ticks')} after it was "
            "taken, and waits while the cell is occupied. 0 means in the same tick."
        )
    if model.has("task.life.wander"):
        yield f"Each pile moves by one cell every {model.text('task.life.wander', 'ticks')}."
    for name in model.foods():
        own = f"task.foods.{name}."
        yield (
            f"Food `{name}`: a cell has {model.text(own + 'loads')} loads; the rewards are "
            f"{model.text(own + 'pick_up')} for picking up and {model.text(own + 'deliver')} for "
            f"giving. Regrowth: {model.text(own + 'regrowth', 'ticks')}."
        )


def _castes_in_words(model: Model) -> str:
    castes = model.castes()
    return (
        f"Ants belong to {count(len(castes), 'caste')}: {_words(castes)} (7.8). " if castes else ""
    )


def _castes(model: Model) -> Iterator[str]:
    for name in model.castes():
        own = [one for one in model.settings if one.startswith(f"task.castes.{name}.")]
        given = [one for one in own if model.has(one) and not model.has(one, "none", "all")]
        words = "; ".join(f"{one.split('.', 3)[3]} {model.text(one)}" for one in given)
        yield f"Caste `{name}`: {words or 'as all ants of the nest'}."
    yield from model.choices("task.labour.rule", rules.LABOUR, "task.labour.")


def _settings(model: Model) -> Iterator[str]:
    rows = list(_changed(model))
    yield (
        "The table has every setting that differs from its default or varies in this study. All "
        "other settings have the defaults of this version of Taichi Ants, "
        f"{model.settings['version']}."
    )
    yield _table(("Setting", "Values", "Default", "Meaning"), rows) if rows else "There are none."


def _changed(model: Model) -> Iterator[tuple[str, str, str, str]]:
    """Yield the settings that differ from their defaults, with values, default and meaning."""
    known = _known(model)
    for name in model.settings:
        one = known.get(_general(name))
        values = model.all(name)
        usual = one.default if one else _of_points(model).get(name, MISSING)
        is_setting = one or name in _of_points(model) or name.split(".")[0] in ("task", "training")
        if not is_setting or all(value == usual for value in values):
            continue
        if one and values == [None] and usual is MISSING:
            continue
        default = "required" if usual is MISSING else _value(usual)
        unit = f" ({one.rule.unit})" if one and one.rule.unit else ""
        words = _WORDS.get(name, "") or (f"{one.rule.help}{unit}" if one else "of the plugin")
        yield f"`{name}`", _several(values), default, sentence(words)
    for name, found in model.world_settings().items():
        if name == "preset" and found == ["paper"]:
            continue
        words = next(
            (s.rule.help for kind in WORLDS for s in worlds.settings_of(kind) if s.name == name),
            "world, or a setting of it",
        )
        yield f"`world.{name}`", _several(found), "that of the world", sentence(words)


_WORDS = {
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


def _known(model: Model) -> dict[str, Setting]:
    """Return the declarations of settings by their full names, of named groups with NAME."""
    found = {one.path: one for one in all_of(Task) if not one.is_group}
    for group in named_groups(Task):
        found |= {one.path: one for one in all_of(group.entry) if not one.is_group}
    found |= {one.path: one for one in declared(TrainingConfig)}
    for name in model.all("training.learner"):
        if name in LEARNERS:
            for one in declared(learners.get(name).hyperparameters):
                found[f"training.hyperparameters.{one.name}"] = one
    return found


def _general(name: str) -> str:
    """Return the name of a setting with NAME in place of the name of an entry."""
    return re.sub(r"^(task\.(?:fields|foods|castes))\.\w+\.", r"\1.NAME.", name)


def _of_points(model: Model) -> dict[str, Any]:
    """Return the defaults of the settings of points that belong to no group."""
    kind = ColonyPoint if model.of_colony else RunPoint
    return {one.name: one.default for one in fields(kind) if one.name in _WORDS}


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _words(several: Sequence[str]) -> str:
    *others, last = several or [""]
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
    if value is None:
        return "off"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.15g}"
    if isinstance(value, list) and all(isinstance(one, str) for one in value):
        return ", ".join(value)
    return str(value).replace("|", "\\|") if not isinstance(value, (list, dict)) else f"`{value}`"


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
