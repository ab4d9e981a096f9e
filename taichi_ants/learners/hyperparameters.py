"""The settings that a learner has besides those of all learners, as a dataclass of numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from taichi_ants.errors import AntsError, check_whole, shown

MAX_PLANNING_STEPS = 1000


def whole_number(usual: int, least: int, most: int) -> Any:
    """A field that is a whole number from `least` to `most`."""
    return field(default=usual, metadata={"kind": int, "least": least, "most": most})


def number(usual: float, least: float, most: float) -> Any:
    """A field that is a number from `least` to `most`."""
    return field(default=usual, metadata={"kind": float, "least": least, "most": most})


@dataclass(frozen=True)
class Hyperparameters:
    """Base of the hyperparameters of a learner; as such, none.

    Fields are made by `whole_number` and `number`; kernels get them as i32 and f32.

    Raises:
        AntsError: A value is outside its range.
    """

    def __post_init__(self) -> None:
        for one in fields(self):
            value, least, most = (
                getattr(self, one.name),
                one.metadata["least"],
                one.metadata["most"],
            )
            if one.metadata["kind"] is int:
                check_whole(one.name, value, least, most)
            elif isinstance(value, bool) or not isinstance(value, (int, float)):
                raise AntsError(f"{one.name} is {shown(value)}; it must be a number.")
            elif not least <= value <= most:
                raise AntsError(
                    f"{one.name} is {shown(value)}; it must lie between {least} and {most}."
                )
            object.__setattr__(self, one.name, one.metadata["kind"](value))
