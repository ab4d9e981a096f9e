"""Random castes, response thresholds and division of labour for random colonies."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from random_colonies import RandomColony

from taichi_ants import AntsError
from taichi_ants.learners.policies import FOLLOWED
from taichi_ants.task import Labour, Threshold
from taichi_ants.task.caste import DISTRIBUTIONS, numbers_in


def with_castes(
    drawn: RandomColony, seed: int, castes: int, labour: bool, cues: list[tuple[str, str]] | None
) -> RandomColony:
    """Return a random colony with castes, one for each of the `cues` at least.

    With `labour`, the castes have thresholds. All else about castes is random.
    """
    rng, task = np.random.default_rng([seed, 9]), drawn.task
    nests = drawn.world.n_nests
    named: dict[str, dict[str, Any]] = {}
    for k in range(castes):
        named[f"caste_{k}"] = one = _numbers(rng, drawn)
        if cues:
            one["outbound_cue"], one["homing_cue"] = cues[k % len(cues)]
        if labour:
            one["threshold"] = _threshold(rng) if k else Threshold("fixed", 1.5)
        if nests > 1 and k < castes - 1 and rng.random() < 0.3:
            one["nest"] = int(rng.integers(nests))
    _share_out(rng, named, drawn.population["ants"] // nests)
    rule = _labour(rng) if labour else Labour()
    made = replace(task, castes=named, labour=rule)
    for nest, n in enumerate(np.bincount(drawn.world.nests_of(drawn.population["ants"]))):
        numbers_in(made.castes, nest, int(n))  # raises an error if the castes do not fit
    return replace(drawn, task=made)


def drawn_castes(drawn: RandomColony, seed: int, *arguments: Any) -> RandomColony | None:
    """Return the colony of `with_castes`, or None if the castes do not fit its nests."""
    try:
        return with_castes(drawn, seed, *arguments)
    except AntsError:
        return None


def _numbers(rng: np.random.Generator, drawn: RandomColony) -> dict[str, Any]:
    task, sharing = drawn.task, drawn.sharing
    found: dict[str, Any] = {
        "lays": str(rng.choice(["all", "all", "none", "trail", ", ".join(task.fields) or "none"]))
    }
    able: dict[str, Any] = {
        "lifespan": int(rng.integers(1, 25)),
        "epsilon": float(rng.choice([0.0, 0.2, 1.0])),
        "learning_rate": float(rng.choice([0.02, 0.5, 1.0])),
        "discount": float(rng.choice([0.0, 0.5, 0.95])),
        "temperature": float(rng.choice([0.1, 5.0])),
        "k": float(rng.choice([0.5, 100.0])),
        "exponent": float(rng.choice([0.0, 1.5, 4.0])),
    }
    rule = task.choice.rule
    if not task.choice.needs_table:
        for name in ("epsilon", "learning_rate", "discount"):
            del able[name]
    if rule != "deneubourg":
        del able["k"], able["exponent"]
    follows = task.choice.needs_table and sharing != "independent"
    if follows and task.observation in FOLLOWED and rng.random() < 0.3:
        found["policy"] = str(rng.choice(["random", "trail_follower"]))
    if rule != "softmax":
        del able["temperature"]
    if task.life.lifespan is None and not task.life.births:
        del able["lifespan"]
    found |= {name: one for name, one in able.items() if rng.random() < 0.5}
    if found.get("epsilon") == 0.2 and "discount" not in found:  # without a draw
        found["epsilon_spread"] = 0.15
    return found


def _share_out(rng: np.random.Generator, named: dict[str, dict[str, Any]], n: int) -> None:
    """Give castes shares that add up to 1, or a number of ants, or nothing."""
    several = [one for one in named.values() if "nest" not in one]
    way = rng.random()
    if way < 0.4 and len(several) == len(named):
        for one, share in zip(several, rng.dirichlet(np.ones(len(several))), strict=True):
            one["share"] = float(share)
    elif way < 0.7:
        several[0]["ants" if len(several) > 1 else "share"] = (
            int(rng.integers(0, n + 1)) if len(several) > 1 else 1.0
        )


def _threshold(rng: np.random.Generator) -> Threshold:
    distribution = str(rng.choice(DISTRIBUTIONS))
    value, spread = float(rng.choice([0.0, 0.3, 2.0, 7.0])), float(rng.choice([0.0, 0.3, 2.0]))
    spread = min(value, spread) if distribution == "uniform" else spread
    given = {"value": value} if distribution != "none" else {}
    return Threshold(
        distribution, **given, **({"spread": spread} if distribution in DISTRIBUTIONS[2:] else {})
    )


def _labour(rng: np.random.Generator) -> Labour:
    return Labour(
        "thresholds",
        demand=float(rng.choice([0.1, 0.7, 3.0])),
        relief=float(rng.choice([0.0, 0.3, 5.0])),
        exponent=float(rng.choice([0.0, 1.0, 1.7, 2.0])),
        stop_probability=float(rng.choice([0.05, 0.4, 1.0])),
    )
