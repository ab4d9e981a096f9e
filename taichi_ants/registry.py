"""The registry of learners, observations, worlds, measures and rules: names and what they name."""

import difflib
from collections.abc import Callable, Collection, Mapping
from typing import Any, Generic, TypeVar

from taichi_ants.errors import AntsError, check_word, shown

T = TypeVar("T")


class Registry(Generic[T]):
    """All entries of one kind by name: those of the package, then those that you register.

    Args:
        kind: The word for an entry in messages, such as "learner".
        register: The full name of the function that registers an entry, for messages.
        built_in: The entries of the package by name or, with `load`, anything by their names.
        load: A function that returns the entry of the package with a name, on each use.
        reserved: Further names that you cannot register.

    Attributes:
        yours: The entries that you registered, by name.
    """

    def __init__(
        self,
        kind: str,
        register: str,
        built_in: Mapping[str, Any],
        load: Callable[[str], T] | None = None,
        reserved: Collection[str] = (),
    ) -> None:
        self.kind, self.built_in, self.yours = kind, built_in, dict[str, T]()
        self._register, self._load, self._reserved = register, load, reserved

    def get(self, name: str) -> T:
        """Return the entry of this name; AntsError, with a list of all names, if there is none.

        >>> learners.get("sarsa").draws_next_action
        True
        >>> task.observations.get("ants").n_states
        432
        """
        if isinstance(name, str) and name in self.yours:
            return self.yours[name]
        if not isinstance(name, str) or name not in self.built_in:
            raise self.unknown(name)
        return self._load(name) if self._load else self.built_in[name]

    def names(self) -> tuple[str, ...]:
        """Return the names of all entries: those of the package, then yours as registered.

        >>> "sarsa" in learners.names(), "open" in worlds.names()
        (True, True)
        """
        return (*self.built_in, *self.yours)

    def add(self, name: str, entry: T) -> T:
        """Return an entry after registering it; it replaces your own entry of the same name."""
        self.check_new(name)
        self.yours[name] = entry
        return entry

    def check_new(self, name: object) -> None:
        """Raise AntsError unless you can register an entry by this name."""
        check_word(f"the name of the {self.kind}", name)
        if name in self.built_in or name in self._reserved:
            raise AntsError(
                f"{name!r} is the name of a built-in {self.kind}, which cannot be replaced; choose "
                "another name."
            )

    def unknown(self, name: object, otherwise: str = "") -> AntsError:
        """Return the error for a name that is not registered; `otherwise` is a further way out."""
        names = {known.lower(): known for known in self.names()}
        similar = difflib.get_close_matches(str(name)[:80].lower(), names, 1)
        meant = f" (did you mean {names[similar[0]]}?)" if similar else ""
        known = f"choose one of {', '.join(self.names())}, {otherwise}or " if self.names() else ""
        return AntsError(
            f"there is no {self.kind} {shown(name)}{meant}; {known}register it with "
            f"{self._register}, for commands in a file that you give with --plugin."
        )
