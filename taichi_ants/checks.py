"""Checks of the arguments that users pass to engines; kernels assume valid input."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants import learners
from taichi_ants.errors import (
    AntsError,
    check_one_of,
    checked_flag,
    checked_whole,
    count,
    entries_of,
    expect,
    listing,
    shown,
    whole,
)
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import checked_values, frozen_policy
from taichi_ants.settings import flat
from taichi_ants.task import Task
from taichi_ants.task.constants import MAX_STEPS
from taichi_ants.task.field import COMPASS, TRAIL
from taichi_ants.worlds.world import STARTS, World

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony
    from taichi_ants.learners.learner import Learner

MAX_ANTS = 1 << 24


def checked_world(world: World, learns: bool = False, several: bool = False) -> World:
    """Return the world; AntsError if it is not a World or, with `learns`, has no food.

    Only colonies (`several`) can have several nests or kinds of food.
    """
    expect("world", world, World)
    if not several and (world.n_nests > 1 or world.n_food_kinds > 1):
        raise AntsError(
            f"the world has {count(world.n_nests, 'nest')} and "
            f"{count(world.n_food_kinds, 'kind')} of food; only colonies support several, so use "
            "a Colony."
        )
    if learns and not len(world.foods):
        raise AntsError("the world has no food, so ants cannot learn in it; add food.")
    return world


def checked_task(task: Task) -> Task:
    """Return the task; AntsError if it is not a Task."""
    expect("task", task, Task)
    return task


def check_one_nest(colony: Colony, who: str) -> None:
    """Raise AntsError if a colony has several nests or kinds of food, which `who` cannot have."""
    if colony.n_nests > 1 or colony.task.foods:
        raise AntsError(
            f"the colony has several nests, or `task.foods`; {who} supports one nest and no "
            "`task.foods`."
        )


def check_own_rules(task: Task, who: str) -> None:
    """Raise AntsError if a task uses rules that the user wrote, which `who` cannot have."""
    if task.rules:
        raise AntsError(
            f"the task uses your rules {', '.join(task.rules)}; {who} supports only built-in "
            "rules, so use a Colony, or leave them out."
        )


def check_rewards(task: Task, who: str) -> None:
    """Raise AntsError if the rewards are by a rule that the user wrote, which `who` cannot have."""
    if task.reward != "by_event":
        raise AntsError(
            f"`task.reward` is {task.reward!r}; {who} supports only 'by_event', so leave it out."
        )


def refuse_foods(task: Task, who: str) -> None:
    """Raise AntsError if a task has kinds of food, which `who` does not support."""
    if task.foods:
        raise AntsError(
            f"`task.foods` has the {listing(task.foods, 'kind')}; {who} does not support kinds of "
            "food, so leave them out."
        )


def check_castes(task: Task, sharing: str, is_given_actions: bool) -> None:
    """Raise AntsError if the castes of a task do not fit how the ants of a colony learn."""
    if is_given_actions:
        refuse_castes(task, "a colony with given actions")
    follow = [name for name, caste in task.castes.items() if caste.policy is not None]
    if follow and sharing == "independent":
        raise AntsError(
            f"`task.castes.{follow[0]}.policy` is {task.castes[follow[0]].policy!r}, but sharing "
            'is "independent", so each ant learns into its own table; set sharing to "shared" or '
            '"frozen".'
        )


def check_learns(learns: bool) -> None:
    """Raise AntsError unless ants learn, so that they have a learning rate."""
    if not learns:
        raise AntsError("the ants do not learn, so they have no learning rate; leave it out.")


def check_follows(learns: bool, task: Task) -> None:
    """Raise AntsError unless ants follow a policy and do not learn."""
    if learns:
        raise AntsError(
            "the ants of this colony do not follow a policy; make a colony with "
            'sharing="frozen" and q_values.'
        )
    if not task.choice.needs_table:
        raise AntsError(
            f"the ants choose by the rule {task.choice.rule!r}, which has no policy; leave it out."
        )


def check_same_kernels(task: Task, changed: Task, learns: bool) -> None:
    """Raise AntsError if a changed task needs other kernels; `learns` says whether ants learn."""
    castes = {name: one.fixed for name, one in task.castes.items()}
    if castes != {name: one.fixed for name, one in changed.castes.items()}:
        raise AntsError(
            "the task cannot change the share, ants, nest or policy of a caste in an episode, or "
            "whether it has thresholds; change its other numbers."
        )
    if task.compiled(learns) != changed.compiled(learns):
        old, new = flat(task.as_dict()), flat(changed.as_dict())
        several = [name for name in {**old, **new} if old.get(name) != new.get(name)]
        changes = (f"{one} from {old.get(one)!r} to {new.get(one)!r}" for one in several)
        raise AntsError(
            f"the task cannot change {' and '.join(changes)} in an episode, because that requires "
            "other kernels; change settings that kernels read as numbers, for example "
            "pheromone.level."
        )


def check_nests_of_castes(task: Task, n_nests: int) -> None:
    """Raise AntsError if a caste belongs to a nest that worlds with so many nests do not have."""
    for name, caste in task.castes.items():
        if caste.nest is not None and caste.nest >= n_nests:
            raise AntsError(
                f"`task.castes.{name}.nest` is {caste.nest}, but the world has "
                f"{count(n_nests, 'nest')}, numbered from 0; choose one of them."
            )


def caste_policies(task: Task) -> dict[int, np.ndarray]:
    """Return the tables of the castes that follow a policy, by the numbers of castes.

    AntsError if a policy cannot be used.
    """
    tables = {}
    for number, (name, caste) in enumerate(task.castes.items()):
        if caste.policy is not None:
            try:
                tables[number] = frozen_policy(caste.policy, task.observation)
            except AntsError as error:
                raise AntsError(
                    str(error).replace("policy is", f"`task.castes.{name}.policy` is", 1)
                ) from None
    return tables


def refuse_castes(task: Task, who: str) -> None:
    """Raise AntsError if a task has castes, which `who` does not support."""
    if task.castes:  # labour requires castes
        raise AntsError(
            f"`task.castes` has the {listing(task.castes, 'caste')}; {who} does not support "
            "castes, so leave them out."
        )


def checked_runs_task(task: Task | None) -> Task:
    """Return the task, by default the paper's; AntsError if runs of one ant cannot have it."""
    task = checked_task(Task() if task is None else task)
    check_own_rules(task, "a run of one ant")
    if task.life.changes:
        raise AntsError(
            f"life of the task is {task.life}; only colonies support it, so use a Colony."
        )
    if task.foods:
        raise AntsError(
            f"`task.foods` has the {listing(task.foods, 'kind')}; only colonies support kinds of "
            "food, so use a Colony."
        )
    if task.castes:
        raise AntsError(
            f"`task.castes` has the {listing(task.castes, 'caste')}; only colonies support castes, "
            "so use a Colony."
        )
    if task.pheromone.dense:
        raise AntsError(
            f"pheromone of the task is {task.pheromone}; runs of one ant support neither "
            "exponential evaporation nor diffusion, so use a Colony."
        )
    reads = task.sees.reads
    further = [
        text
        for text, differs in (
            (f"`task.fields` has the {listing(task.fields, 'field')}", task.fields),
            (f"`task.outbound_cue` is {task.outbound_cue!r}", task.outbound_cue != TRAIL),
            (f"`task.homing_cue` is {task.homing_cue!r}", task.homing_cue != COMPASS),
            (
                f"the observation {task.observation!r} reads the {listing(reads, 'field')}",
                reads,
            ),
        )
        if differs
    ]
    if further:
        raise AntsError(
            f"{further[0]}; runs of one ant have only the trail and the compass, so use a Colony."
        )
    if not task.choice.needs_table:
        raise AntsError(
            f"`task.choice.rule` of the task is {task.choice.rule!r}; only colonies support it, so "
            "use a Colony."
        )
    return task


def checked_capacity(
    task: Task, ants: int, capacity: int | None, start: str, ends_at_delivery: bool
) -> int:
    """Return the largest number of ants at once; the arguments are those of `Colony`."""
    checked_whole("ants", ants, 1, MAX_ANTS)
    check_one_of("start", start, STARTS)
    births = task.life.births
    if checked_flag("ends_at_delivery", ends_at_delivery) and (ants != 1 or births):
        raise AntsError(
            f"ends_at_delivery is True with {ants} ants and births {births}; it requires one ant "
            "and no births, so leave it out."
        )
    if capacity is None:
        return min(2 * ants + 64, MAX_ANTS) if births else int(ants)
    checked_whole("capacity", capacity, 1, MAX_ANTS)
    if capacity < ants:
        raise AntsError(
            f"capacity is {capacity}, but {ants} ants start; give a capacity of at least {ants}, "
            "or leave it out."
        )
    return int(capacity)


def check_sharing(learner: Learner, sharing: str) -> None:
    """Raise AntsError if the ants cannot share the learner's table, but `sharing` is "shared"."""
    if sharing == "shared" and learner.td_error is None:
        raise AntsError(
            f"learner {learner.name!r} has no TD error that can be summed over ants, so ants "
            'cannot share its table; set sharing to "independent".'
        )


def refuse_table(task: Task, sharing: str) -> None:
    """Raise an AntsError, because the ants of the task choose without action values."""
    raise AntsError(
        f"`task.choice.rule` is {task.choice.rule!r}, so ants choose without action values, but "
        f"sharing is {shown(sharing)} and there is a training or q_values; set sharing to "
        '"frozen" and training to None, and leave out q_values.'
    )


def check_table(task: Task) -> None:
    """Raise AntsError if the probabilities of actions do not follow from action values alone."""
    if not task.choice.needs_table or task.choice.own_rule:
        raise AntsError(
            f"`task.choice.rule` is {task.choice.rule!r}, so the probabilities of actions do not "
            "follow from action values; record ants that are greedy or softmax."
        )


def check_choice(learner: Learner, task: Task) -> None:
    """Raise AntsError if the learner cannot learn about the choices of the task's ants."""
    if learner.name == "expected_sarsa" and task.choice.rule != "greedy":
        raise AntsError(
            f"learner 'expected_sarsa' takes the mean over epsilon-greedy actions, but "
            f"`task.choice.rule` is {task.choice.rule!r}; use 'sarsa', or the rule 'greedy'."
        )


def check_choices(configs: Sequence[TrainingConfig], task: Task) -> None:
    """Raise AntsError if a learner cannot learn about the choices of the task's ants."""
    for config in configs:
        check_choice(learners.get(config.learner), task)


def check_given_actions(task: Task) -> None:
    """Raise AntsError if the task has a rule of choice, which given actions would not follow.

    The same applies to castes.
    """
    refuse_castes(task, "an environment")
    if task.choice.rule != "greedy":
        raise AntsError(
            f"`task.choice.rule` is {task.choice.rule!r}, but the actions of an environment are "
            "given; leave `task.choice` out."
        )


def checked_configs(configs: TrainingConfig | Sequence[TrainingConfig]) -> tuple:
    """Return one or several configurations as a tuple, with the defaults of hyperparameters."""
    several = [configs] if isinstance(configs, TrainingConfig) else entries_of(configs)
    if several is None:
        raise AntsError(f"configs is {shown(configs)}; it must be one TrainingConfig or several.")
    if not several:
        raise AntsError("configs is empty; give at least one TrainingConfig.")
    for config in several:
        expect("a configuration", config, TrainingConfig)
    return tuple(learners.with_hyperparameters(config) for config in several)


def checked_seeds(seeds: int | Sequence[int]) -> tuple[int, ...]:
    """Return one or several seeds as a tuple; AntsError if two are equal."""
    if isinstance(seeds, np.ndarray):
        seeds = seeds.ravel().tolist()
    given = entries_of(seeds)
    several = tuple(whole("a seed", seed) for seed in ([seeds] if given is None else given))
    if not several:
        raise AntsError("seeds is empty; give at least one whole number.")
    taken: set[int] = set()
    for seed in several:
        if not -(2**63) <= seed < 2**64:
            raise AntsError(f"seeds contains {shown(seed)}; a seed must fit into 64 bits.")
        if seed % 2**64 in taken:
            raise AntsError(
                f"seeds contains {seed} more than once; give seeds that differ modulo 2**64."
            )
        taken.add(seed % 2**64)
    return several


def checked_seeds_for(seeds: int | Sequence[int], shape: tuple[int, ...]) -> np.ndarray:
    """Return a seed for each table of the given leading shape, as a flat object array."""
    several = checked_seeds(seeds)
    if len(several) != 1 and (not shape or shape[-1] != len(several)):
        tables = f"{' x '.join(map(str, shape))} tables" if shape else "one table"
        allowed = f"1 seed or {shape[-1]} seeds" if shape else "1 seed"
        raise AntsError(f"there are {len(several)} seeds for {tables}; give {allowed}.")
    return np.broadcast_to(np.array(several, dtype=object), shape or (1,)).ravel()


def checked_max_steps(value: int, task: Task) -> int:
    """Return the step limit; AntsError unless the return of an episode fits into 32 bits."""
    most = (2**31 - 1) // max(1, task.rewards.largest)
    return checked_whole("max_steps", value, most=min(MAX_STEPS, most))


def checked_share(name: str, value: float) -> float:
    """Return a number from 0 to 1 as a float, or raise AntsError."""
    if not isinstance(value, Real) or isinstance(value, bool) or not 0 <= value <= 1:
        raise AntsError(f"{name} is {shown(value)}; it must be a number between 0 and 1.")
    return float(value)


def check_progress(progress: object) -> None:
    """Raise AntsError unless `progress` is None or a function."""
    if progress is not None and not callable(progress):
        raise AntsError(f"progress is {shown(progress)}; it must be a function or None.")


def check_finite(
    tables: np.ndarray, configs: Sequence[TrainingConfig], seeds: Sequence[int]
) -> None:
    """Raise AntsError if learnt tables (configurations * seeds, ...) are not finite."""
    with np.errstate(all="ignore"):
        if np.isfinite(tables.sum()):  # a copy of a colony's tables could take much memory
            return
    finite = np.isfinite(tables).reshape(len(configs), len(seeds), -1).all(axis=-1)
    for c, s in np.argwhere(~finite)[:1]:
        raise AntsError(
            f"learner {configs[c].learner!r} computed action values that are not finite, with "
            f"{configs[c]} and seed {seeds[s]}; correct its TD error, or use smaller rewards and "
            "action values."
        )


def checked_table(q_values: Any, task: Task) -> np.ndarray:
    """Return the one table of `q_values`, float32 (n_states, 5); AntsError if it has several."""
    tables = checked_q_values(q_values, task)
    if tables.ndim == 2:
        return tables
    if math.prod(tables.shape[:-2]) > 1:
        whose = "its " if hasattr(q_values, "q_values") else ""
        places = ", ".join("0" * (tables.ndim - 2))
        raise AntsError(
            f"q_values has shape {tables.shape}, which is {math.prod(tables.shape[:-2])} tables; "
            f"give one of them, for example {whose}q_values[{places}]."
        )
    return tables.reshape(tables.shape[-2:])


def checked_q_values(q_values: Any, task: Task) -> np.ndarray:
    """Return action values as float32 (..., n_states, 5); AntsError unless they are finite.

    Also accepts an object with `q_values`: a `TrainingResult`, a `Policy` or a `Colony`.
    """
    return checked_values(getattr(q_values, "q_values", q_values), task)
