"""Measure what a no-entry pheromone adds to the deliveries of ants on a decision tree.

Corridors fork twice, and food grows back at the end of one of four branches. All ants lay an
attractive path wherever they go, and choose the next cell by it, without learning. Pharaoh's ants
also mark unrewarding branches with a repellent (Robinson et al. 2005). Here, ants mark wherever
they go after a search in vain, or only where they see three obstacles. In a control, the repellent
lies on the three branches without food from the start. See docs/models/no_entry.md.
"""

from typing import Annotated

import model_script
import numpy as np

from taichi_ants import Colony, Field, Interventions, Pheromone, Task, World, rules
from taichi_ants.interventions import SetTrail
from taichi_ants.rules import pick, power
from taichi_ants.settings import Setting
from taichi_ants.task import Choice, Life, Traffic

ANTS, TICKS, STEP = 16, 3000, 100
STEM, BRANCH = 2, 4  # lengths in cells
AMOUNT = 100
HALF_LIVES = (200.0, 50.0)  # of the path, in ticks


@rules.register("deposit")
def no_entry(
    level,
    carried,
    patience: Annotated[int, Setting("search time", unit="ticks", least=0, most=1000)] = 60,
    amount: Annotated[float, Setting("level of a mark", least=0, most=1000)] = AMOUNT,
):
    """Return the level of a cell after an ant without food has entered it."""
    return max(level, amount) if carried > patience else level


@rules.register("choice")
def wary(
    codes,
    levels,
    levels_no_entry,
    is_open,
    nearer,
    carries,
    random,
    k: Annotated[
        float, Setting("attraction of a cell without a trail", least=0.1, most=1000)
    ] = 20.0,
    fear: Annotated[float, Setting("strength of the repellent", least=0, most=10)] = 2.0,
):
    """Return an action: the rule "deneubourg" with exponent 2, divided by the repellent."""
    sees_nearer = 0
    for i in range(3):
        if is_open[i] and nearer[i]:
            sees_nearer = 1
    weights = [
        power(k + levels[i], 2) / (1 + fear * levels_no_entry[i] * (1 - carries))
        if is_open[i] and nearer[i] >= carries * sees_nearer
        else 0
        for i in range(3)
    ]
    action = pick(weights, random)
    if codes[0] == 3 or codes[1] == 3 or codes[2] == 3:
        action = 3 + carries
    elif action < 0:
        action = 0 if random < 0.5 else 2  # turn, if no cell is open
    return action


# The repellent of each model: its name, then its field.
MARKS = {
    "without repellent": Field(deposited_when="never"),
    "after a search in vain": Field(
        "exponential", half_life=100.0, deposit="no_entry", deposited_when="without_food"
    ),
    "at dead ends": Field("exponential", half_life=100.0, level=AMOUNT, deposited_when="dead_end"),
    "on wrong branches": Field("none", deposited_when="never"),
}
PLACED = "on wrong branches"


def decision_tree() -> World:
    """Return a world of corridors, three cells wide, that fork twice; one branch has food.

    Its region "wrong" has the corridors that lead away from the food at both forks.
    """
    up, left, right = np.array([1, 0, 0]), np.array([1, 0, 1]), np.array([1, 1, 0])
    queen = 2 * up
    fork = queen + STEM * up
    walked, ends, wrong = [queen + n * up for n in range(STEM + 1)], [], []
    for side in (left, right):
        walked += [fork + n * side for n in range(1, BRANCH + 1)]
        wrong += walked[-BRANCH:] if side is right else []
        second = fork + BRANCH * side
        for heading in (side, up):
            walked += [second + n * heading for n in range(1, BRANCH + 1)]
            wrong += walked[-BRANCH:] if ends else []
            ends.append(second + BRANCH * heading)
    full = World((24, 16, 16), queen).grid
    cells = {tuple(cell) for cell in full.cells(np.flatnonzero(full.exists)).tolist()}
    steps = (0 * up, up, right, right - up, -up, -right, up - right)

    def wide(middle: list[np.ndarray]) -> set[tuple[int, ...]]:
        near = [one + step for one in middle for step in steps]
        return {tuple((cell - cell.min()).tolist()) for cell in near}

    right_way = [one for one in walked if not any(one is other for other in wrong)]
    regions = {"wrong": sorted(wide(wrong) - wide(right_way))}
    rock = sorted(cells - wide(walked))
    return World(full.ranges, queen, [ends[0]], obstacles=rock, regions=regions)


def task(mark: Field, half_life: float) -> Task:
    """Return the task of a colony whose repellent is a field, and the half-life of its path."""
    path = Field(
        "exponential", half_life, deposit="add", level=20, cap=400, deposited_when="always"
    )
    return Task(
        pheromone=Pheromone(deposit="none"),
        fields={"path": path, "no_entry": mark},
        outbound_cue="path",
        choice=Choice("wary"),
        traffic=Traffic.named()["following"],
        life=Life(regrowth=0),
        turns_at_queen=True,
    )


def deliveries_over_time(
    seeds: list[int], model: str, half_life: float = HALF_LIVES[0], ants: int = ANTS
) -> np.ndarray:
    """Return the deliveries so far, every STEP ticks, (seeds, times)."""
    worlds, rules_of_all = [decision_tree()] * len(seeds), task(MARKS[model], half_life)
    colony = Colony(worlds, rules_of_all, None, seeds, ants, sharing="frozen")
    colony.begin_episode()
    if model == PLACED:
        Interventions(colony).apply(SetTrail(AMOUNT, "wrong", "no_entry"))
    counts = []
    for _ in range(0, TICKS, STEP):
        colony.tick(STEP)
        counts.append(colony.deliveries.copy())
    return np.transpose(counts)


def measure(seeds: list[int]) -> model_script.ScriptResults:
    """Return the deliveries over time for each model, and their differences to the first."""
    numbers, summary, found = [], [], {}
    for half_life in HALF_LIVES:
        for name in MARKS:
            found[half_life, name] = counts = deliveries_over_time(seeds, name, half_life)
            less = found[half_life, next(iter(MARKS))][:, -1]
            for seed, of_seed, base in zip(seeds, counts.tolist(), less.tolist(), strict=True):
                one = {"half_life": half_life, "model": name, "seed": seed}
                for step, n in enumerate(of_seed, start=1):
                    numbers.append({**one, "tick": step * STEP, "delivered": n})
                case = f"{name}, {half_life:g} ticks"
                row = {"repellent, half-life of the path": case, "deliveries": of_seed[-1]}
                summary.append({**row, "difference": of_seed[-1] - base})

    def draw(axes):
        for (half_life, name), counts in found.items():
            if half_life == HALF_LIVES[0]:
                model_script.band(axes, np.arange(STEP, TICKS + 1, STEP), counts, name)
        axes.set(xlabel="tick", ylabel="food items delivered", ylim=(0, None))

    title = "Deliveries on a decision tree, by where a no-entry pheromone is laid"
    return model_script.ScriptResults(numbers, summary, title, draw)


if __name__ == "__main__":
    model_script.run(__file__, __doc__, measure)
