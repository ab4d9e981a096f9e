"""The changing state of a world: ground, positions of ants, and trails."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import (
    Cell,
    existing_cells,
    kinds_of_food,
    listed_cells,
    neighbour,
    queens_of,
)
from taichi_ants.task import Caste
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

if TYPE_CHECKING:
    from taichi_ants.rules import Parameters, Rule
    from taichi_ants.task import Pheromone, Task
    from taichi_ants.worlds.world import World

Level = int | np.integer | np.float32


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
        self._index = {cell: index for index, cell in enumerate(cells)}
        kind = np.float32 if pheromone.dense else np.int64
        self._levels: np.ndarray = np.array([levels.get(cell, 0) for cell in cells], kind)
        if pheromone.diffusion > 0:
            # Rocks and the outside are walls, which all have the index behind the last cell.
            wall = len(cells)
            around = [
                [self._index.get(neighbour(cell, heading), wall) for heading in range(N_HEADINGS)]
                for cell in cells
            ]
            self._around = np.array(around)
            self._n_open = np.count_nonzero(self._around != wall, axis=1).astype(np.float32)

    def level(self, cell: Cell) -> Level:
        """Return the level of a cell, 0 for a rock."""
        index = self._index.get(cell)
        return 0 if index is None else self._levels[index]

    def lay(self, cell: Cell, level: Level) -> None:
        """Set the level of a cell other than a rock."""
        self._levels[self._index[cell]] = level

    def deposit(
        self, cell: Cell, ant: Ant, tick: int, others: Mapping[str, Trail], stimulus: float
    ) -> None:
        """Deposit the pheromone of an ant that has had its load for `ant.carried` ticks.

        The ant has the load and the event after its action, and the paper's state before it.
        `others` are all pheromones by name, `stimulus` is that of the ant's nest.
        """
        index, rule, carried = self._index[cell], self.rule, ant.carried
        if rule.own_deposit is not None:
            facts: dict[str, Any] = {name: trail.level(cell) for name, trail in others.items()}
            facts = {f"level_{name}": level for name, level in facts.items()}
            for name in ("carried", "carries", "event", "paper_state", "trait", "threshold"):
                facts[name] = getattr(ant, name)
            facts |= {"tick": tick, "stimulus": stimulus}
            level = self._computed(rule.own_deposit, index, facts)
            self._levels[index] = level if rule.dense else math.floor(level)
        elif rule.deposit == "set":
            self._levels[index] = rule.level
        elif rule.deposit == "add":
            self._levels[index] = min(self._levels[index] + rule.level, rule.cap)
        elif rule.deposit == "fading":
            self._levels[index] = max(
                self._levels[index], rule.level - int(rule.slope or 0) * carried
            )

    def _computed(self, rule: Rule, index: int, facts: Mapping[str, float]) -> float:
        """Return the result of your own rule for a cell."""
        inputs = {**facts, "level": self._levels[index]}
        inputs = {name: float(inputs[name]) for name in rule.inputs}
        return rule.result(inputs, vars(self._rules[rule.name]))

    def tick(self, tick: int = 0) -> None:
        """Let trails evaporate, then spread, for one tick."""
        evaporation = self.rule.own_evaporation
        if evaporation is not None:
            indices = range(len(self._levels))
            levels = [self._computed(evaporation, index, {"tick": tick}) for index in indices]
            self._levels = np.array(levels, np.float32)
        elif self.rule.evaporation == "linear":
            self._levels = np.maximum(self._levels - 1, 0)
        elif self.rule.evaporation == "exponential":
            self._levels = self._levels * self.rule.decay
            self._levels[self._levels < 1] = 0
        if self.rule.diffusion > 0:
            self._diffuse()

    def _diffuse(self) -> None:
        shares = self._levels * self.rule.share
        outflow = shares * self._n_open  # nothing diffuses into walls
        shares_and_wall = np.append(shares, np.float32(0))
        inflow = np.zeros_like(shares)
        for heading in range(N_HEADINGS):
            inflow = inflow + shares_and_wall[self._around[:, heading]]
        # With diffusion 1 a cell loses its whole level, and rounding could leave less than 0.
        self._levels = np.maximum((self._levels - outflow) + inflow, 0)


class WorldState:
    """The state of a world in an episode.

    Attributes:
        ground: The content of each cell: EMPTY, OBSTACLE, FOOD or QUEEN; EMPTY under ants.
        kinds, loads: The kind of the food in a cell, and its loads.
        ants: The ants by their cells.
        pheromones: The trail and the further fields, by name.
        cues: The names of the outbound and the homing cue, by caste.
        foods: The kinds of food of the task; none for the usual food.
        stimuli: Those of the nests, to which idle ants respond.
    """

    def __init__(self, world: World, task: Task, learns: bool = False) -> None:
        self._ranges = world.ranges
        self.queens: list[Cell] = queens_of(world)
        self.stimuli = [0.0] * len(self.queens)
        self.ants: dict[Cell, Ant] = {}
        self.ground: dict[Cell, int] = dict.fromkeys(existing_cells(world.ranges), EMPTY)
        self.ground |= dict.fromkeys(self.queens, QUEEN)
        self.ground |= dict.fromkeys(listed_cells(world.foods), FOOD)
        self.ground |= dict.fromkeys(listed_cells(world.obstacles), OBSTACLE)
        levels = {(x, y, z): level for x, y, z, level in world.trails.tolist()}
        self.pheromones = {"trail": Trail([*self.ground], task.pheromone, levels)}
        self.take(task, learns)
        self.kinds = kinds_of_food(world)
        self.loads = {cell: self.full(kind) for cell, kind in self.kinds.items()}

    def take(self, task: Task, learns: bool) -> None:
        """Take the numbers of a task, and present rocks; pheromones keep their levels."""
        self.foods = list(task.foods.values())
        self.cues = [
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

    def has_compass(self, ant: Ant) -> bool:
        """Return whether an ant with this load looks for cells nearer to the queen."""
        return ant.carries and self.cues[ant.caste][1] == "compass"

    def cue(self, ant: Ant) -> Trail:
        """Return the pheromone that an ant follows; with a compass, that of ants without food."""
        outbound, homing = self.cues[ant.caste]
        uses_homing = ant.carries and homing != "compass"
        return self.pheromones[homing if uses_homing else outbound]

    def full(self, kind: int) -> int:
        """Return the number of loads in a full cell of a kind of food."""
        return self.foods[kind].loads if self.foods else 1

    def put_food(self, cell: Cell, kind: int, loads: int) -> None:
        """Put food on a cell."""
        self.ground[cell], self.kinds[cell], self.loads[cell] = FOOD, kind, loads

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
