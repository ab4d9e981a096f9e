"""Recording of the transitions of lone ants or of a colony as a data set."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_ants import arguments
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.runs.engine import Runs
from taichi_ants.errors import AntsError, checked_whole, enough_memory, expect
from taichi_ants.features.support import BASE, CASTES, CHOICE, FOODS, refuse_unsupported
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import action_probabilities, checked_values, random_policy
from taichi_ants.offline.dataset import COLUMNS, Dataset
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS, MAX_STEPS, Event
from taichi_ants.worlds.world import World

# Of colonies: probabilities and rewards of actions must follow from action values and events.
SUPPORTS = BASE - CHOICE - CASTES - FOODS - {"nests", "reward"}
SUPPORTS |= {"choice.rule=softmax", "choice.temperature"}
_FROM_TRACE = {"step": "steps", "state": "states", "action": "actions", "reward": "rewards"}
_FROM_TRACE |= {"next_state": "next_states", "terminated": "terminated", "episode": "episodes"}
_FROM_TRACE |= {"run": "runs", "behaviour_probability": "chances"}


@enough_memory("so many seeds or episodes")
def record(
    world: World,
    behaviour: TrainingConfig | np.ndarray | None = None,
    episodes: int = 100,
    seeds: int | Sequence[int] = 0,
    max_steps: int = EPISODE_STEPS,
    task: Task | None = None,
    epsilon: float = 0.0,
) -> Dataset:
    """Return the transitions of single ants, one run per seed, each ant alone in its world.

    The steps of a learner are, bit for bit, those of `train` with the same arguments, and the steps
    of a table are those of `evaluate`.

    Args:
        behaviour: The behaviour policy: None for random actions; action values (n_states, 5), or
            (seeds, n_states, 5) for one table per run, followed epsilon-greedily with random ties;
            or a TrainingConfig for a learner while it learns.
        task: The rules; None is the paper's task. Learners use its evaporation in training, other
            policies its evaporation in evaluation.
        epsilon: The exploration rate of a table; a learner has its own.
        world, episodes, seeds, max_steps: As in `train`.

    Raises:
        AntsError: An argument is not allowed; the message names it.

    >>> data = record(worlds.paper(), config, episodes=2)
    >>> data.state.dtype, data.episode.max().item()
    (dtype('int32'), 1)
    """
    learns = isinstance(behaviour, TrainingConfig)
    task, max_steps = arguments.checked_run(world, task, max_steps, learns)
    numbers = arguments.checked_seeds(seeds)
    episodes = checked_whole("episodes", episodes)
    epsilon = arguments.checked_share("epsilon", epsilon)
    facts: dict[str, Any]
    if isinstance(behaviour, TrainingConfig):
        configs = arguments.checked_configs(behaviour, task)
        runs = Runs.learning(world, task, max_steps, configs, numbers)
        facts = {"policy": "learner", **configs[0].as_dict()}
    else:
        facts = {"policy": "random" if behaviour is None else "table", "epsilon": epsilon}
        table = random_policy(task.observation) if behaviour is None else behaviour
        tables = checked_values(table, task)
        if tables.ndim == 4 and len(tables) == 1:  # as `train` returns for one configuration
            tables = tables[0]
        if tables.shape[:-2] not in ((), (len(numbers),)):
            raise AntsError(
                f"behaviour has shape {tables.shape}; give a single table, or one table for each "
                f"of the {len(numbers)} seeds."
            )
        tables = np.broadcast_to(tables, (len(numbers), *tables.shape[-2:]))
        which = tables, numbers, range(episodes), epsilon
        runs = Runs.following(world, task, max_steps, *which)
    pieces = [
        {**{n: steps[there] for n, there in _FROM_TRACE.items()}, "agent": 0 * steps["runs"]}
        for steps in runs.record(episodes)
    ]
    return _dataset(pieces, world=world, task=task, seeds=numbers, behaviour=facts)


@enough_memory("so many episodes")
def record_colony(colony: Colony, episodes: int = 1, ticks: int = 1000) -> Dataset:
    """Return the transitions of a colony's ants while it runs more episodes of `ticks` each.

    A run is a world of the colony. An episode of the data ends when its ant dies or the colony's
    episode ends. If deliveries terminate episodes, it also ends at a delivery, and another episode
    of the same ant begins. The colony acts and learns, bit for bit, as in `Colony.run`. All its
    worlds must be equal.

    Raises:
        AntsError: An argument is not allowed, or the colony has different worlds.

    >>> data = record_colony(colony, ticks=20)
    >>> data.agent.max().item(), len(data.reward)
    (15, 320)
    """
    expect("colony", colony, Colony)
    uses = colony.worlds[0].uses() | colony.task.uses()
    refuse_unsupported("record_colony", uses, SUPPORTS, "record another colony")
    episodes = checked_whole("episodes", episodes)
    ticks = checked_whole("ticks", ticks, most=MAX_STEPS)
    if len(dict.fromkeys(colony.worlds)) > 1:
        raise AntsError("the worlds of the colony differ; record a separate colony for each world.")
    facts = {"policy": "colony", "sharing": colony.sharing, "ants": colony.ants}
    facts["training"] = colony.training.as_dict()
    pieces = []
    for episode in range(episodes):
        colony.begin_episode(ticks)
        tables = colony.q_values
        for tick in range(ticks):
            before, tables = tables, colony.q_values
            piece = _tick(colony, tables, before)
            pieces.append({**piece, "episode": np.full(len(piece["run"]), episode)})
            if not len(piece["run"]) and tick + 1 < ticks:  # all ants are dead
                colony.tick(ticks - tick - 1)
                break
        colony.end_episode()
    known = {"task": colony.task, "seeds": colony.seeds, "behaviour": facts}
    return _dataset(pieces, world=colony.worlds[0], **known)


def _tick(colony: Colony, tables: np.ndarray, before: np.ndarray) -> dict[str, np.ndarray]:
    """Advance by a tick and return its transitions; actions drawn in advance follow `before`."""
    step, acting = colony.ticks, colony.living & colony.running[:, None]
    run, slot = np.nonzero(acting)
    owner = (run, slot)[: tables.ndim - 2]
    state, agent = colony.states[acting], colony.numbers[acting]
    values = tables[(*owner, state)]
    if colony._model.draws_next_action:
        known = colony.next_actions[acting] >= 0
        values = np.where(known[:, None], before[(*owner, state)], values)
    colony.tick()
    if not np.array_equal(colony.numbers[run, slot], agent):  # the colony has re-sorted its ants
        keys = (np.arange(len(colony.seeds))[:, None] * 2**32 + colony.numbers).ravel()
        order = np.argsort(keys)
        slot = order[np.searchsorted(keys[order], run * 2**32 + agent)] % colony.capacity
    event, action = colony.events[run, slot], colony.actions[run, slot]
    chances = action_probabilities(values, colony.epsilon, colony.task.choice)
    return {
        **{"run": run, "agent": agent, "step": np.full(len(run), step)},
        **{"state": state, "action": action, "reward": colony.task.rewards.by_event()[event]},
        "next_state": colony.states[run, slot],
        "terminated": (event == Event.DELIVERED) & (colony.task.delivery == "terminates"),
        "behaviour_probability": chances[np.arange(len(run)), action],
    }


def _dataset(pieces: list[dict[str, np.ndarray]], **known: Any) -> Dataset:
    """Return the data set of rows, and find the ends of episodes; each ant's rows are in order."""
    rows: dict[str, Any] = {
        name: np.concatenate([piece[name] for piece in pieces]).astype(dtype)
        for name, dtype in COLUMNS.items()
        if name in pieces[0]
    }
    pieces.clear()

    def in_order(*by: np.ndarray) -> None:
        """Sort the rows by columns, first by the last one; equal rows keep their order."""
        order = np.lexsort(by)
        rows.update({name: array[order] for name, array in rows.items()})

    in_order(rows["agent"], rows["episode"], rows["run"])
    of_ant = np.stack([rows[name] for name in ("run", "episode", "agent")])
    last = np.append(np.diff(of_ant).any(axis=0), True) | rows["terminated"]
    # Episodes are in the order in which they began.
    begins = np.flatnonzero(np.append(True, last[:-1]))
    began = np.repeat(rows["step"][begins], np.diff(begins, append=len(last)))
    rows["truncated"] = last & ~rows["terminated"]
    in_order(rows["agent"], began, rows["episode"], rows["run"])
    last = rows["truncated"] | rows["terminated"]
    rows["episode"] = (np.cumsum(last) - last).astype(np.int32)
    return Dataset(**known, **rows)
