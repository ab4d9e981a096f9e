"""The published models of `experiments/`, in plain Python, written directly from their rules.

They are the double bridge of Goss, Aron, Deneubourg and Pasteels, Naturwissenschaften 76 (1989);
ant colony optimisation; and ants that back up utilities. Each model simulates one colony.
"""

from dataclasses import dataclass

from taichi_ants.grid.constants import N_HEADINGS, STREAM_BRIDGE, STREAM_FORAGER, STREAM_TOUR
from taichi_ants.reference.geometry import Cell, existing_cells, listed_cells, neighbour
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.worlds.world import World

NEST, FOOD = 0, 1
Arc = tuple[Cell, int]  # a cell and the heading of the step from it
P_BEST = 0.05


def bridge_choices(
    short: int,
    long: int,
    seed: int,
    colony: int,
    ants: int,
    k: float = 20.0,
    n: int = 2,
    opens: int = 0,
) -> list[bool]:
    """Return whether each ant takes the short branch; ants choose in turn at nest and food.

    `short` and `long` are the steps to cross a branch; `k` and `n` are the offset and exponent of
    the choice function. The short branch opens after `opens` ants.
    """
    stream = RandomStream(stream_state(seed, STREAM_BRIDGE, colony))
    marks = {(end, takes_short): 0 for end in (NEST, FOOD) for takes_short in (True, False)}
    arrivals: dict[int, list[tuple[int, bool]]] = {}  # by step: end, and whether by the short one
    taken: list[bool] = []
    for step in range(ants // 2):
        for arrived in arrivals.pop(step, []):
            marks[arrived] += 1
        words = stream.draw()
        for end, other in ((NEST, FOOD), (FOOD, NEST)):
            attraction = dict.fromkeys((True, False), 1.0)
            for branch in attraction:
                for _ in range(n):
                    attraction[branch] *= k + marks[end, branch]
            takes_short = words[end] / 2**32 * sum(attraction.values()) < attraction[True]
            if len(taken) < opens:
                takes_short = False
            marks[end, takes_short] += 1
            arrivals.setdefault(step + (short if takes_short else long), []).append(
                (other, takes_short)
            )
            taken.append(takes_short)
    return taken


def tours(
    world: World,
    max_min: bool,
    seed: int,
    colony: int,
    iterations: int,
    ants: int,
    evaporation: float,
    alpha: int = 1,
    max_steps: int = 100_000,
) -> list[list[list[Arc]]]:
    """Return the tours of all ants in each iteration; empty for an ant that gave up."""
    foods = set(listed_cells(world.foods))
    cells = set(existing_cells(world.ranges)) - set(listed_cells(world.obstacles))
    arcs = [(c, h) for c in cells for h in range(N_HEADINGS) if neighbour(c, h) in cells]
    tau = dict.fromkeys(arcs, 1.0)
    numbers = [colony * 2**32 + ant for ant in range(ants)]
    streams = [RandomStream(stream_state(seed, STREAM_TOUR, number)) for number in numbers]
    ways = max(2.0, len(arcs) / len(cells) - 1)
    best = 0
    done = []
    for _ in range(iterations):
        found = [_tour(world.queen, foods, tau, alpha, max_steps, one) for one in streams]
        done.append(found)
        arrived = [tour for tour in found if tour]
        if not arrived and not best:
            continue
        shortest = min(arrived, key=len, default=[])
        is_first = not best
        best = min(length for length in (best, len(shortest)) if length)
        highest = 1 / (evaporation * best)
        right = P_BEST ** (1 / best)
        lowest = min(highest * (1 - right) / ((ways - 1) * right), highest)
        if is_first:
            tau = dict.fromkeys(arcs, highest if max_min else ants / best)
        for arc in arcs:
            tau[arc] *= 1 - evaporation
        for tour in ([shortest] if shortest else []) if max_min else arrived:
            for arc in tour:
                tau[arc] += 1 / len(tour)
        if max_min:
            tau = {arc: min(max(level, lowest), highest) for arc, level in tau.items()}
    return done


def _tour(
    queen: Cell,
    foods: set[Cell],
    tau: dict[Arc, float],
    alpha: int,
    max_steps: int,
    stream: RandomStream,
) -> list[Arc]:
    """Return a walk to food without its loops; empty if it takes more than `max_steps`."""
    cell, back = queen, -1
    tour: list[Arc] = []
    for _ in range(max_steps):
        open_headings = [h for h in range(N_HEADINGS) if (cell, h) in tau]
        onward = [h for h in open_headings if h != back]
        weights = []
        for heading in onward:
            weight = 1.0
            for _ in range(alpha):
                weight *= tau[cell, heading]
            weights.append(weight)
        if sum(weights) == 0:
            onward = onward or open_headings
            weights = [1.0] * len(onward)
        left = stream.draw()[0] / 2**32 * sum(weights)
        options = [(h, weight) for h, weight in zip(onward, weights, strict=True) if weight > 0]
        for heading, weight in options:
            chosen = heading
            left -= weight
            if left < 0:
                break
        tour.append((cell, chosen))
        cell, back = neighbour(cell, chosen), (chosen + 3) % N_HEADINGS
        been = [k for k, (earlier, _) in enumerate(tour) if earlier == cell]
        if been:
            tour = tour[: been[0]]
        if cell in foods:
            return tour
    return []


@dataclass
class _Ant:
    cell: Cell
    heading: int
    stream: RandomStream
    carries: bool = False


class UtilityColony:
    """A colony that backs up utilities.

    `utilities` has a dictionary by open cell for each of the goals "nest" and "food".
    `deliveries` are the food items delivered in each tick so far.
    """

    def __init__(
        self,
        world: World,
        seed: int,
        colony: int,
        ants: int,
        capacity: int,
        discount: float,
        evaporation: float,
        exploration: float,
        momentum: float,
    ) -> None:
        cells = set(existing_cells(world.ranges)) - set(listed_cells(world.obstacles))
        self._nest = world.queen
        self._goals = {"nest": {world.queen}, "food": set(listed_cells(world.foods))}
        self._capacity, self._discount, self._evaporation = capacity, discount, evaporation
        self._exploration, self._momentum = exploration, momentum
        self._ants = [
            _Ant(
                world.queen,
                number % N_HEADINGS,
                RandomStream(stream_state(seed, STREAM_FORAGER, colony * 2**32 + number)),
            )
            for number in range(ants)
        ]
        self.utilities = {goal: dict.fromkeys(cells, 0.0) for goal in self._goals}
        self.deliveries: list[int] = []

    def tick(self) -> None:
        """Let every ant back up and take a step, then let utilities evaporate."""
        self.deliveries.append(sum(self._step(ant) for ant in self._ants))
        for levels in self.utilities.values():
            for cell in levels:
                levels[cell] *= 1 - self._evaporation

    def _step(self, ant: _Ant) -> bool:
        """Move an ant; return whether it delivers."""
        origin, goal = ("food", "nest") if ant.carries else ("nest", "food")
        levels = self.utilities[origin]
        around = [neighbour(ant.cell, heading) for heading in range(N_HEADINGS)]
        reward = 1.0 if ant.cell in self._goals[origin] else 0.0
        backed_up = reward + self._discount * max(levels.get(cell, 0.0) for cell in around)
        levels[ant.cell] = max(levels[ant.cell], backed_up)

        heading = self._heading(ant, goal)
        if heading is None:
            return False
        ant.cell, ant.heading = around[heading], heading
        if ant.cell not in self._goals[goal]:
            return False
        ant.carries = not ant.carries
        return goal == "nest"

    def _heading(self, ant: _Ant, goal: str) -> int | None:
        """Return the heading of the ant's step, None if it has to stay."""
        high, low = ant.stream.draw()
        chance = high / 2**32
        free = {}  # the utility at each heading that the ant can take
        for heading in range(N_HEADINGS):
            cell = neighbour(ant.cell, heading)
            inside = sum(other.cell == cell for other in self._ants)
            has_room = cell == self._nest or inside < self._capacity
            if cell in self.utilities[goal] and has_room:
                free[heading] = self.utilities[goal][cell]
        if not free:
            return None
        best = max(free.values())
        if best > 0 and chance < self._exploration:
            options = list(free)
        else:
            options = [heading for heading, level in free.items() if level == best]
            ahead = [h for h in options if (h - ant.heading) % N_HEADINGS in (0, 1, 5)]
            options = ahead or options
            if best == 0 and chance < self._momentum and ant.heading in options:
                options = [ant.heading]
        return options[pick(low, len(options))]

    def path_length(self) -> int:
        """Return the steps to food and back by the highest utilities; 0 if there is no such way."""
        cell, total = self._nest, 0
        for goal in ("food", "nest"):
            levels, been = self.utilities[goal], {cell}
            while True:
                options = [neighbour(cell, heading) for heading in range(N_HEADINGS)]
                cell = max(options, key=lambda one: levels.get(one, 0.0))
                total += 1
                if levels.get(cell, 0.0) == 0:
                    return 0
                if cell in self._goals[goal]:
                    break
                if cell in been:  # an endless loop
                    return 0
                been.add(cell)
        return total
