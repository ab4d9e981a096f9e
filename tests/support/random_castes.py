"""Random castes, response thresholds and division of labour for random colonies."""

from dataclasses import replace
from typing import Any

import numpy as np
from random_colonies import RandomColony

from taichi_ants import AntsError
from taichi_ants.features.castes import numbers_in
from taichi_ants.task import Labour, Threshold


def with_castes(
    drawn: RandomColony, seed: int, castes: int, labour: bool, cues: list[tuple[str, str]] | None
) -> RandomColony:
    """Return a random colony with castes, one for each of the `cues` at least.

    With `labour`, the castes have thresholds. All else about castes is random.
    """
    rng, nests = np.random.default_rng([seed, 9]), drawn.world.n_nests
    named: dict[str, dict[str, Any]] = {}
    for k in range(castes):
        named[f"caste_{k}"] = caste = _caste(rng, drawn)
        if cues:
            caste["outbound_cue"], caste["homing_cue"] = cues[k % len(cues)]
        if labour:
            caste["threshold"] = _threshold(rng) if k else Threshold("fixed", 1.5)
        if nests > 1 and k < castes - 1 and rng.random() < 0.3:
            caste["nest"] = int(rng.integers(nests))
    _share_out(rng, named, drawn.population["ants"] // nests)
    divided = Labour(
        "thresholds",
        demand=float(rng.choice([0.1, 0.7, 3.0])),
        relief=float(rng.choice([0.0, 0.3, 5.0])),
        exponent=float(rng.choice([0.0, 1.0, 1.7, 2.0])),
        stop_probability=float(rng.choice([0.05, 0.4, 1.0])),
    )
    return replace(
        drawn, task=replace(drawn.task, castes=named, labour=divided if labour else Labour())
    )


def drawn_castes(drawn: RandomColony, seed: int, *arguments: Any) -> RandomColony | None:
    """Return the colony of `with_castes`, or None if the castes do not fit its nests."""
    try:
        found = with_castes(drawn, seed, *arguments)
        for nest, n in enumerate(np.bincount(drawn.world.nests_of(drawn.population["ants"]))):
            numbers_in(found.task.castes, nest, int(n))
    except AntsError:
        return None
    return found


def _caste(rng: np.random.Generator, drawn: RandomColony) -> dict[str, Any]:
    task, rule = drawn.task, drawn.task.choice.rule
    deposits = str(rng.choice(["all", "all", "none", "trail", ", ".join(task.fields) or "none"]))
    able: dict[str, Any] = {"lifespan": int(rng.integers(1, 25))}
    if rule == "deneubourg":
        able |= {"k": float(rng.choice([0.5, 100.0])), "exponent": float(rng.choice([0, 1.5, 4]))}
    elif task.needs_table:
        able["epsilon"] = float(rng.choice([0.0, 0.2, 1.0]))
        able["learning_rate"] = float(rng.choice([0.02, 0.5, 1.0]))
        able["discount"] = float(rng.choice([0.0, 0.5, 0.95]))
    if rule == "softmax":
        able["temperature"] = float(rng.choice([0.1, 5.0]))
    if task.life.lifespan is None and not task.life.births:
        del able["lifespan"]
    found: dict[str, Any] = {name: value for name, value in able.items() if rng.random() < 0.5}
    follows = task.needs_table and drawn.sharing != "independent"
    if follows and task.observation == "paper" and rng.random() < 0.3:
        found["policy"] = str(rng.choice(["random", "trail_follower"]))
    if found.get("epsilon") == 0.2 and "discount" not in found:  # without a draw
        found["epsilon_spread"] = 0.15
    return {"lays": deposits, **found}


def _share_out(rng: np.random.Generator, named: dict[str, dict[str, Any]], n: int) -> None:
    """Give castes shares that add up to 1, or a number of ants, or nothing."""
    common, way = [caste for caste in named.values() if "nest" not in caste], rng.random()
    if way < 0.4 and len(common) == len(named):
        for caste, share in zip(common, rng.dirichlet(np.ones(len(common))), strict=True):
            caste["share"] = float(share)
    elif way < 0.7 and len(common) > 1:
        common[0]["ants"] = int(rng.integers(0, n + 1))


def _threshold(rng: np.random.Generator) -> Threshold:
    kind = str(rng.choice(["fixed", "uniform", "normal"]))
    value, spread = float(rng.choice([0.3, 2.0, 7.0])), float(rng.choice([0.0, 0.3]))
    return Threshold(kind, value) if kind == "fixed" else Threshold(kind, value, spread=spread)
