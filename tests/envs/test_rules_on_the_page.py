"""An environment written from docs/environments.md alone, in plain Python, equals the package's.

`Page` uses nothing but the section "The task" and the tables of infos: if a rule changes, mend the
page first, then this file.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import gymnasium
import numpy as np
import pytest
from command_lines import ROOT

import taichi_ants.envs  # noqa: F401  # registers the environments
from taichi_ants import Pheromone, World, worlds
from taichi_ants.reference.random_stream import hash_of
from taichi_ants.reference.world_state import WorldState

STEPS = ((1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1))
EMPTY, ROCK, FOOD, QUEEN = range(4)


def normal(cell: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(one - min(cell) for one in cell)


def ahead(cell: tuple[int, ...], heading: int) -> tuple[int, ...]:
    return normal(tuple(a + b for a, b in zip(cell, STEPS[heading % 6], strict=True)))


def distance(one: tuple[int, ...], other: tuple[int, ...]) -> int:
    return max(normal(tuple(a - b for a, b in zip(one, other, strict=True))))


class Page:
    """One ant in a world that lists its start; no two food items are ever in view at once."""

    def __init__(
        self, world: World, delivery: str = "terminates", evaporation: bool = False, max_steps=600
    ) -> None:
        self.world, self.delivery, self.limit = world, delivery, max_steps
        self.evaporates = evaporation

    def reset(self) -> dict[str, Any]:
        world = self.world
        self.queen = tuple(world.queen)
        self.holds = {self.queen: QUEEN}
        self.holds |= {tuple(cell): FOOD for cell in world.foods.tolist()}
        self.holds |= {tuple(cell): ROCK for cell in world.obstacles.tolist()}
        self.trail = {tuple(cell): level for *cell, level in world.trails.tolist()}
        *cell, self.heading = world.ants[0].tolist()
        self.cell, self.load, self.steps, self.deliveries = tuple(cell), 0, 0, 0
        return self.info(0, 0)

    def content(self, cell: tuple[int, ...]) -> int:
        inside = all(one < most for one, most in zip(cell, self.world.ranges, strict=True))
        return self.holds.get(cell, EMPTY) if inside else ROCK

    def codes(self) -> list[int]:
        view = [ahead(self.cell, self.heading + turn) for turn in (-1, 0, 1)]
        trails = [self.trail.get(c, 0) if self.content(c) == EMPTY else 0 for c in view]
        codes = []
        for cell, trail in zip(view, trails, strict=True):
            held = self.content(cell)
            if held != EMPTY:
                codes.append(3 if held == (QUEEN if self.load else FOOD) else 1)
            elif self.load:
                codes.append(2 * (distance(cell, self.queen) < distance(self.cell, self.queen)))
            else:
                codes.append(2 * (trail >= 1 and 2 * trail >= max(trails)))
        return codes

    def step(self, action: int) -> tuple[int, bool, bool, dict[str, Any]]:
        codes, event, reason, reward = self.codes(), 6, 0, -1
        if action <= 2:
            self.heading = (self.heading + action - 1) % 6
            target = ahead(self.cell, self.heading)
            if codes[action] in (0, 2):
                self.cell, event, reward = target, 1 + codes[action], codes[action] // 2
                if self.load:
                    self.trail[target] = 250
            else:
                event, reason = 2, self.content(target)
        elif action == 3:
            if self.load or 3 not in codes:
                reason = 4 if self.load else 5
            else:
                food = ahead(self.cell, self.heading + codes.index(3) - 1)
                if self.delivery != "continues":
                    self.holds[food] = EMPTY
                self.trail[food] = self.trail[self.cell] = 250
                self.heading, self.load = (self.heading + 3) % 6, 1
                event, reward = 4, 3
        elif not self.load or 3 not in codes:
            reason = 7 if self.load else 6
        else:
            self.load, event, reward = 0, 5, 10
            self.deliveries += 1
        if self.evaporates:
            self.trail = {cell: max(level - 1, 0) for cell, level in self.trail.items()}
        self.steps += 1
        terminated = event == 5 and self.delivery == "terminates"
        over = self.steps == self.limit or (event == 5 and self.delivery == "truncates")
        return reward, terminated, over and not terminated, self.info(event, reason)

    def info(self, event: int, reason: int) -> dict[str, Any]:
        left, forward, right = codes = self.codes()
        mask = [int(code in (0, 2)) for code in codes]
        mask += [int(not self.load and 3 in codes), int(self.load and 3 in codes)]
        if not any(mask):
            mask[:3] = 1, 1, 1
        state = 64 * self.load + 16 * left + 4 * forward + right
        told = {"state": state, "action_mask": mask, "event": event, "reason": reason}
        return {**told, "deliveries": self.deliveries}


def garden(seed: int) -> World:
    """A world with rocks, trails, and food items of which no two are ever in view."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(4, 9, 3).tolist())
    cells = [cell for cell in product(*map(range, shape)) if min(cell) == 0 and any(cell)]
    drawn = [cells[place] for place in rng.permutation(len(cells))]
    foods: list[tuple[int, ...]] = []
    for cell in drawn:
        if len(foods) < 4 and all(distance(cell, food) > 2 for food in foods):
            foods.append(cell)
    rest = [cell for cell in drawn if cell not in foods]
    rocks, rest = rest[: len(rest) // 6], rest[len(rest) // 6 :]
    trails = [(cell, int(rng.integers(1, 40))) for cell in rest[: len(rest) // 2]]
    ants = [(rest[-1], int(rng.integers(6)))]
    return World(shape, (0, 0, 0), foods=foods, obstacles=rocks, trails=trails, ants=ants)


def compare(steps: int, seed: int) -> int:
    """Step both with the same actions, in the paper's world and gardens; the deliveries."""
    rng, done, deliveries = np.random.default_rng(seed), 0, 0
    while done < steps:
        world = worlds.paper() if rng.random() < 0.3 else garden(int(rng.integers(10**6)))
        rules: dict[str, Any] = {
            "delivery": str(rng.choice(["terminates", "truncates", "continues"])),
            "evaporation": bool(rng.random() < 0.6),
            "max_steps": int(rng.integers(1, 400)),
        }
        env, page = (
            gymnasium.make("taichi_ants/HexForage-v0", world=world, **rules),
            Page(world, **rules),
        )
        (_, info), told, ended = env.reset(seed=0), page.reset(), False
        while not ended:
            assert {**info, "action_mask": info["action_mask"].tolist()} == told
            good = np.flatnonzero(told["action_mask"])
            action = int(rng.integers(5) if rng.random() < 0.1 else rng.choice(good))
            codes = page.codes()
            if 2 in codes and rng.random() < 0.8:
                action = codes.index(2)
            if told["action_mask"][3] or told["action_mask"][4]:
                action = 3 + told["action_mask"][4] if rng.random() < 0.8 else action
            _, reward, *over, info = env.step(action)
            reward_told, *over_told, told = page.step(action)
            assert (reward, over) == (reward_told, over_told)
            done, ended, deliveries = done + 1, any(over), deliveries + (told["event"] == 5)
        assert {**info, "action_mask": info["action_mask"].tolist()} == told
    return deliveries


def test_the_page_has_all_rules() -> None:
    assert compare(5_000, 1) > 25


@pytest.mark.long
def test_the_page_has_all_rules_in_many_worlds() -> None:
    assert compare(60_000, 2) > 300


def test_the_hash_on_the_page_of_colonies_decides_conflicts() -> None:
    """It is that of the reference, which the kernels equal."""
    page = (ROOT / "docs" / "colony.md").read_text("utf-8")
    code = page[page.index("MASK = 2**64") :].split("```")[0]
    names: dict[str, Any] = {}
    exec(compile(code, "colony.md", "exec"), names)
    assert f"# {names['conflict_hash']((0, 8, 8), 5, (10, 10, 10))}\n" in code
    for seed in range(5):
        world = garden(seed)
        index = WorldState(world, Pheromone()).index
        for cell in world.obstacles.tolist():
            ours = names["conflict_hash"](cell, seed, world.ranges)
            assert ours == hash_of(index(tuple(cell)), seed)


def test_the_default_task_is_a_maze_that_a_list_solves() -> None:
    page, actions = Page(worlds.paper()), [1] * 16 + [3] + [1] * 16 + [4]
    page.reset()
    steps = [page.step(action) for action in actions]
    assert (sum(reward for reward, *_ in steps), steps[-1][1]) == (45, True)
