"""Functions of real numbers: near NumPy's, and equal to the reference to the last bit."""

import numpy as np
import pytest
import taichi as ti

from taichi_ants import runtime
from taichi_ants.rules import functions as plain

RNG = np.random.default_rng(5)
EXPONENTS = np.concatenate(
    [
        RNG.uniform(-708, 709, 20_000),
        RNG.uniform(-1, 1, 20_000),
        RNG.choice([-1, 1], 5_000) * 10.0 ** RNG.uniform(-300, 0, 5_000),
        [0.0, -0.0, -708.0, 709.0, np.log(2) / 2, -np.log(2) / 2],
    ]
)
POSITIVE = np.concatenate(
    [
        10.0 ** RNG.uniform(-300, 300, 20_000),
        1 + RNG.uniform(-0.3, 0.5, 20_000),
        1 + RNG.choice([-1, 1], 5_000) * 10.0 ** RNG.uniform(-16, -1, 5_000),
        [1.0, 2.0, 0.5, np.sqrt(2), np.nextafter(np.sqrt(2), 2), np.nextafter(1, 0)],
    ]
)
BASES = 10.0 ** RNG.uniform(-3, 6.4, 30_000)
POWERS = np.where(RNG.random(30_000) < 0.3, RNG.integers(0, 21, 30_000), RNG.uniform(0, 20, 30_000))


@pytest.fixture(scope="module")
def kernels():
    """The functions over arrays."""
    runtime.start()
    from taichi_ants.arithmetic.numbers import exponential, logarithm, power

    array = ti.types.ndarray(dtype=ti.f64, ndim=1)

    @ti.kernel
    def all_of(x: array, y: array, e: array, n: array, p: array):
        for i in range(x.shape[0]):
            e[i] = exponential(x[i])
            n[i] = logarithm(ti.abs(x[i]))
            p[i] = power(ti.abs(x[i]), y[i])

    def results(x, y):
        made = [np.empty_like(x) for _ in range(3)]
        all_of(x, y, *made)
        return made

    return results


def test_exponentials(kernels):
    ours, *_ = kernels(EXPONENTS, np.zeros_like(EXPONENTS))
    np.testing.assert_allclose(ours, np.exp(EXPONENTS), rtol=1e-12)
    assert ours.tolist() == [plain.exp(x) for x in EXPONENTS.tolist()]
    beyond = np.array([-708.5, -1e9, -np.inf, 710.0, np.inf])
    ours, *_ = kernels(beyond, np.zeros(5))
    assert ours.tolist() == [0, 0, 0, *[plain.exp(709.0)] * 2]


def test_logarithms(kernels):
    _, ours, _ = kernels(POSITIVE, np.zeros_like(POSITIVE))
    np.testing.assert_allclose(ours, np.log(POSITIVE), rtol=1e-12, atol=0)
    assert ours.tolist() == [plain.log(x) for x in POSITIVE.tolist()]


def test_powers(kernels):
    *_, ours = kernels(BASES, POWERS)
    np.testing.assert_allclose(ours, BASES**POWERS, rtol=1e-12)
    both = zip(BASES.tolist(), POWERS.tolist(), strict=True)
    assert ours.tolist() == [plain.power(x, y) for x, y in both]
