"""Who may enter a cell on which another ant stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from taichi_ants.errors import AntsError
from taichi_ants.settings import Is, Settings


@dataclass(frozen=True)
class Traffic(Settings, path="task.traffic"):
    """The ants that may enter a cell on which another ant stands; none by default, as in the paper.

    Where some may, every ant that tries to move claims the cell ahead of it, unless a rock, food,
    the queen or the end of the world is there. Of several claims to a cell the one with the
    smallest hash wins, see `docs/colony.md`. With `swap`, an ant with food that wins a cell changes
    places with the ant on it, if that ant has no food, does not move itself, and does not pick up a
    food in view; the ant that is pushed is paid as for a move onto an empty cell. With `follow`, a
    queue moves as one; a ring of ants that want each other's cells stays where it is.

    Raises:
        AntsError: A value is not a flag, or would change nothing.
    """

    swap: Annotated[bool, Is("let ants with food change places with ants without")] = False
    follow: Annotated[bool, Is("let ants enter a cell that its ant leaves in the same tick")] = (
        False
    )
    carriers_first: Annotated[bool, Is("let ants with food win a cell against ants without")] = (
        False
    )
    grant: Annotated[
        bool, Is("pay a pushed ant for the move that it wanted, if it got it", only=("swap", True))
    ] = False

    def __post_init__(self) -> None:
        self.check()
        if self.carriers_first and not self.shared:
            raise AntsError(
                "`task.traffic.carriers_first` is True; leave it out unless `swap` or `follow` is "
                "True."
            )

    @classmethod
    def named(cls) -> Mapping[str, Traffic]:
        """Values that have names."""
        return {
            "blocking": cls(),
            "right_of_way": cls(swap=True),
            "following": cls(swap=True, follow=True, carriers_first=True, grant=True),
        }

    @property
    def shared(self) -> bool:
        """Whether any ant may enter a cell on which another one stands."""
        return self.swap or self.follow
