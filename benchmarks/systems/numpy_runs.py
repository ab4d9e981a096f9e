"""The paper's world and Q-learning in NumPy: all runs take a step together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from systems.paper_world import (
    CONFIGS,
    CUE,
    DEPOSIT,
    GIVE,
    GOAL,
    N_ACTIONS,
    N_STATES,
    PICK_UP,
    layout,
    settings,
)
from taichi_ants import TrainingConfig


class NumpyRuns:
    """n runs that step together; a run starts its next episode at once.

    Args:
        configs: Configurations.
        each: Number of runs per configuration.
        max_steps: Number of steps after which an episode is truncated.
        seed: Seed of all random numbers.

    Attributes:
        ended: For each step in which episodes ended, a tuple of runs, returns and steps.
    """

    def __init__(
        self, configs: Sequence[TrainingConfig], each: int, max_steps: int, seed: int = 0
    ) -> None:
        self.world, self.settings = layout(), settings(configs, each)
        self.n, self.max_steps = len(configs) * each, max_steps
        self.random = np.random.Generator(np.random.SFC64(seed))
        self.runs, size = np.arange(self.n), len(self.world.ground)
        self.first_cell, self.first_row = self.runs * size, self.runs * N_STATES
        self.ground = np.tile(self.world.ground, (self.n, 1))
        self.trail = np.tile(self.world.trail, (self.n, 1))
        self.closer = self.world.closer.reshape(3, -1)
        self.q = np.zeros((self.n * N_STATES, N_ACTIONS), np.float32)
        self.cell, self.heading = np.full((2, self.n), [[self.world.cell], [self.world.heading]])
        self.carries = np.zeros(self.n, bool)
        self.epsilon = self.settings.epsilon.copy()
        self.returns, self.steps = np.zeros((2, self.n), np.int64)
        self.ended: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self.look()

    def look(self) -> None:
        """Update the cells in view, their codes, and the rows of the table."""
        self.view = self.cell + self.world.ahead[:, self.heading]
        places = self.view + self.first_cell
        looks = self.ground.take(places)
        empty = looks == 0
        levels = self.trail.take(places) * empty
        to_forager = np.where(2 * levels >= np.maximum(levels.max(axis=0), 2), CUE, looks & 3)
        nearer = self.closer.take(self.cell * 6 + self.heading, axis=1)
        to_carrier = np.where(nearer & empty, CUE, looks >> 2)
        self.codes = np.where(self.carries, to_carrier, to_forager)
        left, forward, right = self.codes
        state = self.carries * np.int64(64) + left * 16 + forward * 4 + right
        self.row = self.first_row + state

    def step(self) -> None:
        """Choose an action and take a step in every run."""
        values = self.q[self.row]
        explores = self.random.random(self.n, np.float32) < self.epsilon
        allowed = (values == values.max(axis=1, keepdims=True)) | explores[:, None]
        ties = self.random.random(values.shape, np.float32)
        self.learn(np.where(allowed, ties, -1.0).argmax(axis=1))

    def learn(self, action: np.ndarray) -> None:
        """Take these actions (n,), and learn from the transitions."""
        row = self.row
        rewards, delivered = self.act(action)
        self.look()
        targets = rewards + self.settings.discount * self.q[self.row].max(axis=1)
        place = row * N_ACTIONS + action
        before = self.q.take(place)
        self.q.put(place, before + self.settings.learning_rate * (targets - before))
        self.returns += rewards
        self.steps += 1
        (ended,) = np.nonzero(delivered | (self.steps >= self.max_steps))
        if len(ended):
            self.begin(ended)

    def act(self, action: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rewards of actions, and whether each ant has delivered, (n,)."""
        moves, position = action < PICK_UP, np.minimum(action, 2)
        code = self.codes[position, self.runs]
        enters = moves & ((code & 1) == 0)
        rewards = np.where(enters, (code == CUE).astype(np.int64), -1)
        goal = self.codes == GOAL
        sees = goal.any(axis=0)
        (takes,) = np.nonzero((action == PICK_UP) & sees & ~self.carries)
        delivered = (action == GIVE) & sees & self.carries
        self.cell = np.where(enters, self.view[position, self.runs], self.cell)
        self.heading = (self.heading + np.where(moves, action + 5, 0)) % 6
        (lays,) = np.nonzero(enters & self.carries)
        self.trail[lays, self.cell[lays]] = DEPOSIT
        if len(takes):
            food = self.view[goal[:, takes].argmax(axis=0), takes]
            self.ground[takes, food] = 0
            self.trail[takes, food] = self.trail[takes, self.cell[takes]] = DEPOSIT
            self.heading[takes] = (self.heading[takes] + 3) % 6
            self.carries[takes] = True
            rewards[takes] = 3
        self.carries &= ~delivered
        rewards[delivered] = 10
        return rewards, delivered

    def begin(self, some: np.ndarray) -> None:
        """Record the outcomes of the episodes of some runs, and start their next episodes."""
        self.ended.append((some, self.returns[some], self.steps[some]))
        self.ground[some], self.trail[some] = self.world.ground, self.world.trail
        self.cell[some], self.heading[some] = self.world.cell, self.world.heading
        self.carries[some] = False
        self.returns[some] = self.steps[some] = 0
        decayed = self.epsilon[some] * self.settings.decay[some]
        self.epsilon[some] = np.maximum(self.settings.least[some], decayed)
        self.look()


def train(
    configs: Sequence[TrainingConfig], each: int, episodes: int, max_steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the returns and steps of the first episodes of all runs, (n, episodes)."""
    runs = NumpyRuns(configs, each, max_steps)
    outcomes, done = np.zeros((2, runs.n, episodes), np.int64), np.zeros(runs.n, np.int64)
    while done.min() < episodes:
        runs.step()
        while runs.ended:
            some, *came = runs.ended.pop()
            kept = done[some] < episodes
            outcomes[:, some[kept], done[some][kept]] = np.array(came)[:, kept]
            done[some] += 1
    return outcomes[0], outcomes[1]


def training(each: int) -> Callable[[], int]:
    """Return work on the paper's grid: the next 100 steps of all runs."""
    runs = NumpyRuns(CONFIGS, each, 600)

    def work() -> int:
        for _ in range(100):
            runs.step()
        runs.ended.clear()
        return 100 * runs.n

    return work
