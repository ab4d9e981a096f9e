"""Arguments that several functions take, checked once; kernels assume valid input."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence, Sized
from numbers import Real

import numpy as np

from taichi_ants import errors, learners
from taichi_ants.errors import AntsError, checked_whole, count, entries_of, expect, refuse, shown
from taichi_ants.features import FEATURES
from taichi_ants.features.support import BASE, CASTES, COLONY, LONE, refuse_unsupported
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task
from taichi_ants.task.constants import MAX_STEPS
from taichi_ants.worlds.world import STARTS, World

MAX_ANTS = MAX_SEEDS = 1 << 24
ALONE = "a run of one ant", LONE, "leave it out, or use a Colony"


def checked_world(
    world: World, learns: bool = False, what: str = ALONE[0], supports: Collection[str] = LONE
) -> World:
    """Return the world; AntsError unless `what` supports it and, with `learns`, it has food."""
    expect("world", world, World)
    refuse_unsupported(what, world.uses(), supports, "use a Colony")
    if learns and not len(world.foods):
        raise AntsError("the world has no food, so ants cannot learn in it; add food.")
    return world


def check_ranges(worlds: Sequence[World]) -> None:
    """Raise AntsError unless all worlds have the same ranges."""
    ranges = {world.ranges for world in worlds}
    if len(ranges) > 1:
        raise AntsError(f"the worlds have the ranges {sorted(ranges)}; give worlds of one size.")


def checked_worlds(
    world: World | Sequence[World], n_seeds: int, learns: bool, n_nests: int = 0
) -> tuple[World, ...]:
    """Return one world per seed for a colony, with the same number of nests, if not 0.

    AntsError if their number is wrong, or one does not fit.
    """
    given = entries_of(world) or [world] * n_seeds
    worlds = tuple(checked_world(one, learns, "a colony", COLONY) for one in given)
    if len(worlds) != n_seeds:
        raise AntsError(f"there are {len(worlds)} worlds for {n_seeds} seeds; give one per seed.")
    check_ranges(worlds)
    n_nests = n_nests or worlds[0].n_nests
    for one in worlds:
        if one.n_nests != n_nests:
            raise AntsError(
                f"a world has {count(one.n_nests, 'nest')}, but another one {n_nests}; all worlds "
                "of a colony must have the same number."
            )
    return worlds


def checked_task(
    task: Task | None, what: str, supports: Collection[str], instead: str = "leave it out"
) -> Task:
    """Return the task, by default the paper's; AntsError if it has what `what` does not support."""
    task = Task() if task is None else task
    expect("task", task, Task)
    refuse_unsupported(what, task.uses(), supports, instead)
    return task


def checked_run(
    world: World, task: Task | None, max_steps: int, learns: bool = False
) -> tuple[Task, int]:
    """Return the task, by default the paper's, and the step limit of runs of one ant."""
    task = checked_task(task, *ALONE)
    checked_world(world, learns)
    return task, checked_max_steps(max_steps, task)


def checked_capacity(
    task: Task, ants: int, capacity: int | None, start: str, ends_at_delivery: bool
) -> int:
    """Return the largest number of ants at once; the arguments are those of `Colony`."""
    checked_whole("ants", ants, 1, MAX_ANTS)
    errors.check_one_of("start", start, STARTS)
    births = task.life.births
    if errors.checked_flag("ends_at_delivery", ends_at_delivery) and (ants != 1 or births):
        raise AntsError(
            f"ends_at_delivery is True with {ants} ants and births {births}; it requires one ant "
            "and no births, so leave it out."
        )
    if capacity is None:
        return min(2 * ants + 64, MAX_ANTS) if births else int(ants)
    return checked_whole("capacity", capacity, ants, MAX_ANTS, f", because {ants} ants start")


def check_features(task: Task, worlds: Sequence[World], sharing: str) -> None:
    """Raise AntsError if a colony with this task and sharing cannot live in the worlds."""
    for feature in FEATURES:
        for refusal in feature.refusals(task, worlds, sharing):
            raise AntsError(refusal)


def check_learner(config: TrainingConfig, task: Task, sharing: str = "independent") -> None:
    """Raise AntsError if the learner does not fit the choices of ants, or sharing of its table."""
    learner = learners.get(config.learner)
    if learner.name == "expected_sarsa" and task.choice.rule != "greedy":
        raise AntsError(
            f"learner 'expected_sarsa' takes the mean over epsilon-greedy actions, but "
            f"`task.choice.rule` is {task.choice.rule!r}; use 'sarsa', or the rule 'greedy'."
        )
    if sharing == "shared" and learner.td_error is None:
        raise AntsError(
            f"learner {learner.name!r} has no TD error that can be summed over ants, so ants "
            'cannot share its table; set sharing to "independent".'
        )


def checked_training(
    training: TrainingConfig | None, task: Task, sharing: str, has_table: bool
) -> TrainingConfig | None:
    """Return the training of a colony, complete, or None if there are no action values."""
    learns = sharing != "frozen"
    if training is None and not learns and not has_table:
        if task.needs_table:
            refuse_unsupported("a colony with given actions", task.uses(), BASE - CASTES)
        return None
    if not task.needs_table:
        raise AntsError(
            f"`task.choice.rule` is {task.choice.rule!r}, so ants choose without action values, "
            f"but sharing is {shown(sharing)} and there is a training or q_values; set sharing to "
            '"frozen" and training to None, and leave out q_values.'
        )
    expect("training", training, TrainingConfig)
    assert training is not None
    (training,) = checked_configs(training)
    policies = [caste.policy for caste in task.castes.values()] or [None]
    if not (learns or has_table) and None in policies:
        raise AntsError(
            "sharing is 'frozen', but q_values is None; give the action values that the ants "
            "follow, because they do not learn."
        )
    if learns:
        check_learner(training, task, sharing)
    return training


def checked_tables(q_values: np.ndarray, n_worlds: int, axes: Mapping[str, int]) -> np.ndarray:
    """Return tables (..., n_states, 5) of a colony with a leading axis W, and one of all `axes`.

    AntsError unless there is one table, one per world, or one for each place on the axes.
    """
    leading, form = q_values.shape[:-2], q_values.shape[-2:]
    owners = {(n_worlds, *axes.values()): " and ".join(axes), (n_worlds,): "world"}
    if leading and leading not in owners:
        forms = [
            f"{(*shape, *form)} for one table per {owners[shape]}"
            for shape in sorted(owners, key=len)
        ]
        raise AntsError(f"q_values has shape {q_values.shape}; give {form}, {', or '.join(forms)}.")
    return q_values.reshape(*leading[:1], -1, *form)


def checked_configs(
    configs: TrainingConfig | Sequence[TrainingConfig], task: Task | None = None
) -> tuple[TrainingConfig, ...]:
    """Return one or several configurations as a tuple, with the defaults of hyperparameters."""
    listed = [configs] if isinstance(configs, TrainingConfig) else entries_of(configs)
    if not listed:
        raise AntsError(f"configs is {shown(configs)}; give one TrainingConfig or several.")
    complete = tuple(learners.registry.with_hyperparameters(config) for config in listed)
    if task is not None:
        for config in complete:
            check_learner(config, task)
    return complete


def checked_seeds(seeds: int | Sequence[int]) -> tuple[int, ...]:
    """Return one or several seeds as a tuple; AntsError if two are equal, or for too many."""
    if isinstance(seeds, Sized) and len(seeds) > MAX_SEEDS:
        raise AntsError(f"seeds has {len(seeds)} entries; give at most {MAX_SEEDS}.")
    listed = entries_of(seeds.ravel().tolist() if isinstance(seeds, np.ndarray) else seeds)
    listed = [seeds] if listed is None else listed
    checked = tuple(checked_whole("a seed", seed, -(2**63), 2**64 - 1) for seed in listed)
    if not checked:
        raise AntsError("seeds is empty; give at least one whole number.")
    words = Counter(seed % 2**64 for seed in checked)
    for seed in checked:
        if words[seed % 2**64] > 1:
            raise AntsError(f"seeds contains {seed} more than once, modulo 2**64; give it once.")
    return checked


def checked_seeds_for(seeds: int | Sequence[int], shape: tuple[int, ...]) -> np.ndarray:
    """Return a seed for each table of the given leading shape, as a flat object array."""
    listed = checked_seeds(seeds)
    if len(listed) != 1 and (not shape or shape[-1] != len(listed)):
        tables = f"{' x '.join(map(str, shape))} tables" if shape else "one table"
        allowed = f"1 seed or {shape[-1]} seeds" if shape else "1 seed"
        raise AntsError(f"there are {len(listed)} seeds for {tables}; give {allowed}.")
    return np.broadcast_to(np.array(listed, dtype=object), shape or (1,)).ravel()


def checked_max_steps(value: int, task: Task) -> int:
    """Return the step limit; AntsError unless the return of an episode fits into 32 bits."""
    most = (2**31 - 1) // max(1, task.rewards.largest)
    return checked_whole("max_steps", value, most=min(MAX_STEPS, most))


def checked_share(name: str, value: float) -> float:
    """Return a number from 0 to 1 as a float, or raise AntsError."""
    if not isinstance(value, Real) or isinstance(value, bool) or not 0 <= value <= 1:
        refuse(name, value, "a number between 0 and 1")
    return float(value)
