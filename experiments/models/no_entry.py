"""Measure what a no-entry pheromone adds to the deliveries of ants on a decision tree.

Corridors fork twice, and food grows back at the end of one of four branches. All ants lay an
attractive path wherever they go, and choose the next cell by it, without learning. An ant that has
been without food for longer than its patience also lays a repellent, as Pharaoh's ants mark
unrewarding branches (Robinson et al. 2005). Both rules are in this file. See docs/models.md.
"""

from typing import Annotated

import numpy as np

from taichi_ants import Colony, Field, Pheromone, Task, World, rules
from taichi_ants.rules import power
from taichi_ants.settings import Is
from taichi_ants.studies import model_script
from taichi_ants.task import Choice, Life, Traffic

ANTS, TICKS, STEP = 16, 3000, 100
STEM, BRANCH = 2, 4  # lengths in cells
# The factor `fear` by which the choice divides; 0 is a colony that ignores the repellent.
FEARS = {"without repellent": 0.0, "with repellent": 2.0}


@rules.register("deposit", summary="mark cells after a search in vain")
def no_entry(
    level,
    carried,
    patience: Annotated[int, Is("search time", unit="ticks", least=0, most=1000)] = 60,
    amount: Annotated[float, Is("level of a mark", least=0, most=1000)] = 100.0,
):
    """Return the level of a cell after an ant without food has entered it."""
    return max(level, amount) if carried > patience else level


@rules.register("choice", summary="follow the trail, and avoid the repellent")
def wary(
    codes,
    levels,
    levels_no_entry,
    is_open,
    nearer,
    carries,
    random,
    k: Annotated[float, Is("attraction of a cell without a trail", least=0.1, most=1000)] = 20.0,
    fear: Annotated[float, Is("strength of the repellent", least=0, most=10)] = 2.0,
):
    """Return an action: the rule "deneubourg" with exponent 2, divided by the repellent."""
    sees_nearer = 0
    for i in range(3):
        if is_open[i] and nearer[i]:
            sees_nearer = 1
    total = 0
    for i in range(3):
        if is_open[i] and nearer[i] >= carries * sees_nearer:
            total += power(k + levels[i], 2) / (1 + fear * levels_no_entry[i] * (1 - carries))
    action = 0 if random < 0.5 else 2  # turn, if no cell is open
    if codes[0] == 3 or codes[1] == 3 or codes[2] == 3:
        action = 3 + carries
    elif total > 0:
        drawn = random * total
        total = 0
        action = 0
        for i in range(3):
            if is_open[i] and nearer[i] >= carries * sees_nearer:
                total += power(k + levels[i], 2) / (1 + fear * levels_no_entry[i] * (1 - carries))
                if total <= drawn:
                    action = i + 1
        action = min(action, 2)
    return action


def decision_tree() -> World:
    """Return a world of corridors, three cells wide, that fork twice; one branch has food."""
    up, left, right = np.array([1, 0, 0]), np.array([1, 0, 1]), np.array([1, 1, 0])
    queen = 2 * up
    fork = queen + STEM * up
    walked, ends = [queen + n * up for n in range(STEM + 1)], []
    for side in (left, right):
        walked += [fork + n * side for n in range(1, BRANCH + 1)]
        second = fork + BRANCH * side
        for heading in (side, up):
            walked += [second + n * heading for n in range(1, BRANCH + 1)]
            ends.append(second + BRANCH * heading)
    full = World((24, 16, 16), queen).grid
    cells = {tuple(cell) for cell in full.cells(np.flatnonzero(full.exists)).tolist()}
    near = [one + around for one in walked for around in (0 * up, up, right, right - up)]
    near += [one - around for one in walked for around in (up, right, right - up)]
    free = {tuple((cell - cell.min()).tolist()) for cell in near}
    return World(full.ranges, queen, [ends[0]], obstacles=sorted(cells - free))


def task(fear: float) -> Task:
    """Return the task of a colony."""
    path = Field("exponential", half_life=200.0, deposit="add", level=20, cap=400, laid="always")
    mark = Field("exponential", half_life=100.0, deposit="no_entry", laid="without_food")
    return Task(
        pheromone=Pheromone(deposit="none"),
        fields={"path": path, "no_entry": mark},
        outbound_cue="path",
        choice=Choice("wary"),
        rules={"wary": {"fear": fear}},
        traffic=Traffic.named()["following"],
        life=Life(regrowth=0),
        turns_at_queen=True,
    )


def deliveries_over_time(seeds: list[int], fear: float) -> np.ndarray:
    """Return the deliveries so far, every STEP ticks, (seeds, times)."""
    colony = Colony(decision_tree(), task(fear), None, seeds, ANTS, sharing="frozen")
    colony.begin_episode()
    counts = []
    for _ in range(0, TICKS, STEP):
        colony.tick(STEP)
        counts.append(colony.deliveries.copy())
    return np.transpose(counts)


def measure(seeds: list[int]) -> model_script.Results:
    """Return the deliveries over time with and without the repellent."""
    found = {name: deliveries_over_time(seeds, fear) for name, fear in FEARS.items()}
    numbers, summary = [], []
    for name, counts in found.items():
        for seed, of_seed in zip(seeds, counts.tolist(), strict=True):
            for step, n in enumerate(of_seed, start=1):
                numbers.append({"model": name, "seed": seed, "tick": step * STEP, "delivered": n})
            summary.append({"model": name, f"deliveries in {TICKS} ticks": of_seed[-1]})
    first, second = (counts[:, -1] for counts in found.values())
    column = f"deliveries in {TICKS} ticks"
    summary += [{"model": "difference", column: more} for more in (second - first).tolist()]

    def draw(axes):
        for name, counts in found.items():
            model_script.band(axes, np.arange(STEP, TICKS + 1, STEP), counts, name)
        axes.set(xlabel="tick", ylabel="food items delivered", ylim=(0, None))

    title = "Deliveries on a decision tree, with and without a no-entry pheromone"
    return model_script.Results(numbers, summary, title, draw)


if __name__ == "__main__":
    model_script.run(__file__, __doc__, measure)
