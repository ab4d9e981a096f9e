"""Who may enter a cell on which another ant stands."""

from __future__ import annotations

from dataclasses import dataclass, fields

from taichi_ants.errors import AntsError, check_one_of, checked_flag


@dataclass(frozen=True)
class Traffic:
    """Who may enter a cell on which another ant stands; nobody by default, as in the paper.

    Where somebody may, every ant that tries to move claims the cell ahead of it, unless a rock,
    food, the queen or the end of the world is there. Of several claims to a cell the one with the
    smallest hash wins, see `docs/colony.md`.

    Attributes:
        swap: Right of way. An ant with food that wins a cell changes places with the ant on it, if
            that ant has no food, does not move itself, and does not pick up a food in view. The
            ant that is pushed is paid as for a move onto an empty cell.
        follow: A cell that its ant leaves in the same tick can be entered. So a queue moves as one.
            A ring of ants that want each other's cells stays where it is.
        carriers_first: An ant with food wins a cell against all ants without.
        grant: A pushed ant that wanted the cell onto which it is pushed is paid for the move that
            it wanted; with `swap` only.

    Raises:
        AntsError: A value is no flag, or would change nothing.
    """

    swap: bool = False
    follow: bool = False
    carriers_first: bool = False
    grant: bool = False

    def __post_init__(self) -> None:
        for one in fields(self):
            object.__setattr__(self, one.name, checked_flag(one.name, getattr(self, one.name)))
        if self.grant and not self.swap:
            raise AntsError("grant is True, but no ant is pushed; give swap=True with it.")
        if self.carriers_first and not self.shared:
            raise AntsError(
                "carriers_first is True, but all cells with ants are closed; give swap=True or "
                "follow=True with it."
            )

    @classmethod
    def named(cls, name: str) -> Traffic:
        """The traffic of a name: "blocking", "right_of_way" or "following".

        Raises:
            AntsError: There is no such name.
        """
        check_one_of("traffic", name, tuple(_NAMED))
        return _NAMED[name]

    @property
    def shared(self) -> bool:
        """Whether any ant may enter a cell on which another one stands."""
        return self.swap or self.follow


_NAMED = {
    "blocking": Traffic(),
    "right_of_way": Traffic(swap=True),
    "following": Traffic(swap=True, follow=True, carriers_first=True, grant=True),
}
