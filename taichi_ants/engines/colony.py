"""The colony: many ants in one world, in many worlds at once; the lockstep engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from taichi_ants import learners, runtime
from taichi_ants.colony_config import SHARINGS, ColonyConfig
from taichi_ants.config import TrainingConfig
from taichi_ants.constants import N_ACTIONS, N_STATES
from taichi_ants.engines import checks, colony_memory
from taichi_ants.errors import AntsError
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]

_LARGE_COLONY = 16_384  # slots from which ants, not worlds, are handed to threads
_ANTS_PER_CHUNK = 2048
_MOST_CHUNKS = 256
_TICK_NS = 150  # of an ant, on a slow core, planning left out
_LAUNCH_SECONDS = 0.4


@dataclass(frozen=True)
class ColonyEpisodes:
    """What episodes gave, arrays of shape (episodes, worlds).

    Attributes:
        returns: int64, rewards of all ants.
        ticks: int32, length.
        deliveries: int32, foods given to the queen.
        first_delivery: int32, ticks until the first delivery; -1 if there was none.
        moves: int32, moves that ants tried.
        blocked: int32, moves that failed.
        births, deaths: int32, ants.
        regrown: int32, foods that grew back.
        living: int32, ants at the end.
    """

    returns: np.ndarray
    ticks: np.ndarray
    deliveries: np.ndarray
    first_delivery: np.ndarray
    moves: np.ndarray
    blocked: np.ndarray
    births: np.ndarray
    deaths: np.ndarray
    regrown: np.ndarray
    living: np.ndarray


class Colony:
    """Colonies of ants, one in each of W worlds, that act and learn in lockstep.

    A colony depends on its world, its configurations and its seed alone: not on the other worlds,
    the number of threads or the schedule.

    Args:
        world: One world for all seeds, or one for each, of the same ranges.
        config: How many ants, their pheromone, and what comes and goes.
        training: The learner and its settings.
        seeds: One seed for each of the W worlds.
        sharing: "shared": one table for all ants of a world. "own": one for each slot. "fixed":
            nobody learns.
        q_values: Action values to start from, float (128, 5) or (W, 128, 5); None: zeros.
        threads: CPU threads; None keeps what runs, or takes all.
        arch: "cpu" or "cuda"; None keeps what runs, or takes the CPU.
        schedule: "by_world" hands worlds to threads, "by_chunk" groups of ants; None chooses by
            size. Both give the same numbers.

    Raises:
        AntsError: An argument is not allowed, or a world has too few free cells for the ants.
    """

    def __init__(
        self,
        world: World | Sequence[World],
        config: ColonyConfig,
        training: TrainingConfig,
        seeds: int | Sequence[int] = 0,
        sharing: str = "shared",
        q_values: np.ndarray | None = None,
        threads: int | None = None,
        *,
        arch: str | None = None,
        schedule: str | None = None,
    ) -> None:
        if not isinstance(config, ColonyConfig):
            raise AntsError(f"config is {config!r}; it must be a ColonyConfig.")
        (self.training,) = checks.checked_configs(training)
        self.config = config
        self.seeds = checks.checked_seeds(seeds)
        self.sharing = _one_of("sharing", sharing, SHARINGS)
        self._learner = learners.get(training.learner)
        self._settings = runtime.start(threads, arch)
        several = (world,) * len(self.seeds) if isinstance(world, World) else tuple(world)
        if len(several) != len(self.seeds):
            raise AntsError(f"there are {len(several)} worlds for {len(self.seeds)} seeds.")
        self._layout = colony_memory.Layout(
            [checks.checked_world(one) for one in several], config, self.seeds
        )
        large = config.slots >= _LARGE_COLONY
        self._schedule = _one_of(
            "schedule", schedule or ("by_chunk" if large else "by_world"), ("by_world", "by_chunk")
        )
        chunks = 1
        if self._schedule == "by_chunk":
            chunks = min(_MOST_CHUNKS, -(-config.slots // _ANTS_PER_CHUNK))
        self._chunks = chunks
        words = np.array([seed % 2**64 for seed in self.seeds], dtype=np.uint64)
        plans = self._learner.plans and sharing != "fixed"
        self._arrays = colony_memory.allocate(
            self._layout, config, self.training, words, sharing, plans, chunks
        )
        table = None if q_values is None else checks.checked_q_values(q_values)
        tables = colony_memory.allocate_tables(len(self.seeds), config.slots, sharing, table)
        self._arrays["q"] = tables
        self.epsilon = float(self.training.epsilon)
        self.episode = -1
        self.ticks = 0

    def begin_episode(self) -> None:
        """Set worlds and ants to their start; the ants look around."""
        from taichi_ants.engines.colony_kernels import BEGIN

        self.episode += 1
        self.ticks = 0
        colony_memory.fill_episode(self._arrays, self._layout, self.config, self.epsilon)
        self._launch(BEGIN, 0, 1)

    def tick(self, n: int = 1) -> None:
        """Let n ticks pass; worlds whose episode has ended stand still."""
        from taichi_ants.engines.colony_kernels import BY_CHUNK, BY_WORLD, END, PLAN

        if self.episode < 0:
            raise AntsError("no episode has begun; call begin_episode first.")
        n = checks.checked_count("n", n)
        if self._schedule == "by_world":
            self._launch(BY_WORLD, self.ticks, n)
            self.ticks += n
            return
        for _ in range(n):
            self._launch(BY_CHUNK, self.ticks, 1)
            if self._learner.plans and self.sharing == "shared":
                for _ in range(self.training.planning_steps):
                    self._launch(PLAN, self.ticks, 1)
            config = self.config
            if config.births or config.lifespan or config.ends_at_delivery:
                self._launch(END, self.ticks, 1)
            self.ticks += 1

    def end_episode(self) -> None:
        """Keep the streams of the ants that start an episode, and let epsilon decay."""
        from taichi_ants.engines import colony_arrays as names

        ants = self._arrays["ants"]
        first = (ants[names.LIFE] != names.VACANT) & (ants[names.NUMBER] < self.config.ants)
        (columns,) = np.nonzero(first & (ants[names.NUMBER] >= 0))
        slots = self.config.slots
        places = columns // slots * slots + ants[names.NUMBER, columns]
        self._arrays["first_streams"][places] = self._arrays["streams"][columns]
        decayed = self.epsilon * float(self.training.epsilon_decay)
        self.epsilon = max(float(self.training.min_epsilon), decayed)

    def run(self, episodes: int, ticks: int, progress: Progress | None = None) -> ColonyEpisodes:
        """Whole episodes of a fixed number of ticks.

        Args:
            episodes: How many.
            ticks: Ticks of each.
            progress: Called now and then with the share of the work that is done.
        """
        episodes = checks.checked_count("episodes", episodes)
        ticks = checks.checked_max_steps(ticks)
        outcomes = []
        for episode in range(episodes):
            self.begin_episode()
            while self.ticks < ticks and self._arrays["worlds"][0].any():
                self.tick(min(self._ticks_per_launch(), ticks - self.ticks))
                if progress is not None:
                    progress((episode + self.ticks / ticks) / episodes)
            outcomes.append(self.outcome())
            self.end_episode()
        return ColonyEpisodes(
            **{name: np.stack([vars(one)[name][0] for one in outcomes])
               for name in vars(outcomes[0])}
        )  # fmt: skip

    def outcome(self) -> ColonyEpisodes:
        """What the episode has given so far, arrays (1, W)."""
        from taichi_ants.engines import colony_arrays as names

        rows = {
            "ticks": names.TICKS,
            "deliveries": names.DELIVERED,
            "first_delivery": names.FIRST_DELIVERY,
            "moves": names.MOVES,
            "blocked": names.BLOCKED,
            "births": names.BORN,
            "deaths": names.DIED,
            "regrown": names.REGROWN,
            "living": names.LIVING_ANTS,
        }
        counts = {name: self._arrays["worlds"][row][None].copy() for name, row in rows.items()}
        return ColonyEpisodes(returns=self._arrays["returns"][None].copy(), **counts)

    @property
    def q_values(self) -> np.ndarray:
        """The action values, float32 (W, 128, 5), or (W, slots, 128, 5) with own tables; a copy."""
        n = self.config.slots if self.sharing == "own" else 1
        tables = self._arrays["q"].reshape(len(self.seeds), n, N_STATES, -1)[..., :N_ACTIONS]
        return (tables if self.sharing == "own" else tables[:, 0]).copy()

    def _ticks_per_launch(self) -> int:
        if self._schedule == "by_chunk":
            return 1
        rounds = -(-len(self.seeds) // self._settings.threads)
        cost = _TICK_NS * (1 + self.training.planning_steps)
        if self.config.pheromone.dense:
            cost += 2 * self._layout.size / self.config.slots
        return max(1, int(_LAUNCH_SECONDS * 1e9 / (rounds * self.config.slots * cost)))

    def _launch(self, what: str, tick: int, n: int) -> None:
        from taichi_ants.engines.colony_arrays import Arrays, Settings
        from taichi_ants.engines.colony_kernels import colony_kernel

        dense = self.config.pheromone.dense
        kernel = colony_kernel(self._learner, self.sharing, dense, what)
        numbers = Settings(**self._numbers())
        kernel(tick, n, *numbers, *Arrays(**self._arrays))

    def _numbers(self) -> dict[str, int | float]:
        config, pheromone = self.config, self.config.pheromone
        off = -1
        decay = {"linear": -1.0, "none": 1.0}.get(pheromone.evaporation, pheromone.decay)
        return {
            "worlds": len(self.seeds),
            "ants": config.ants,
            "slots": config.slots,
            "chunks": self._chunks,
            "size": self._layout.size,
            "homes": self._layout.homes,
            "episode": self.episode,
            "evaporates": int(pheromone.evaporation == "linear"),
            "adds": {"add": 1, "set": 0, "none": -1}[pheromone.deposit],
            "level": pheromone.level,
            "cap": pheromone.cap,
            "decay": float(decay),
            "share": float(pheromone.share) if pheromone.diffusion else 0.0,
            "births": int(config.births),
            "lifespan": config.lifespan or off,
            "regrowth": off if config.regrowth is None else config.regrowth,
            "wander": config.wander or off,
            "ends_at_delivery": int(config.ends_at_delivery),
            "planning_steps": self.training.planning_steps,
            "continuing": int(self.training.delivery == "continuing"),
        }


def _one_of(name: str, value: str, allowed: Sequence[str]) -> str:
    if value not in allowed:
        raise AntsError(f"{name} is {value!r}; it must be one of {', '.join(allowed)}.")
    return value
