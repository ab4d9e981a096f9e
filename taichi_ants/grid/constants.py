"""The directions of the grid, the random streams of a seed, and limits, for the whole package."""

from __future__ import annotations

# The six headings, clockwise, as steps in cube coordinates; heading 0 points up.
HEADING_STEPS: tuple[tuple[int, int, int], ...] = (
    (1, 0, 0),
    (1, 1, 0),
    (0, 1, 0),
    (0, 1, 1),
    (0, 0, 1),
    (1, 0, 1),
)
N_HEADINGS = 6

# The purposes of the random streams of a seed; streams of different purposes never overlap.
STREAM_ANT = 0  # number: the ant
STREAM_ROLLOUT = 1  # number: the greedy rollout
STREAM_START_CELL = 2  # number: the cell, in lexicographic order of (x, y, z)
STREAM_START_HEADING = 3  # number: the ant
STREAM_BORN = 4  # number: episode * 2**32 + the ant
STREAM_QUEEN = 5  # number: 0
STREAM_BRIDGE = 6  # number: the colony at the double bridge of experiments/goss.py
STREAM_TOUR = 7  # number: colony * 2**32 + the ant of experiments/ant_system.py
STREAM_FORAGER = 8  # number: colony * 2**32 + the ant of experiments/utility.py
STREAM_INTERVENTION = 9  # number: 0; for ants that an intervention adds
STREAM_TRAIT = 10  # number: the ant; for its response threshold
STREAM_INDIVIDUAL = 11  # number: the ant; for its exploration rate and its input `trait`

MAX_STEPS = 10_000_000  # the most ticks of an episode
MAX_CASTES = 16
MAX_NESTS = 7  # its number is in three bits of an ant's mark, of which 0 means no ant
MAX_FOOD_KINDS = 8
MOST_REWARD = 1000  # the largest absolute reward of an event
TRAIL = "trail"  # the name of the first pheromone
