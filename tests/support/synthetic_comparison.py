"""Synthetic comparisons from a known truth, which the analysis must find.

Each configuration has explicit numbers. By default all claims of the paper are clearly true.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from paper.comparison import (
    DYNA_P3,
    GRID,
    Q_LEARNING,
    SARSA,
    VARIANTS,
    Comparison,
    GridPoint,
    Row,
    Variant,
)
from paper.figures import curves_of, spans, sums

from taichi_ants.analysis.behaviour import DELIVERS, WALKS
from taichi_ants.measures.finished import Run, values_of

EARLY = 50  # number of early episodes
EPISODES = ("returns", "steps", "deliveries")
ROLLOUTS = tuple(f"greedy_{name}" for name in EPISODES)


@dataclass(frozen=True)
class Truth:
    """The means around which the runs of one configuration vary."""

    early_return: float  # in the first `EARLY` episodes
    late_return: float
    swing: float  # added to the return of odd episodes, subtracted in even ones
    early_steps: float
    late_steps: float
    steps_swing: float
    deliveries: float = 1.0  # probability in an episode
    greedy_return: int = 45  # of each rollout, as what follows; without a delivery, the ant walks
    greedy_steps: int = 35
    greedy_deliveries: int = 1
    greedy_varies: bool = False  # whether rollouts of one run differ


@dataclass(frozen=True, eq=False, kw_only=True)
class Made(Comparison):
    """A comparison with its episodes."""

    arrays: dict[str, np.ndarray]


Edit = Callable[[Variant, GridPoint, Truth], Truth]


def paper_truth(variant: Variant, point: GridPoint) -> Truth:
    """Return a truth for which all claims of the paper hold."""
    fast = point.learning_rate == 0.01
    # Effects of the discount that differ between configurations, with a mean of zero.
    twist = 3 if (point.epsilon == 0.3) == (point.epsilon_decay == 0.99) else -3
    twist = twist if point.discount == 0.99 else 0
    if variant == Q_LEARNING:
        moderate = point.epsilon == 0.3 and point.epsilon_decay == 0.99
        late = 50.0 - 4 * fast + 2 * (point.discount == 0.99) - 1.8 * (not moderate)
        return Truth(20, late, 2 + 2 * fast, 130, 80 + 2 * (late - 46), 2)
    if variant == SARSA:
        return Truth(20, 46 - 3 * fast + twist, 1, 60, 56, 0)
    high = point.epsilon == 0.5
    late = 48 - 3 * fast + twist
    if variant == DYNA_P3:
        return Truth(20, late, 4 + 4 * fast, 130, 64 + 6 * high, 8)
    special = high and point.discount == 0.99 and point.epsilon_decay == 0.995
    return Truth(20, late + (0.6 if special else -1), 6 + 6 * fast, 130, 72 + 10 * high, 12)


def level_truth(variant: Variant, point: GridPoint) -> Truth:
    """Return a truth in which nothing has an effect."""
    return Truth(45, 45, 0, 100, 100, 0)


def unchanged(variant: Variant, point: GridPoint, truth: Truth) -> Truth:
    return truth


def change(
    variants: Variant | Sequence[Variant] = VARIANTS,
    where: Callable[[GridPoint], bool] = lambda point: True,
    **amounts: float,
) -> Edit:
    """Return an edit that adds amounts to fields of the truth of some configurations."""
    chosen = [variants] if isinstance(variants, Variant) else variants

    def edit(variant: Variant, point: GridPoint, truth: Truth) -> Truth:
        if variant not in chosen or not where(point):
            return truth
        return replace(
            truth, **{name: getattr(truth, name) + amount for name, amount in amounts.items()}
        )

    return edit


def build(
    edits: dict[str, Edit],
    seeds: int = 16,
    episodes: int = 120,
    rollouts: int = 3,
    variants: Sequence[Variant] = VARIANTS,
    grid: Sequence[GridPoint] = GRID,
    noise: float = 0.5,
    shared: float = 3.0,
    truth: Callable[[Variant, GridPoint], Truth] = paper_truth,
    random_seed: int = 7,
) -> Made:
    """Return a random comparison around the truth, with an edit of it for each delivery setting.

    `noise` and `shared` are standard deviations: of every episode's return and length, and of the
    effect of a seed on the returns of all rows.
    """
    random = np.random.default_rng(random_seed)
    seed_effects = random.normal(0, shared, size=(seeds, 1))
    rows, runs, greedy = [], [], []
    for (delivery, edit), variant, point in product(edits.items(), variants, grid):
        rows.append(Row(delivery, variant, point))
        row = edit(variant, point, truth(variant, point))
        runs.append(_runs(random, row, seed_effects, episodes, noise))
        greedy.append(_rollouts(row, seeds, rollouts))
    arrays = dict(zip(EPISODES, np.moveaxis(np.array(runs), 1, 0), strict=True))
    arrays |= dict(zip(ROLLOUTS, np.moveaxis(np.array(greedy), 1, 0), strict=True))
    return comparison_of(arrays, tuple(rows))


def comparison_of(arrays: dict[str, np.ndarray], rows: tuple[Row, ...], **fields: Any) -> Made:
    """Return the comparison of given episodes and rollouts, arrays (rows, seeds, ...) by name."""
    returns, greedy = arrays["returns"], arrays["greedy_returns"]
    delivers = arrays["greedy_deliveries"][..., 0] > 0
    usual: dict[str, Any] = {
        "seeds": tuple(range(returns.shape[1])),
        "behaviours": np.where(delivers, DELIVERS, WALKS),
        "policy_returns": greedy[..., 0].copy(),
        "max_steps": 600,
    }
    made = Made(
        rows=rows,
        measures={},
        episodes=returns.shape[2],
        rollouts=greedy.shape[2],
        arrays=arrays,
        **{**usual, **fields},
    )
    return remeasured(made)


def remeasured(made: Made) -> Made:
    """Return a comparison with measures and learning curves recomputed from its episodes."""
    made = replace(made, measures=values_of(Run.of_lone_ant(made.arrays)))
    edges = spans(made.episodes)[:-1]
    each = {sums(n): np.add.reduceat(made.arrays[n], edges, axis=2, dtype=int) for n in EPISODES}
    return replace(made, curves=curves_of(made, each))


def _runs(
    random: np.random.Generator, row: Truth, seed_effects: np.ndarray, episodes: int, noise: float
) -> np.ndarray:
    """Return returns, steps and deliveries of a configuration, int32 (3, seeds, episodes)."""
    shape = len(seed_effects), episodes
    early = np.arange(episodes) < EARLY
    sign = np.where(np.arange(episodes) % 2, 1, -1)
    returns = np.where(early, row.early_return, row.late_return) + row.swing * sign + seed_effects
    steps = np.where(early, row.early_steps, row.late_steps) + row.steps_swing * sign
    returns = np.rint(returns + random.normal(0, noise, shape))
    steps = np.rint(steps + random.normal(0, noise, shape))
    deliveries = random.random(shape) < row.deliveries
    return np.stack([returns, np.clip(steps, 1, 600), deliveries]).astype(np.int32)


def _rollouts(row: Truth, seeds: int, rollouts: int) -> np.ndarray:
    """Return the same for greedy rollouts, int32 (3, seeds, rollouts)."""
    figures = [row.greedy_return, row.greedy_steps, row.greedy_deliveries]
    values = np.broadcast_to(np.array(figures)[:, None, None], (3, seeds, rollouts)).copy()
    if row.greedy_varies:
        values[0, :, 0] += 1
    return values.astype(np.int32)


def subset(comparison: Made, rows: Sequence[int], seeds: int, episodes: int) -> Made:
    """Return some rows, the first seeds and the first episodes of a comparison."""
    rows = list(rows)
    arrays = {name: comparison.arrays[name][rows, :seeds, :episodes] for name in EPISODES}
    arrays |= {name: comparison.arrays[name][rows, :seeds] for name in ROLLOUTS}
    return comparison_of(
        arrays,
        tuple(comparison.rows[row] for row in rows),
        seeds=comparison.seeds[:seeds],
        behaviours=comparison.behaviours[rows, :seeds],
        policy_returns=comparison.policy_returns[rows, :seeds],
        max_steps=comparison.max_steps,
        task=comparison.task,
        world=comparison.world,
    )
