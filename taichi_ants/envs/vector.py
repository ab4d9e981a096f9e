"""The bases of all environments: their arguments, and Gymnasium's vector interface."""

from __future__ import annotations

import operator
import os
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.spaces import Discrete
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from taichi_ants.arguments import check_ranges, checked_max_steps, checked_task, checked_world
from taichi_ants.envs.formats import ObservationFormat, ShownObservations
from taichi_ants.errors import AntsError, as_array, check_one_of, shown
from taichi_ants.task import Task
from taichi_ants.task.constants import GIVE, N_ACTIONS, N_STATES, PICK_UP
from taichi_ants.task.states import state_from_index
from taichi_ants.worlds import World, build, from_text

Place = str | os.PathLike[str] | World
Worlds = Place | Sequence[Place]
Rules = Task | str
Step = tuple[np.ndarray, np.ndarray, np.ndarray]  # rewards, terminations, truncations


def _action_masks() -> np.ndarray:
    masks = np.zeros((N_STATES, N_ACTIONS), np.int8)
    for paper_state, mask in enumerate(masks):
        carries, *view = state_from_index(paper_state)
        mask[:PICK_UP] = [code % 2 == 0 for code in view]  # E, T and S can be entered
        mask[GIVE if carries else PICK_UP] = 3 in view
        if not mask.any():  # a dead end, in which moves turn the ant
            mask[:PICK_UP] = 1
    return masks


ACTION_MASKS = _action_masks()  # the actions that can succeed, by the paper's state: int8 (128, 5)


RenderMode = Literal["rgb_array"]
METADATA: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}


class Arguments(NamedTuple):
    """The arguments that all environments have, see `HexForageEnv`."""

    world: Worlds
    task: Rules | None
    max_steps: int
    observation_format: ObservationFormat
    render_mode: str | None


class Ants(ABC):
    """The ants of an environment, in one or more worlds; AntsError if an argument is not allowed.

    Attributes:
        task: The rules.
        worlds: Worlds with the same ranges; world number w is worlds[w % len(worlds)].
        max_steps: The step limit of an episode.
        shown: The format of observations.
        mode: The autoreset mode of vector environments.
        begun: Whether there was a reset.
    """

    mode, begun = AutoresetMode.DISABLED, False

    def __init__(
        self,
        n_worlds: int,
        arguments: Arguments,
        what: str,
        supports: Collection[str],
        instead: str,
    ) -> None:
        task = arguments.task
        if isinstance(task, str):
            check_one_of("task", task, tuple(Task.named()))
            task = Task.named()[task]
        self.task = task = checked_task(task, what, supports, instead)
        self.worlds = _worlds_of(arguments.world, n_worlds, supports)
        self.n_worlds, self.render_mode = n_worlds, arguments.render_mode
        if self.render_mode is not None:
            check_one_of("render_mode", self.render_mode, METADATA["render_modes"])
        self.max_steps = checked_max_steps(arguments.max_steps, task)
        self.shown = ShownObservations(task.sees, arguments.observation_format)
        self._scene: Any = None  # of `draw`

    @abstractmethod
    def begin(self, which: np.ndarray, seeds: Sequence[int | None]) -> None:
        """Begin an episode in the worlds `which`, bool (W,).

        `seeds` has an entry for each of the W worlds. A world with a seed is reset completely; None
        continues its random numbers.
        """

    @abstractmethod
    def advance(self, actions: np.ndarray, waiting: np.ndarray) -> Step:
        """Take a step; return float64 (n,) and bool (n,), as copies.

        `actions` are those of all ants, (n,); `waiting`, bool (W,), marks worlds that had ended.
        """

    @abstractmethod
    def over(self) -> np.ndarray:
        """Return whether the last step ended the episode of each world, bool (W,)."""

    @abstractmethod
    def facts(self, last: bool = False) -> dict[str, np.ndarray]:
        """Return infos of all ants, (n, ...): now or, if `last`, at the end of an episode."""

    @abstractmethod
    def draw(self, world: int) -> Any:
        """Return a picture of a world."""

    def check_begun(self, what: str) -> None:
        """Raise ResetNeeded if there was no reset."""
        if not self.begun:
            raise ResetNeeded(f"no episode has begun; call reset() before {what}.")

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_scene": None}  # `draw` creates it again


def _worlds_of(world: Any, most: int, supports: Collection[str]) -> tuple[World, ...]:
    entries = [world] if isinstance(world, (str, os.PathLike, World)) else world
    if not isinstance(entries, (list, tuple)) or not 0 < len(entries) <= most:
        several = f", or a list of 1 to {most} of them" if most > 1 else ""
        raise AntsError(f"world is {shown(world)}; give the name of a world or a World{several}.")
    built = []
    for entry in entries:
        if not isinstance(entry, World):
            is_map = isinstance(entry, str) and "\n" in entry
            entry = from_text(entry) if is_map else build(entry)
        built.append(checked_world(entry, what="the environment", supports=supports))
    check_ranges(built)
    return tuple(built)


class AntVectorEnv(VectorEnv[Any, Any, Any]):
    """Base of the vector environments.

    With k ants in each world, environment number w * k + i is ant number i of world number w. Each
    info is an array with an entry for each environment. Its mask `_name`, bool (num_envs,), is True
    for environments that have this info.
    """

    metadata = METADATA

    def __init__(self, ants: Ants, num_envs: int, autoreset_mode: str | AutoresetMode) -> None:
        self._ants, self.num_envs, self.render_mode = ants, num_envs, ants.render_mode
        mode = getattr(autoreset_mode, "value", autoreset_mode)
        check_one_of("autoreset_mode", mode, [allowed.value for allowed in AutoresetMode])
        self.autoreset_mode = ants.mode = AutoresetMode(mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space = ants.shown.space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.single_action_space = Discrete(N_ACTIONS)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._all = np.ones(num_envs, bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in all or some worlds.

        Args:
            seed: A whole number, for the seed `seed + w` of each world w, or a list with a seed or
                None for each world. A seed determines all random numbers, so that episodes repeat
                exactly. None continues a world's random numbers; the first reset draws a seed.
            options: {"reset_mask": the environments to reset, bool (num_envs,), whole worlds}.

        Returns:
            Observations (num_envs, ...) and infos.

        Raises:
            ValueError: The seeds or the mask do not have these forms.
            ResetNeeded: The first reset has a mask that leaves out worlds.
        """
        mask = self._mask(options)
        resets = mask.reshape(self._ants.n_worlds, -1)[:, 0]
        super().reset(seed=int(seed) if isinstance(seed, (int, np.integer)) else None)
        seeds = seeds_of(seed, self._ants.n_worlds)
        if not self._ants.begun:
            drawn = self.np_random.integers(2**63, size=self._ants.n_worlds).tolist()
            seeds = [a if b is None else b for a, b in zip(drawn, seeds, strict=True)]
        self._ants.begin(resets, seeds)
        self._ants.begun = True
        facts = self._ants.facts()
        return self._ants.shown.show(facts["state"]), self._infos(facts, mask)

    def _mask(self, options: dict[str, Any] | None) -> np.ndarray:
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return self._all
        mask = as_array("reset_mask", mask, "b", (self.num_envs,))
        by_world = mask.reshape(self._ants.n_worlds, -1)
        if (by_world.any(axis=1) != by_world.all(axis=1)).any():
            raise ValueError("reset_mask has only some ants of a world; give all or none of them.")
        if not mask.all():
            self._ants.check_begun("a reset with a reset_mask")
        return mask

    def step(
        self, actions: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Take the actions of all ants, integers 0 to 4 (num_envs,).

        Returns:
            Observations; rewards, float64; terminated and truncated, bool (num_envs,); infos.

        Raises:
            ResetNeeded: No episode has begun, or autoreset_mode is "Disabled" and one has ended.
            InvalidAction: The number of actions is wrong, or an action does not exist.
        """
        waiting, ants = self._waiting("step"), self._ants
        chosen = checked_actions(actions, (self.num_envs,))
        rewards, terminated, truncated = ants.advance(chosen, waiting)
        over, final = terminated | truncated, dict[str, Any]()
        facts = ants.facts()
        if ants.mode is AutoresetMode.SAME_STEP and over.any():
            last = ants.facts(last=True)
            seen = np.full(self.num_envs, None, dtype=object)
            seen[over] = np.fromiter(ants.shown.show(last["state"][over]), dtype=object)
            final = {"final_obs": seen, "_final_obs": over}
            final |= {"final_info": self._infos(last, over), "_final_info": over.copy()}
            results = {"event", "reason", "deliveries"} & facts.keys()
            facts |= {name: np.where(over, 0, facts[name]) for name in results}  # 0 is NONE
        infos = self._infos(facts, self._all) | final
        return ants.shown.show(facts["state"]), rewards, terminated, truncated, infos

    def _waiting(self, method: str) -> np.ndarray:
        """Return the worlds at an episode's end; ResetNeeded if the method needs a reset before."""
        self._ants.check_begun(f"{method}()")
        if self.autoreset_mode is AutoresetMode.SAME_STEP:  # the next episodes have begun
            return np.zeros(self._ants.n_worlds, bool)
        over = self._ants.over()
        if self.autoreset_mode is AutoresetMode.DISABLED and over.any():
            number = over.argmax() * (self.num_envs // self._ants.n_worlds)
            raise ResetNeeded(
                f"the episode of environment {number} has ended; call reset() with "
                f'options={{"reset_mask": ...}} before {method}().'
            )
        return over

    def _infos(self, facts: dict[str, np.ndarray], have: np.ndarray) -> dict[str, Any]:
        infos: dict[str, Any] = dict(facts)
        if not have.all():
            infos = {
                k: array * (have if array.ndim == 1 else have[:, None])
                for k, array in facts.items()
            }
        return infos | {f"_{name}": have.copy() for name in facts}

    def render(self) -> tuple[Any, ...] | None:
        """Return the world of each environment, as a picture, or None.

        Ants that share a world also share its picture.

        >>> name = "taichi_ants/HexForage-v0"
        >>> ants = gymnasium.make_vec(name, num_envs=2, render_mode="rgb_array")
        >>> seen, infos = ants.reset(seed=0)
        >>> len(ants.render())
        2
        """
        if self.render_mode is None:
            return None
        self._ants.check_begun("render()")
        drawn = map(self._ants.draw, range(self._ants.n_worlds))
        return tuple(
            picture for picture in drawn for _ in range(self.num_envs // self._ants.n_worlds)
        )


def seeds_of(seed: Any, n: int) -> Sequence[int | None]:
    """Return a seed or None for each of n worlds, as Gymnasium does."""
    if seed is None:
        return [None] * n
    if isinstance(seed, (int, np.integer)):
        return range(int(seed), int(seed) + n)
    if np.shape(seed) != (n,):
        raise ValueError(f"seed is {shown(seed)}; give a whole number, or a list of {n}.")
    seeds = [None if entry is None else operator.index(entry) for entry in seed]
    for number in seeds:
        seeding.np_random(number)  # raises Gymnasium's error for negative seeds
    return seeds


def checked_actions(actions: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return actions as an array of integers of a shape; InvalidAction for others."""
    try:
        chosen = np.asarray(actions)
    except ValueError:  # lists of several lengths
        chosen = np.empty(0)
    if chosen.shape != shape or chosen.dtype.kind not in "iu":
        raise InvalidAction(
            f"the actions are {shown(actions)}; they must be an array of an integer type and of "
            f"shape {shape}."
        )
    # A negative number is a large one without its sign.
    if chosen.view(chosen.dtype.str.replace("i", "u")).max() >= N_ACTIONS:
        wrong = chosen[(chosen < 0) | (chosen >= N_ACTIONS)][0]
        raise InvalidAction(f"an action is {wrong}; it must be 0, 1, 2, 3 or 4.")
    return chosen
