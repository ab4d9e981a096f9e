"""Random rules of choice, and random noise."""

import numpy as np

from taichi_ants.task import Choice, Noise

NO_NOISE, NOISE = "", "slip and misread"


def random_choice(seed: int, rule: str) -> Choice:
    """Return a rule of choice with random numbers, some of them extreme."""
    rng = np.random.default_rng([seed, 7])
    if rule == "softmax":
        return Choice(rule, temperature=float(rng.choice([0.001, 0.3, 1.0, 40.0])))
    if rule == "deneubourg":
        return Choice(
            rule,
            k=float(rng.choice([0.01, 1.0, 20.0, 333.3])),
            exponent=float(rng.choice([0.0, 1.0, 1.7, 2.0, 6.5])),
        )
    return Choice(rule)


def random_noise(seed: int, kinds: str) -> Noise:
    """Return noise of the kinds that a text names: "", "slip", "misread" or `NOISE`."""
    rng = np.random.default_rng([seed, 8])
    slip, misread = (float(rng.choice([0.02, 0.3, 1.0], p=[0.4, 0.5, 0.1])) for _ in "sm")
    return Noise(slip if "slip" in kinds else 0.0, misread if "misread" in kinds else 0.0)
