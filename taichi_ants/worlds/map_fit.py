"""The smallest world that holds a set of cells."""

from __future__ import annotations

from itertools import permutations

import numpy as np


def smallest_world(axials: np.ndarray) -> tuple[tuple[int, int, int], tuple[int, int]]:
    """The ranges with the fewest cells that hold the given cells, and where their origin lies.

    A world of ranges (a + 1, b + 1, c + 1) with its origin at (q0, r0) holds the cells with
    -c <= q - q0 <= a, -c <= r - r0 <= b and -b <= (q - r) - (q0 - r0) <= a. So the extremes of q, r
    and d = q - r decide. An origin exists if and only if
        a + c >= width of q, b + c >= width of r, a + b >= width of d, and
        a + b + c >= q_max - r_min - d_min and a + b + c >= d_max - q_min + r_max.
    The number of cells grows with s = a + b + c, so the smallest possible s is best; for that s it
    is a constant less (a^2 + b^2 + c^2) / 2, so one of a, b, c should be as large as possible, then
    the next.

    Args:
        axials: int64 (n, 2) = (q, r), n >= 1.

    Returns:
        (ranges, (q0, r0)). Of equally small worlds the one of the largest X, then the largest Y; of
        its origins the one of the smallest q, then the smallest r.
    """
    q, r = axials[:, 0], axials[:, 1]
    q_min, q_max = int(q.min()), int(q.max())
    r_min, r_max = int(r.min()), int(r.max())
    d_min, d_max = int((q - r).min()), int((q - r).max())

    total = max(q_max - r_min - d_min, d_max - q_min + r_max)
    most = (total - (r_max - r_min), total - (q_max - q_min), total - (d_max - d_min))
    fits = []
    for order in permutations(range(3)):
        sizes = [0, 0, 0]
        for place in order:
            sizes[place] = min(most[place], total - sum(sizes))
        fits.append(sizes)
    a, b, c = max(fits, key=lambda fit: (sum(n * n for n in fit), fit))

    q_origin = max(q_max - a, d_max - a + r_max - b)
    r_origin = max(r_max - b, q_origin - d_min - b)
    return (a + 1, b + 1, c + 1), (q_origin, r_origin)
