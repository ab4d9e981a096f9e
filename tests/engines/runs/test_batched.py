"""Batched environments equal the plain reference: every step, whatever they are told to do."""

import numpy as np
import pytest
from colonies import act, training
from random_choices import NO_NOISE, NOISE, random_noise
from random_rewards import random_rewards
from random_worlds import random_world

from taichi_ants import Life, Pheromone, Task
from taichi_ants.engines.layout import TERMINATED, TRUNCATED, Command
from taichi_ants.engines.runs.batched import BatchedEnvironments
from taichi_ants.reference import ReferenceColony
from taichi_ants.task.constants import GIVE, PICK_UP, Event, Reason
from taichi_ants.worlds import World

# Each needs another kernel: observation, deposit, view, noise.
KERNELS = [
    ("paper", "set", "half", NO_NOISE),
    ("six_cells", "add", "strongest", NO_NOISE),
    ("queues", "fading", "strongest_under_carriers", NO_NOISE),
    ("trail_levels", "none", "half", NOISE),
    ("paper", "set", "half", NOISE),
]


def plain(world: World, task: Task, seed: int, ends: str, falls: bool) -> ReferenceColony:
    """A colony of one ant that does what it is told."""
    life = Life(regrowth=0) if ends == "continues" else Life()
    rules = {name: getattr(task, name) for name in vars(task) if name != "life"}
    rules |= {"evaporation_in_evaluation": falls, "life": life}
    nothing = np.zeros((task.n_states, 5), np.float32)
    return ReferenceColony(
        world, Task(**rules), training(), seed, sharing="frozen", q_values=nothing
    )


def drawn_task(rng: np.random.Generator, observation: str, deposit: str, view: str, noise) -> Task:
    more = {"add": {"cap": int(rng.choice([1, 300]))}, "fading": {"slope": int(rng.choice([1, 9]))}}
    pheromone = Pheromone(deposit=deposit, view=view)
    if deposit != "none":
        pheromone = Pheromone(
            evaporation=str(rng.choice(["linear", "none"])),
            deposit=deposit,
            level=int(rng.choice([3, 40, 250])),
            view=view,
            **more.get(deposit, {}),
        )
    return Task(
        observation,
        random_rewards(int(rng.integers(99))),
        pheromone,
        turns_at_queen=bool(rng.integers(2)),
        noise=random_noise(int(rng.integers(99)), noise),
    )


def sensible(rng: np.random.Generator, paper_state: int) -> int:
    """An action that often succeeds, so that much happens."""
    if rng.random() < 0.3:
        return int(rng.integers(5))
    codes = paper_state >> 4 & 3, paper_state >> 2 & 3, paper_state & 3
    if 3 in codes:
        return GIVE if paper_state >> 6 else PICK_UP
    lures = [move for move, code in enumerate(codes) if code == 2]
    return int(rng.choice(lures or [0, 1, 2]))


def check_equal(ants: BatchedEnvironments, i: int, colony: ReferenceColony, world: World) -> None:
    """What the ant is and sees, and how its world looks, is that of the reference."""
    arrays, (ant,) = ants.arrays, colony.ants.values()
    now = ants.snapshot(i)
    assert tuple(world.grid.cells(now.ant_cells)[0].tolist()) == ant.cell
    assert (now.ant_headings[0], now.ant_carries[0]) == (ant.heading, ant.carries)
    assert (arrays["paper_states"][i], arrays["states"][i]) == (ant.paper_state, ant.state)
    assert arrays["random_states"][i] == ant.stream.state
    for cell, ground in colony.world.ground.items():
        place = world.grid.index(cell)
        assert now.ground[place] == ground
        if ground == 0:
            assert now.trail[place] == colony.world.trail.level(cell)


MARKED = [pytest.param(one, marks=[pytest.mark.long] * (k % 2)) for k, one in enumerate(KERNELS)]


@pytest.mark.parametrize("kernel", MARKED, ids="-".join)
def test_each_step_equals_the_reference(kernel):
    rng = np.random.default_rng(KERNELS.index(kernel))
    delivered = slipped = 0
    for number in range(6):
        world, ends = (
            random_world(1000 + number),
            ("terminates", "truncates", "continues")[number % 3],
        )
        task, falls = drawn_task(rng, *kernel), bool(rng.integers(2))
        n, max_steps, seed = 3, int(rng.integers(2, 60)), int(rng.integers(2**60))
        ants = BatchedEnvironments([world], task, n, max_steps, ends, falls)
        ants.seed(range(seed, seed + n), np.arange(n))
        ants.step(0, Command.BEGIN)
        colonies = [plain(world, task, seed + i, ends, falls) for i in range(n)]
        for colony in colonies:
            colony.begin_episode()
        same_step = number % 2 == 1
        begins, arrays = np.zeros(n, bool), ants.arrays
        for _ in range(60):
            paper_states = arrays["paper_states"].tolist()
            actions = [sensible(rng, paper_state) for paper_state in paper_states]
            after_end = Command.STEP if same_step else Command.WAIT
            ants.step(np.array(actions), begins & (not same_step), after_end)
            for i, colony in enumerate(colonies):
                if begins[i] and not same_step:
                    colony.begin_episode()
                    assert arrays["results"][i] == Event.NONE
                    assert arrays["reasons"][i] == Reason.NONE
                    assert arrays["rewards_of"][i] == 0
                    check_equal(ants, i, colony, world)
                    continue
                act(colony, actions[i])
                (step,) = colony.transitions
                gave = step.event is Event.DELIVERED
                delivered += gave
                terminated = gave and ends == "terminates"
                last = colony.record.ticks == max_steps or (gave and ends != "continues")
                slipped += step.executed != step.action
                assert arrays["rewards_of"][i] == step.reward
                succeeds = step.event not in (Event.BLOCKED, Event.FAILED)
                assert (arrays["reasons"][i] == Reason.NONE) == succeeds
                ends_with = TERMINATED * terminated | TRUNCATED * (last and not terminated)
                assert arrays["results"][i] == step.event | ends_with
                if last and same_step:
                    (ant,) = colony.ants.values()
                    assert arrays["final_states"][i] == ant.state
                    assert arrays["final_paper_states"][i] == ant.paper_state
                    colony.begin_episode()
                check_equal(ants, i, colony, world)
            begins = arrays["results"] >= TRUNCATED
    assert delivered > (4 if kernel[-1] else 12)
    assert (slipped > 50) == (kernel[-1] == NOISE)
