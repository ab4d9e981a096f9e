"""The arithmetic of a CPU on a GPU: products and quotients that its compiler has to leave alone.

The compiler for GPUs rounds `a * b + c` once instead of twice, approximates quotients of f32, and
multiplies by a reciprocal instead of dividing, for f64 too. Taichi has no setting against this. In
the context `guarded`, kernels compile so that it cannot: the bits of each product and divisor are
combined by exclusive or with a number that is 0, but only when the kernel runs. Quotients of f32
are computed in f64 and rounded once more, which gives the same bits.

The context replaces Taichi's operators. So it holds for all functions that a kernel calls, those of
users too, and none of them mentions it. CPUs need no guards. There are none for functions of Taichi
such as `ti.exp` and `ti.sqrt`, which differ between processors anyway; see `numbers`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from itertools import count
from typing import Any

import taichi as ti
from taichi._lib import core
from taichi.lang import ops
from taichi.lang.expr import Expr

_REPLACED = ("mul", "truediv", "floordiv", "mod", "pow")


@contextlib.contextmanager
def guarded(*zero: int) -> Iterator[None]:
    """Return a context in which kernels compile with guards.

    `zero` is the place of an i32 among the arguments of the kernel, or the place of a pack and that
    in the pack, without arrays. It must be 0 at each launch.
    """
    originals = {name: getattr(ops, name) for name in _REPLACED}
    mul, truediv, floordiv, _, power = originals.values()
    uses = count(1)

    def hidden(value: Expr, factor: int = 1) -> Expr:
        """Return a real number that the compiler does not know to be `value`."""
        kind = _real(value)
        bits = ti.i32 if kind is ti.f32 else ti.i64
        loaded = core.make_arg_load_expr(
            *(list(zero), ti.i32, False),
            create_load=True,
            arg_depth=len(zero) - 1,
            dbg_info=core.DebugInfo(""),
        )
        nothing = ops.cast(mul(Expr(loaded), factor), bits)
        return ops.bit_cast(ops.bit_xor(ops.bit_cast(value, bits), nothing), kind)

    def product(a: Any, b: Any) -> Any:
        result = mul(a, b)
        return hidden(result) if _real(result) else result

    def quotient(a: Any, b: Any) -> Any:
        kind = _real(result := truediv(a, b))
        if not kind:
            return result
        dividend, divisor = (ops.cast(ops.cast(Expr(x), kind), ti.f64) for x in (a, b))
        # Each divisor is another one, because of two quotients by the same divisor, the compiler
        # makes products with its reciprocal.
        return ops.cast(truediv(dividend, hidden(divisor, next(uses))), kind)

    def whole_quotient(a: Any, b: Any) -> Any:
        result = floordiv(a, b)
        return ops.floor(quotient(a, b)) if _real(result) else result

    def remainder(a: Any, b: Any) -> Any:
        return ops.sub(a, product(b, whole_quotient(a, b)))

    def raised(a: Any, b: Any) -> Any:  # to the power of 2, the compiler makes a product
        result = power(a, b)
        return hidden(result) if _real(result) else result

    guards = product, quotient, whole_quotient, remainder, raised
    try:
        for name, guard in zip(_REPLACED, guards, strict=True):
            setattr(ops, name, guard)
        yield
    finally:
        for name, original in originals.items():
            setattr(ops, name, original)


def _real(value: Any) -> Any:
    """Return the type of the real numbers in an expression, ti.f32 or ti.f64, or None."""
    if not isinstance(value, Expr):
        return None  # a number of Python, which is computed now
    kind = value.element_type() if value.is_tensor() else value.ptr.get_rvalue_type()
    return next((real for real in (ti.f32, ti.f64) if kind == real), None)
