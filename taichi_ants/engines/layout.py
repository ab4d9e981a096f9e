"""Names of the columns and rows of arrays that engines and kernels share; no Taichi here."""

from enum import IntEnum, auto

# The settings of a run, columns in front of the hyperparameters of its learner.
SETTINGS = (
    *("discount", "epsilon_decay", "least_epsilon"),
    *("learning_rate_decay", "least_learning_rate"),
)
N_SETTINGS = len(SETTINGS)
DISCOUNT, EPSILON_DECAY, MIN_EPSILON, LEARNING_RATE_DECAY, MIN_LEARNING_RATE = range(N_SETTINGS)

# What the episodes of a run give.
OUTCOMES = ("returns", "steps", "deliveries")
RETURNS, STEPS, DELIVERIES = range(len(OUTCOMES))

# The columns of a trace, one row a step; the fields of `Trace` of these names.
TRACE = (
    *("episodes", "steps", "cells", "headings", "percepts", "states", "actions", "rewards"),
    *("next_percepts", "next_states", "terminated", "events"),
)


class Command(IntEnum):
    """What an ant of a batch is told to do."""

    STEP = 0
    BEGIN = auto()  # an episode
    WAIT = auto()
