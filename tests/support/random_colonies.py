"""Random colonies: small crowded worlds with all options, learners and ways of sharing.

Golden hashes depend on the order and the ranges of these draws, so keep both. Draw new things from
a new random stream.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from random_choices import NO_NOISE, random_choice, random_noise
from random_worlds import random_world

from taichi_ants import TrainingConfig
from taichi_ants.engines.colony.state import SHARINGS
from taichi_ants.task import Field, Food, Life, Pheromone, Rewards, Task, observations
from taichi_ants.task.constants import EMPTY, GIVE, N_ACTIONS, PICK_UP
from taichi_ants.worlds import World
from taichi_ants.worlds.world import STARTS

LEARNERS = ("q_learning", "sarsa", "expected_sarsa", "dyna_q")  # ants can share their tables
HYPERPARAMETERS: dict[str, dict[str, Any]] = {
    "dyna_q": {"planning_steps": 2},
    "n_step_sarsa": {"n_steps": 3},
    "sarsa_lambda": {"trace_decay": 0.9},
    "prioritized_sweeping": {"planning_steps": 3, "threshold": 0.1},
}


@dataclass(frozen=True)
class RandomColony:
    """The arguments of a colony."""

    world: World
    task: Task
    population: dict[str, Any]
    training: TrainingConfig | None
    seed: int
    sharing: str
    q_values: np.ndarray | None

    @property
    def model(self) -> tuple[World, Task, TrainingConfig | None, int]:
        """The arguments by position."""
        return self.world, self.task, self.training, self.seed

    @property
    def options(self) -> dict[str, Any]:
        """The arguments by name."""
        return {**self.population, "sharing": self.sharing, "q_values": self.q_values}


def random_colony(
    seed: int,
    most_ants: int = 24,
    sharing: str | None = None,
    largest_range: int = 5,
    rewards: Rewards | None = None,
    learner: str | None = None,
    observation: str = "paper",
    dense: bool | None = None,
    traffic: str = "blocking",
    view: str = "half",
    changes: bool = False,
    fields: str = "",
    cues: tuple[str, str] = ("trail", "compass"),
    choice: str = "greedy",
    noise: str = NO_NOISE,
) -> RandomColony:
    """Return the random colony of a seed.

    `sharing`, `learner` and `dense` (trails as real numbers) are random unless they are given. With
    `changes`, ants are born or die and food grows back or wanders, which uses separate kernels.

    Each letter of `fields` names a further pheromone. Those of capitals are dense, the others are
    not; all else about them is random, except the views of `cues`, outbound and homing.

    `choice` is the rule, with random numbers, and `noise` names its kinds. Ants that choose by
    "deneubourg" have no training, so their `sharing` must be "frozen". With a compass, those with
    food follow the last field, if there is one.
    """
    rng, choices = np.random.default_rng([seed, 2]), np.random.default_rng([seed, 1])
    world = random_world(seed, largest_range)
    room = int(np.count_nonzero(world.ground() == EMPTY))
    population, task = _rules(rng, min(room, most_ants), dense, changes)
    may_end = population["ants"] == 1 and not task.life.births
    population["ends_at_delivery"] = may_end and bool(choices.random() < 0.5)
    sharing = sharing or str(choices.choice(SHARINGS))
    training = random_training(rng, learner or str(choices.choice(LEARNERS)))
    delivery = str(rng.choice(["terminates", "truncates"]))
    has_table = sharing == "frozen" or rng.random() < 0.6
    chooses = random_choice(seed, choice)
    if fields and choice == "deneubourg" and cues[1] == "compass":
        chooses = chooses.replace(carriers_follow=fields[-1])
    if not chooses.needs_table:
        training, has_table = None, False
    return RandomColony(
        world=world,
        task=replace(
            task,
            delivery=delivery,
            rewards=rewards or Rewards(),
            observation=observation,
            pheromone=replace(task.pheromone, view=view),
            fields={name: _field(seed, name, view) for name in fields},
            outbound_cue=cues[0],
            homing_cue=cues[1],
            traffic=traffic,
            turns_at_queen=bool(rng.random() < 0.5),
            choice=chooses,
            noise=random_noise(seed, noise),
        ),
        population=population,
        training=training,
        seed=int(rng.integers(-5, 2**40)),
        sharing=sharing,
        q_values=forager(observation) if has_table else None,
    )


def mortal(drawn: RandomColony) -> RandomColony:
    """Return a random colony whose ants die; ants that are only born need kernels of their own."""
    life = drawn.task.life
    return replace(drawn, task=drawn.task.replace(life={"lifespan": life.lifespan or 29}))


def with_nests(drawn: RandomColony, seed: int, nests: int, kinds: int, loads: bool) -> RandomColony:
    """Return a random colony in a world with more queens, kinds of food, and loads in cells.

    A world that is too small for so many queens has fewer. Food of several kinds does not wander.
    """
    rng = np.random.default_rng([seed, 3])
    world, life = drawn.world, drawn.task.life
    ants, taken = drawn.population["ants"], world.grid.index(world.ants[:, :3])
    free = np.setdiff1d(np.flatnonzero(world.ground() == EMPTY), taken)
    more = min(nests - 1, len(free) - 1, max(0, len(free) + len(taken) - ants))
    queens = world.grid.cells(rng.permutation(free)[:more])
    foods = {
        f"kind_{k}": Food(
            pick_up=int(rng.integers(-2, 9)),
            deliver=int(rng.integers(-2, 30)),
            # Of the first kind always, because each other model needs its own kernels.
            loads=int(rng.integers(1 + (k == 0), 5)) if loads else 1,
            regrowth=int(rng.choice([0, 1, 4])) if k == 0 or rng.random() < 0.7 else None,
        )
        for k in range(kinds)
    }
    several = kinds > 1 or loads
    life = replace(
        life, regrowth=None, pile_move_interval=None if several else life.pile_move_interval
    )
    world = replace(
        world,
        other_queens=queens,
        food_kinds=rng.integers(0, kinds, len(world.foods)),
        trails=world.trails,
    )
    return replace(drawn, world=world, task=replace(drawn.task, foods=foods, life=life))


def forager(observation: str = "paper") -> np.ndarray:
    """Return a table that picks up, delivers, and follows trails or the way to the queen."""
    sees = observations.get(observation)
    ahead = [sees.cells.index(cell) for cell in (-1, 0, 1)]
    worth = {"E": 0.5, "-": 0.5, "T": 1.25, "S": 1.25, "1": 0.75, "2": 1.0, "3": 1.25}
    q_values = np.zeros((sees.n_states, N_ACTIONS), np.float32)
    for row in range(sees.n_states):
        task, *cells = sees.name_of(row).split()
        letters = [cells[k] for k in ahead]
        if "F" in letters or "Q" in letters:
            q_values[row, GIVE if task == "carrying" else PICK_UP] = 8
        q_values[row, :3] = [worth.get(letter, -1.0) for letter in letters]
    return q_values


def _rules(
    rng: np.random.Generator, most_ants: int, dense: bool | None, changes: bool
) -> tuple[dict[str, Any], Task]:
    # One ant, a random number, or the largest number.
    ants = int(rng.choice([1, rng.integers(1, most_ants + 1), most_ants]))
    births = bool(rng.random() < 0.5)
    capacity = ants + int(rng.integers(0, 6)) if rng.random() < 0.5 else None
    pheromone = random_pheromone(rng, dense)
    lifespan = int(rng.integers(1, 30)) if rng.random() < 0.5 else None
    regrowth = int(rng.choice([0, 0, 1, 2, 7])) if rng.random() < 0.7 else None
    pile_move_interval = int(rng.choice([1, 2, 5])) if rng.random() < 0.5 else None
    if changes and not births and lifespan is None:
        lifespan = 9
    if changes and regrowth is None and pile_move_interval is None:
        pile_move_interval = 3
    start = str(rng.choice(STARTS))
    task = Task(
        pheromone=pheromone,
        evaporation_in_training=True,
        life=Life(births, lifespan, regrowth, pile_move_interval),
    )
    return {"ants": ants, "capacity": capacity, "start": start}, task


def random_pheromone(rng: np.random.Generator, dense: bool | None) -> Pheromone:
    """Return a pheromone; a dense one has real numbers as levels."""
    evaporation = str(rng.choice(["linear", "exponential", "none"]))
    half_life = float(rng.choice([0.5, 3.0, 50.0]))
    diffusion = float(rng.choice([0.0, 0.0, 0.05, 0.6, 1.0]))
    deposit = str(rng.choice(["set", "add", "fading", "none"]))
    if dense is True and evaporation != "exponential":
        diffusion = max(diffusion, 0.05)
    elif dense is False:
        evaporation, diffusion = "linear" if evaporation == "exponential" else evaporation, 0.0
    level = int(rng.choice([1, 7, 250]))
    return Pheromone(
        evaporation=evaporation,
        half_life=half_life if evaporation == "exponential" else None,
        diffusion=diffusion,
        deposit=deposit,
        level=250 if deposit == "none" else level,
        cap=int(rng.choice([1, 10, 1000])) if deposit == "add" else None,
        slope=int(rng.choice([1, 10, 100])) if deposit == "fading" else None,
    )


def _field(seed: int, name: str, view: str) -> Field:
    """Return a random field, which is dense if its name is a capital."""
    rng = np.random.default_rng([seed, 4, ord(name)])
    rules = vars(random_pheromone(rng, name.isupper()))
    laid = rng.choice(["with_food", "without_food", "always", "dead_end", "failed_pick_up"])
    if name in "cC":  # so that two cues have different views
        view = "strongest" if view == "half" else "half"
    return Field(**{**rules, "view": view, "deposited_when": str(laid)})


def random_task(rng: np.random.Generator, deposit: str, rewards: Rewards, **rules: Any) -> Task:
    """Return a task that independent runs can have."""
    pheromone = Pheromone(
        evaporation=str(rng.choice(["linear", "none"])),
        deposit=deposit,
        level=250 if deposit == "none" else int(rng.choice([1, 7, 250])),
        cap=int(rng.choice([1, 10, 1000])) if deposit == "add" else None,
        slope=int(rng.choice([1, 10, 100])) if deposit == "fading" else None,
        view="strongest" if deposit == "fading" else "half",
    )
    return Task(
        rewards=rewards,
        pheromone=pheromone,
        delivery=str(rng.choice(["terminates", "truncates"])),
        turns_at_queen=bool(rng.random() < 0.3),
        evaporation_in_training=bool(rng.random() < 0.7),
        evaporation_in_evaluation=bool(rng.random() < 0.7),
        **rules,
    )


def random_training(rng: np.random.Generator, learner: str) -> TrainingConfig:
    """Return a configuration with extreme values."""
    return TrainingConfig(
        learner=learner,
        learning_rate=float(rng.choice([0.01, 0.37, 1.0])),
        discount=float(rng.choice([0.0, 0.9, 0.99])),
        epsilon=float(rng.choice([0.0, 0.05, 0.3, 1.0])),
        epsilon_decay=float(rng.choice([0.3, 0.99, 1.0])),
        min_epsilon=float(rng.choice([0.0, 0.01, 0.2])),
        hyperparameters=HYPERPARAMETERS.get(learner, {}),
        learning_rate_decay=float(rng.choice([0.5, 0.9, 1.0])),
        min_learning_rate=float(rng.choice([0.0, 0.1])),
        initial_q=float(rng.choice([0.0, 0.0, 1.7, -3.0])),
    )
