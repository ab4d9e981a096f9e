"""Comparison of what steps and resets of environments return."""

from typing import Any

import numpy as np


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
