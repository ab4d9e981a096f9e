"""The constants of the rules, which all packages share."""

from __future__ import annotations

from enum import IntEnum, auto

from taichi_ants.grid.constants import MAX_CASTES as MAX_CASTES
from taichi_ants.grid.constants import MAX_FOOD_KINDS as MAX_FOOD_KINDS
from taichi_ants.grid.constants import MAX_NESTS as MAX_NESTS
from taichi_ants.grid.constants import MAX_STEPS as MAX_STEPS
from taichi_ants.grid.constants import MOST_REWARD as MOST_REWARD

# Codes of the cells in view (two bits each in a state index).
SEES_EMPTY = 0  # E
SEES_OBSTACLE = 1  # O
SEES_CUE = 2  # T without food (a trail), S with food (nearer to the queen)
SEES_GOAL = 3  # F without food, Q with food

# The content of a cell (uint8) is how ants see it: the lower two bits are the code for an ant
# without food, the next two for an ant with food. Cells outside the world are OBSTACLE.
EMPTY = SEES_EMPTY | SEES_EMPTY << 2
OBSTACLE = SEES_OBSTACLE | SEES_OBSTACLE << 2
FOOD = SEES_GOAL | SEES_OBSTACLE << 2
QUEEN = SEES_OBSTACLE | SEES_GOAL << 2

# Actions. The first three are moves, relative to the heading.
LEFT, FORWARD, RIGHT, PICK_UP, GIVE = 0, 1, 2, 3, 4
ACTION_NAMES: tuple[str, ...] = ("left", "forward", "right", "pick up", "give")
N_ACTIONS = 5
# Numbers in a row of action values: 5, and 3 more, so that no row straddles a cache line.
ROW = 8
# In a colony, unless each ant learns into its own table, one of these numbers is the state's best
# actions: the sum of 2^a for each action a with the largest value.
BEST_AT = N_ACTIONS

# State = (carries, left, forward, right); index = 64 * carries + 16 * left + 4 * forward + right.
N_STATES = 128

# A trail stores the tick at which it has evaporated, so a level plus a step must fit into 32 bits.
MAX_TRAIL_LEVEL = 1_000_000_000

# The default length of training, as in the paper: the episodes of one ant, and their step limit.
EPISODES = 500
EPISODE_STEPS = 600


class Event(IntEnum):
    """The result of an ant's last action; for a move, the code of the cell plus 1."""

    NONE = 0  # the ant has not acted in this episode
    ENTERED_EMPTY = SEES_EMPTY + 1
    BLOCKED = auto()  # a move that only turned the ant
    ENTERED_CUE = SEES_CUE + 1  # a cell seen as T or S
    PICKED_UP = auto()
    DELIVERED = auto()
    FAILED = auto()  # a pick-up or a delivery that was not possible
    PUSHED = auto()  # a carrier changed places with this ant; in colonies only


class Reason(IntEnum):
    """The reason why the action of a lone ant failed: `info["reason"]`."""

    NONE = 0  # the action succeeded
    ROCK_OR_EDGE_AHEAD = auto()
    FOOD_AHEAD = auto()
    QUEEN_AHEAD = auto()
    CARRIES_FOOD_ALREADY = auto()
    NO_FOOD_IN_VIEW = auto()
    CARRIES_NO_FOOD = auto()
    NO_QUEEN_IN_VIEW = auto()
