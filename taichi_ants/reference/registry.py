"""Where the reference knows its learners and observations by name."""

from __future__ import annotations

from typing import TypeVar

from taichi_ants.errors import AntsError

T = TypeVar("T")


class Registry(dict[str, T]):
    """Things of one kind by name, in the order of their registration."""

    def __init__(self, kind: str) -> None:
        """Begin with none; `kind` is what messages call them."""
        super().__init__()
        self._kind = kind

    def register(self, name: str, thing: T) -> None:
        """Make a thing known under a name.

        Raises:
            AntsError: The name is taken.
        """
        if name in self:
            raise AntsError(
                f"the reference has the {self._kind} {name!r} already; choose another name."
            )
        self[name] = thing

    def __missing__(self, name: str) -> T:
        raise AntsError(
            f"the reference has no {self._kind} {name!r}; it must be one of {', '.join(self)}."
        )
