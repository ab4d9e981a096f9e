"""Actions of tests of environments, and comparison of what steps and resets return."""

from typing import Any

import numpy as np

from taichi_ants.task.constants import PICK_UP


def assert_same(ours: Any, theirs: Any, where: str = "") -> None:
    """Equal in names, values and types, down to the infos."""
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), where
        ours, theirs = list(ours.values()), [theirs[name] for name in ours]
    if isinstance(ours, (tuple, list)):
        for one, other in zip(ours, theirs, strict=True):
            assert_same(one, other, where)
    elif isinstance(ours, np.ndarray) and ours.dtype == object:
        assert_same([*ours], [*theirs], where)
    else:
        assert getattr(ours, "dtype", None) == getattr(theirs, "dtype", None), where
        np.testing.assert_array_equal(ours, theirs, err_msg=where, strict=True)


def likely(rng: np.random.Generator, masks: np.ndarray) -> np.ndarray:
    """Return mostly actions that can succeed, pick-up and give above all; else any."""
    worth = rng.random(masks.shape) + 2 * masks * (rng.random(masks.shape[:-1]) < 0.8)[..., None]
    worth[..., PICK_UP:] += masks[..., PICK_UP:]
    return worth.argmax(axis=-1)
