"""How many ants a colony has, and where they start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from taichi_ants.errors import AntsError, check_one_of, check_whole, checked_flag
from taichi_ants.learners.registry import Learner
from taichi_ants.task import Task
from taichi_ants.worlds.starts import STARTS, Start

Sharing = Literal["shared", "own", "fixed"]
SHARINGS: tuple[str, ...] = get_args(Sharing)
MAX_ANTS = 1 << 24


@dataclass(frozen=True)
class Population:
    """The ants of a colony, see `Colony` for the arguments of `of`.

    Attributes:
        ants: How many start each episode.
        slots: How many can live at once.
        start: Where those start that the World does not list.
        ends_at_delivery: Whether an episode ends at its first delivery.
    """

    ants: int
    slots: int
    start: Start
    ends_at_delivery: bool

    @classmethod
    def of(
        cls, task: Task, ants: int, capacity: int | None, start: Start, ends_at_delivery: bool
    ) -> Population:
        """Checks the arguments; without a capacity there is room for the ants that are born.

        Raises:
            AntsError: A value is outside its range, or does not fit the others.
        """
        check_whole("ants", ants, 1, MAX_ANTS)
        if capacity is not None:
            check_whole("capacity", capacity, 1, MAX_ANTS)
            if capacity < ants:
                raise AntsError(
                    f"capacity is {capacity}, but {ants} ants start; give a capacity of at least "
                    f"{ants}, or None."
                )
        check_one_of("start", start, STARTS)
        checked_flag("ends_at_delivery", ends_at_delivery)
        if ends_at_delivery and (ants != 1 or task.life.births):
            raise AntsError(
                f"ends_at_delivery is set with {ants} ants and births {task.life.births}; it is "
                "for one ant without births, so leave it out."
            )
        room = min(2 * ants + 64, MAX_ANTS) if task.life.births else ants
        return cls(int(ants), int(capacity or room), start, bool(ends_at_delivery))


def check_sharing(learner: Learner, sharing: str) -> None:
    """Refuse a learner that cannot learn in a colony, or not into a table that others share."""
    if learner.needs_episode_end:
        raise AntsError(
            f"learner {learner.name!r} needs to know the last step of an episode, which the ants "
            "of a colony do not; take another one, or train one ant by train(...)."
        )
    if sharing == "shared" and learner.td_error is None:
        raise AntsError(
            f"learner {learner.name!r} keeps a memory of its own, so ants cannot share its table; "
            'take sharing="own".'
        )
