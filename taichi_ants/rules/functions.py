"""Functions that rules may call, in Python; kernels use their Taichi versions.

The formulas, and the order of their operations, are those of the docstring of
`taichi_ants.arithmetic.numbers`. The built-in functions `min`, `max` and `abs` are also allowed.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence


def exp(x: float) -> float:
    """Return e to the power of x; 0 below -708.

    >>> rules.exp(1.0)
    2.7182818284590455
    """
    if x < -708.0:
        return 0.0
    x = min(x, 709.0)
    n = math.floor(x * 1.4426950408889634 + 0.5)
    r = (x - n * 0.6931471803691238) - n * 1.9082149292705877e-10
    p = 1.0 / math.factorial(13)
    for i in reversed(range(13)):
        p = p * r + 1.0 / math.factorial(i)
    return math.ldexp(p, n)


def log(x: float) -> float:
    """Return the natural logarithm of x, a normal number above 0; ValueError for other numbers.

    >>> rules.log(8.0) / rules.log(2.0)
    3.0
    """
    if not 2.0**-1022 <= x < math.inf:
        raise ValueError(f"log({x}) is not defined")
    (bits,) = struct.unpack("<Q", struct.pack("<d", x))
    exponent = (bits >> 52) - 1023
    m = math.ldexp(x, -exponent)
    if m > 1.4142135623730951:
        m, exponent = m / 2, exponent + 1
    s = (m - 1.0) / (m + 1.0)
    z = s * s
    p = 1.0 / 23
    for i in (21, 19, 17, 15, 13, 11, 9, 7, 5, 3, 1):
        p = p * z + 1.0 / i
    e = float(exponent)
    return e * 0.6931471803691238 + (e * 1.9082149292705877e-10 + (2.0 * s) * p)


def power(x: float, y: float) -> float:
    """Return x to the power of y, for normal x > 0 and 0 <= y <= 1000; else ValueError.

    >>> rules.power(2.0, 10)
    1024.0
    """
    if not (2.0**-1022 <= x < math.inf and 0 <= y <= 1000):
        raise ValueError(f"power({x}, {y}) is not defined; x must be above 0, and y from 0 to 1000")
    y = float(y)
    if y.is_integer():
        return math.prod([x] * int(y), start=1.0)
    return exp(y * log(x))


def pick(weights: Sequence[float], random: float) -> int:
    """Return an index, drawn with probabilities proportional to weights; -1 if none counts.

    A weight counts if it is at least 1e-300, and as 1e300 if it is larger. An entry whose weight
    does not count, such as 0, a negative number or NaN, is never returned, for any `random`.

    Args:
        weights: The weights of the entries.
        random: A random number from 0 to less than 1; the index never falls as it rises.

    >>> [rules.pick([1.0, 3.0], random) for random in (0.2, 0.3)]
    [0, 1]
    """
    counted, total = [min(weight, 1e300) if weight >= 1e-300 else 0.0 for weight in weights], 0.0
    for weight in counted:
        total += weight  # not `sum`, whose rounding differs between versions of Python
    index, below = -1, 0.0
    for i, weight in enumerate(counted):
        if weight and (index < 0 or below <= random * total):
            index = i
        below += weight
    return index
