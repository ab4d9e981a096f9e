"""The settings that a learner has besides those of all learners, as a dataclass of numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from taichi_ants.errors import AntsError, checked_whole, shown


def number(usual: float, least: float, most: float) -> Any:
    """A field that is a number from `least` to `most`, a whole one if `usual` is an int."""
    return field(default=usual, metadata={"kind": type(usual), "least": least, "most": most})


@dataclass(frozen=True)
class Hyperparameters:
    """Base of the hyperparameters of a learner; as such, none.

    Fields are made by `number`; kernels get whole numbers as i32 and others as f32.

    Raises:
        AntsError: A value is outside its range.
    """

    def __post_init__(self) -> None:
        for one in fields(self):
            name, value = one.name, getattr(self, one.name)
            if "kind" not in one.metadata:
                raise AntsError(f"{name} is no number; make the field by number(...).")
            kind, least, most = one.metadata["kind"], one.metadata["least"], one.metadata["most"]
            if kind is int:
                checked_whole(name, value, least, most)
            elif not least <= value <= most:
                raise AntsError(
                    f"{name} is {shown(value)}; it must lie between {least} and {most}."
                )
            object.__setattr__(self, name, kind(value))
