"""The numbers that the rules of the world fix, shared by every part of the package.

They stand here once so that kernels, reference, analysis and documentation cannot drift apart.
"""

from __future__ import annotations

# What an ant sees in a cell (two bits each in a state's index).
SEES_EMPTY = 0  # E
SEES_OBSTACLE = 1  # O
SEES_LURE = 2  # T without food (a trail), S with food (nearer to the queen)
SEES_GOAL = 3  # F without food, Q with food

# What a cell holds (unsigned 8-bit arrays), written as how it looks: the lower two bits to an ant
# without food, the next two to an ant with food. Cells outside the world are OBSTACLE.
EMPTY = SEES_EMPTY | SEES_EMPTY << 2
OBSTACLE = SEES_OBSTACLE | SEES_OBSTACLE << 2
FOOD = SEES_GOAL | SEES_OBSTACLE << 2
QUEEN = SEES_OBSTACLE | SEES_GOAL << 2

# Actions. The first three are moves, relative to the heading.
LEFT, FORWARD, RIGHT, PICK_UP, GIVE = 0, 1, 2, 3, 4
ACTION_NAMES: tuple[str, ...] = ("left", "forward", "right", "pick up", "give")
N_ACTIONS = 5
# A row of a table of action values in memory: 5, and 3 unused, so that none straddles a cache line.
ROW = 8

# State = (carries, left, forward, right); index = 64 * carries + 16 * left + 4 * forward + right.
N_STATES = 128

# The largest reward of an event, either way.
MOST_REWARD = 1000

# The trail level that a carrying ant sets.
DEPOSIT_LEVEL = 250
# Levels and steps share 32-bit integers (a trail stores the tick at which it has evaporated).
MAX_TRAIL_LEVEL = 1_000_000_000
MAX_STEPS = 10_000_000

# The usual length of training, as in the paper: how many episodes of one ant, and their step limit.
EPISODES = 500
EPISODE_STEPS = 600
