"""Functions of real numbers in kernels, with equal results on all CPUs.

The compiler's own exp, log and power differ between processors in their last bits. These use only
+ - * / of f64, floor and the bits of an f64, each rounded once and in this order:

exponential(x): 0 below -708, and the value at 709 above it. n = floor(x * LOG2_E + 0.5), then
r = (x - n * LN2_HIGH) - n * LN2_LOW. The Taylor polynomial of degree 13 is evaluated by Horner's
rule: p = 1/13!, then p = p * r + 1/i! for i = 12 to 0, with 1/i! rounded to f64. The result is
p * 2^n.

logarithm(x), for normal x > 0: x = m * 2^e with 1 <= m < 2. If m > SQRT_2, m is halved and e is
raised by 1. s = (m - 1) / (m + 1), z = s * s. By Horner's rule, p = 1/23, then p = p * z + 1/i for
i = 21, 19, ..., 1. The result is e * LN2_HIGH + (e * LN2_LOW + (2 * s) * p).

power(x, y), for x > 0 and y >= 0: if y is a whole number, 1 * x * ... * x with y factors x, from
left to right. Otherwise exponential(y * logarithm(x)).

Relative errors are below 1e-12, see `tests/task/test_numbers.py`.
"""

import math

import taichi as ti

LOG2_E = 1.4426950408889634
# The sum is ln 2. The first has 32 bits, so that its products with exponents are exact.
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
SQRT_2 = 1.4142135623730951
_LOWEST, _HIGHEST = -708.0, 709.0
_TAYLOR = tuple(1.0 / math.factorial(i) for i in range(13, -1, -1))
_ODD = tuple(1.0 / i for i in range(23, 0, -2))
_BIAS = 1023
_FRACTION, _ONE_BITS = (1 << 52) - 1, _BIAS << 52


@ti.func
def exponential(x):
    """Return e to the power of x: f64 -> f64."""
    inside = ti.select(x > ti.f64(_LOWEST), x, ti.f64(_LOWEST))
    inside = ti.select(inside < ti.f64(_HIGHEST), inside, ti.f64(_HIGHEST))
    n = ti.floor(inside * ti.f64(LOG2_E) + ti.f64(0.5))
    r = (inside - n * ti.f64(LN2_HIGH)) - n * ti.f64(LN2_LOW)
    p = ti.f64(_TAYLOR[0])
    for i in ti.static(range(1, len(_TAYLOR))):
        p = p * r + ti.f64(_TAYLOR[i])
    scale = ti.bit_cast((ti.cast(n, ti.i64) + ti.i64(_BIAS)) << ti.i64(52), ti.f64)
    return ti.select(x < ti.f64(_LOWEST), ti.f64(0.0), p * scale)


@ti.func
def logarithm(x):
    """Return the natural logarithm of a normal number above 0: f64 -> f64."""
    bits = ti.bit_cast(x, ti.i64)
    e = ti.cast((bits >> ti.i64(52)) - ti.i64(_BIAS), ti.f64)
    m = ti.bit_cast((bits & ti.i64(_FRACTION)) | ti.i64(_ONE_BITS), ti.f64)
    if m > ti.f64(SQRT_2):
        m = m * ti.f64(0.5)
        e = e + ti.f64(1.0)
    s = (m - ti.f64(1.0)) / (m + ti.f64(1.0))
    z = s * s
    p = ti.f64(_ODD[0])
    for i in ti.static(range(1, len(_ODD))):
        p = p * z + ti.f64(_ODD[i])
    return e * ti.f64(LN2_HIGH) + (e * ti.f64(LN2_LOW) + (ti.f64(2.0) * s) * p)


@ti.func
def power(x, y):
    """Return x to the power of y, for x above 0 and y of at least 0: f64 -> f64."""
    result = ti.f64(1.0)
    if y == ti.floor(y):
        for _ in range(ti.cast(y, ti.i32)):
            result = result * x
    else:
        result = exponential(y * logarithm(x))
    return result
