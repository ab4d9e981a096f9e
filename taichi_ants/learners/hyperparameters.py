"""The settings that a learner has besides those of all learners."""

from __future__ import annotations

from dataclasses import dataclass, fields

from taichi_ants.errors import AntsError
from taichi_ants.settings import Settings, declared


@dataclass(frozen=True)
class Hyperparameters(Settings, path="training"):
    """Base of the hyperparameters of a learner; as such, none.

    Each field is declared as `Annotated[int, Is(...)]` or `Annotated[float, Is(...)]`, for kernels
    i32 and f32. AntsError if a value is outside its range, or a field is not declared so.
    """

    def __post_init__(self) -> None:
        kinds = {one.name: one.kind for one in declared(type(self))}
        for one in fields(self):
            if kinds.get(one.name) not in (int, float):
                raise AntsError(
                    f"the field {one.name} has the type {one.type}; declare it as "
                    "Annotated[int, Is(...)] or Annotated[float, Is(...)]."
                )
        self.check()
