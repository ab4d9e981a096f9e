"""The submodels of ODD descriptions: the text for each value of a setting that selects a rule.

`{name}` in a text stands for the value of a setting of the same group.
"""

from __future__ import annotations

CHOICE = {
    "greedy": (
        "With probability ε, the exploration rate, the ant takes one of the five actions, drawn "
        "uniformly. Otherwise it takes an action a with the largest value `Q(s, a)` in its state "
        "s; ties are broken at random with equal probability."
    ),
    "softmax": (
        "With probability ε, the exploration rate, the ant takes one of the five actions, drawn "
        "uniformly. Otherwise it takes action a with probability `exp(Q(s, a) / T) / Σ exp(Q(s, "
        "b) / T)`, where b runs over the five actions and the temperature T is {temperature}."
    ),
    "deneubourg": (
        "The ant gives if it carries food and sees the queen, and picks up if it carries none and "
        "sees food. Otherwise it enters open cell i of the three cells ahead with probability `(k "
        "+ c_i)^n / Σ (k + c_j)^n`. Here c is the trail level of a cell, k is {k}, n is "
        "{exponent}, and j runs over the open cells ahead. An ant with food considers only open "
        "cells nearer to its queen, if there are any. If no cell is open, the ant turns left or "
        "right with probability 0.5 each. The rule is that of Deneubourg et al. (1990)."
    ),
}
EVAPORATION = {
    "linear": "In each tick, the level c of each cell becomes `max(c - 1, 0)`.",
    "exponential": (
        "In each tick, the level c of each cell becomes `c · 2^(-1 / h)`, where the half-life h "
        "is {half_life}. A level that falls below 1 becomes 0."
    ),
    "none": "Levels do not evaporate.",
}
DEPOSIT = {
    "set": "A deposit sets the level of the cell: `c = {level}`.",
    "add": "A deposit adds to the level of the cell: `c = min(c + {level}, {cap})`.",
    "fading": (
        "A deposit raises the level of the cell: `c = max(c, {level} - {slope} · a)`. Here a is "
        "the number of ticks since the ant last picked up or delivered food, or since its birth or "
        "the start of the episode if it has not yet done so."
    ),
    "none": "Ants make no deposits.",
}
DIFFUSION = (
    "Then each cell gives the share {diffusion} / 6 of its level to each of its six neighbours. "
    "The parts for obstacles and for cells outside of the world stay in the cell."
)
VIEW = {
    "half": (
        "an empty cell whose level is at least 1 and at least half of the highest level among the "
        "empty cells in view"
    ),
    "strongest": (
        "an empty cell whose level is at least 1 and equal to the highest level among the empty "
        "cells in view"
    ),
    "strongest_under_carriers": (
        "an empty cell whose level is at least 1 and equal to the highest level in view, where "
        "levels under ants with food count too"
    ),
}
LAID = {
    "with_food": (
        "Ants deposit on each cell that they enter with food and, when they pick up food, on the "
        "cell of the food and on their own cell."
    ),
    "without_food": (
        "Ants deposit on each cell that they enter without food and, when they deliver, on their "
        "own cell."
    ),
    "always": "Ants deposit on each cell that they enter, and when they pick up or deliver.",
    "dead_end": "An ant without food that sees three obstacles deposits on its cell.",
    "failed_pick_up": "An ant that fails to pick up food deposits on its cell.",
    "never": "Ants never deposit.",
}
DELIVERY = {
    "terminates": "At a delivery the target of the update is the reward alone.",
    "truncates": "At a delivery the target also contains the value of the next state.",
}
TRAFFIC = {
    "swap": (
        "An ant with food that wins a cell changes places with an ant without food on it, unless "
        "that ant enters a cell itself or tries to pick up food. The pushed ant gets the reward "
        "of a move onto an empty cell."
    ),
    "follow": (
        "An ant can enter a cell whose ant leaves it in the same tick, so queues move at once. A "
        "ring of ants that claim each other's cells does not move."
    ),
    "carriers_first": "For a cell, ants with food win against ants without food.",
    "grant": ("An ant that is pushed onto the cell that it wanted gets the reward of that move."),
}
CONFLICTS = (
    "If several ants want one cell or one food item, the ant wins whose cell has the smallest "
    "hash `mix((mix(number(cell) + γ) xor tick) + γ)`. `mix` is the output function of SplitMix64 "
    "and γ is 0x9E3779B97F4A7C15. The others are blocked, turn, and get the reward of a failure."
)
NO_TRAFFIC = "An ant enters a cell only if it was empty at the start of the tick."
LEARNERS = {
    "q_learning": "r + γ max_b Q(s', b)",
    "sarsa": "r + γ Q(s', a'), where the ant draws a' before the update and then takes it",
    "expected_sarsa": "r + γ E[Q(s', a')], the expectation under the epsilon-greedy policy",
    "dyna_q": (
        "r + γ max_b Q(s', b), followed by {planning_steps} updates of pairs (s, a) that are "
        "drawn uniformly from all visited pairs, each with its last outcome"
    ),
    "double_q": (
        "r + γ Q_B(s', argmax_b Q_A(s', b)), for table A or B drawn at random; the ant acts on "
        "the mean of both tables"
    ),
    "sarsa_lambda": (
        "r + γ Q(s', a'); the error also changes the last {trace_length} pairs, in proportion to "
        "replacing traces that fade by γ · {trace_decay} per step"
    ),
    "n_step_sarsa": "the sum of {n_steps} discounted rewards and the discounted value after them",
    "prioritized_sweeping": (
        "r + γ max_b Q(s', b), in at most {planning_steps} updates from a model of all visited "
        "pairs, the largest errors first, without errors up to {threshold}"
    ),
}
SHARING = {
    "shared": (
        "All ants of a nest learn into one table. They choose by the table at the start of the "
        "tick. If n ants update a value in one tick, its change is `(1 - (1 - α)^n)` times the "
        "mean of their errors."
    ),
    "independent": "Each ant has its own table.",
}
LABOUR = {
    "none": "All ants forage.",
    "thresholds": (
        "Each nest has a stimulus s, which is 0 at the start of an episode, rises by {demand} per "
        "tick, and falls by {relief} with each delivery, but not below 0. An idle ant with "
        "threshold t starts to forage with probability `s^n / (s^n + t^n)` per tick, where n is "
        "{exponent}. A forager without food next to its queen becomes idle with probability "
        "{quit} per tick. The rule is that of Bonabeau, Theraulaz and Deneubourg (1996)."
    ),
}
WORLDS = {
    "paper": (
        "the world of the paper: ranges (10, 10, 10) with 271 cells, the queen at (0, 9, 9), one "
        "food item at (9, 0, 0), and a trail of level 25 on the 17 cells (i, 0, 0) with i from -8 "
        "to 8"
    ),
    "open": (
        "an open world with the queen at the origin, rocks (hexagons of random radius and place), "
        "single food items at random places, and piles of food on the three axes"
    ),
    "far_piles": (
        "a world with the queen at the origin, rocks (hexagons of random radius and place), and "
        "food only in piles far from the queen"
    ),
    "double_bridge": "a nest and a pile of food that a short and a long branch connect",
}
