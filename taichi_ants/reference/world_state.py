"""The changing state of a world: ground, positions of ants, and trails."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell, existing_cells, listed_cells, neighbour, queens_of
from taichi_ants.rules import Parameters, Rule
from taichi_ants.rules.inputs import Vector
from taichi_ants.task import Caste, Pheromone, Task
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds.world import World

Level = int | np.integer | np.float32


def computed(rule: Rule, rules: Mapping[str, Parameters], facts: Mapping[str, Any]) -> float:
    """Return the result of your own rule from what rules of its kind can read."""
    inputs = {
        name: Vector(map(float, value)) if isinstance(value, list) else float(value)
        for name, value in ((name, facts[name]) for name in rule.inputs)
    }
    return rule.result(inputs, vars(rules[rule.name]))


class Trail:
    """The level of a pheromone in each of the cells without rock.

    With linear or no evaporation, levels are integers. With exponential evaporation or diffusion,
    they are float32, and every operation rounds.
    """

    def __init__(
        self,
        cells: Sequence[Cell],
        pheromone: Pheromone,
        levels: Mapping[Cell, Level] = MappingProxyType({}),
        rules: Mapping[str, Parameters] = MappingProxyType({}),
    ) -> None:
        self.rule, self._rules = pheromone, rules
        self._kind: type = np.float32 if pheromone.dense else int
        self._levels: dict[Cell, Any] = {cell: self._kind(levels.get(cell, 0)) for cell in cells}
        self._around = {}  # without walls: rocks and the outside
        for cell in cells if pheromone.diffusion > 0 else ():
            around = [neighbour(cell, heading) for heading in range(N_HEADINGS)]
            self._around[cell] = [there for there in around if there in self._levels]

    def level(self, cell: Cell) -> Level:
        """Return the level of a cell, 0 for a rock."""
        return self._levels.get(cell, 0)

    def lay(self, cell: Cell, level: Level | float) -> None:
        """Set the level of a cell other than a rock."""
        self._levels[cell] = self._kind(level)

    def deposit(
        self,
        cell: Cell,
        ant: Ant,
        tick: int,
        others: Mapping[str, Trail],
        inputs: Mapping[str, Any],
    ) -> None:
        """Deposit the pheromone of an ant that has had its load for `ant.carried` ticks.

        The ant has the load and the event after its action, and the paper's state before it.
        `others` are all pheromones by name, `inputs` those of features of the model for your rules.
        """
        rule, level = self.rule, self._levels[cell]
        if rule.own_deposit is not None:
            names = ("carried", "carries", "event", "paper_state", "trait")
            facts = {name: getattr(ant, name) for name in names}
            facts |= {f"level_{name}": trail.level(cell) for name, trail in others.items()}
            facts |= {"level": level, "tick": tick, **inputs}
            level = computed(rule.own_deposit, self._rules, facts)
            level = level if rule.dense else math.floor(level)
        elif rule.deposit == "set":
            level = rule.level
        elif rule.deposit == "add":
            level = min(level + rule.level, rule.cap)
        elif rule.deposit == "fading":
            level = max(level, rule.level - int(rule.slope or 0) * ant.carried)
        self.lay(cell, level)

    def tick(self, tick: int = 0) -> None:
        """Let trails evaporate, then spread, for one tick."""
        rule, evaporation = self.rule, self.rule.own_evaporation
        for cell, level in self._levels.items():
            if evaporation is not None:
                level = computed(evaporation, self._rules, {"level": level, "tick": tick})
            elif rule.evaporation == "linear":
                level = max(level - 1, 0)
            elif rule.evaporation == "exponential":
                level = level * rule.decay
                level = level if level >= 1 else 0
            self.lay(cell, level)
        shares = {cell: self._levels[cell] * rule.share for cell in self._around}
        for cell, around in self._around.items():
            outflow, inflow = shares[cell] * np.float32(len(around)), np.float32(0)
            for there in around:
                inflow = inflow + shares[there]
            # With diffusion 1 a cell loses its whole level, and rounding could leave less than 0.
            self.lay(cell, max((self._levels[cell] - outflow) + inflow, 0))


class WorldState:
    """The state of a world in an episode."""

    def __init__(self, world: World, task: Task, learns: bool = False) -> None:
        self._ranges = world.ranges
        self.queens: list[Cell] = queens_of(world)
        # The values of the features of the model by name, for each nest and cell.
        self.of_nests: list[dict[str, Any]] = [defaultdict(float) for _ in self.queens]
        self.of_cells: dict[Cell, dict[str, Any]] = defaultdict(dict)
        self.ants: dict[Cell, Ant] = {}
        # The content of each cell: EMPTY (also under ants), OBSTACLE, FOOD or QUEEN.
        self.ground: dict[Cell, int] = dict.fromkeys(existing_cells(world.ranges), EMPTY)
        self.ground |= dict.fromkeys(self.queens, QUEEN)
        self.ground |= dict.fromkeys(listed_cells(world.foods), FOOD)
        self.ground |= dict.fromkeys(listed_cells(world.obstacles), OBSTACLE)
        levels = {(x, y, z): level for x, y, z, level in world.trails.tolist()}
        self.pheromones = {"trail": Trail([*self.ground], task.pheromone, levels)}
        self.take(task, learns)

    def take(self, task: Task, learns: bool) -> None:
        """Take the numbers of a task, and present rocks; pheromones keep their levels."""
        self.cues = [  # the outbound and the homing cue of each caste
            (caste.outbound_cue or task.outbound_cue, caste.homing_cue or task.homing_cue)
            for caste in task.castes.values() or [Caste()]
        ]
        falls = task.evaporation_in_training if learns else task.evaporation_in_evaluation
        cells, levels = [c for c, held in self.ground.items() if held != OBSTACLE], self.pheromones
        self.pheromones = {
            name: Trail(
                cells,
                rule if falls else rule.lasting,
                {cell: levels[name].level(cell) for cell in cells} if name in levels else {},
                task.rules,
            )
            for name, rule in {"trail": task.pheromone, **task.fields}.items()
        }

    @property
    def trail(self) -> Trail:
        """The trail."""
        return self.pheromones["trail"]

    def cue(self, ant: Ant) -> Trail:
        """Return the pheromone that an ant follows, by default that of ants without food."""
        outbound, homing = self.cues[ant.caste]
        uses_homing = ant.carries and homing in self.pheromones
        return self.pheromones[homing if uses_homing else outbound]

    def content(self, cell: Cell) -> int:
        """Return the content of a cell: its ground, or OBSTACLE for an ant or the outside."""
        return OBSTACLE if cell in self.ants else self.ground.get(cell, OBSTACLE)

    def index(self, cell: Cell) -> int:
        """Return the index of a cell in the flat array with a border of one void cell.

        The array holds q = x - z from -Z to X and r = y - z from -Z to Y, row by row (r).
        """
        size_x, _, size_z = self._ranges
        x, y, z = cell
        width = size_x + size_z + 1
        return (y - z + size_z) * width + (x - z + size_z)
