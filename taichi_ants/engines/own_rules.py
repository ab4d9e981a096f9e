"""Rules that you wrote, as Taichi functions, and their comparison with their Python functions.

See `taichi_ants.rules`.
"""

import linecache
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import taichi as ti
from taichi.lang.impl import subscript

from taichi_ants import runtime
from taichi_ants.arithmetic.numbers import exponential, logarithm, power
from taichi_ants.engines.launch import last_line
from taichi_ants.features.rule import Rule
from taichi_ants.kernel_functions import while_compiling
from taichi_ants.rules.inputs import KINDS, values_shown
from taichi_ants.rules.rule import TRIES, tries


@ti.func
def modulo(x, y):
    """Return x modulo y, with the sign of y: f64 -> f64."""
    return x - y * ti.floor(x / y)


@ti.func
def smaller(x, y):
    """Return the smaller of two numbers as Python's `min` does: f64 -> f64."""
    return ti.select(y < x, y, x)


@ti.func
def larger(x, y):
    """Return the larger of two numbers as Python's `max` does: f64 -> f64."""
    return ti.select(y > x, y, x)


@ti.func
def bounded_power(x, y):
    """Return x to the power of y, for y up to 1000, so that the number of steps is limited."""
    return power(x, ti.min(y, ti.f64(1000.0)))


@ti.func
def picked(weights, random):
    """Return an index by weights: f64 (n,), f64 -> i32; see `taichi_ants.rules.pick`."""
    counted, total = weights, ti.f64(0.0)
    for i in ti.static(range(weights.n)):
        weight = ti.min(weights[i], ti.f64(1e300))
        counted[i] = ti.select(weights[i] >= ti.f64(1e-300), weight, ti.f64(0.0))
        total += counted[i]
    index, below = -1, ti.f64(0.0)
    for i in ti.static(range(weights.n)):
        if (counted[i] > ti.f64(0.0)) & ((index < 0) | (below <= random * total)):
            index = i
        below += counted[i]
    return index


_NAMES = {
    **{"ti": ti, "modulo": modulo, "min_": smaller, "max_": larger, "abs_": ti.abs},
    **{"exp_": exponential, "log_": logarithm, "power_": bounded_power, "pick_": picked},
}


@cache
def plain_function(rule: Rule) -> Callable[..., Any]:
    """Return a `ti.func` of the arguments of a rule, of any types, that returns an f64."""
    file = f"<rule {rule.name} {id(rule)}>"
    # Taichi reads the source of functions.
    lines = rule.source.splitlines(keepends=True)
    linecache.cache[file] = (len(rule.source), None, lines, file)
    names: dict[str, Any] = dict(_NAMES)
    exec(compile(rule.source, file, "exec"), names)
    return ti.func(names["rule"])


@cache
def bounded_function(rule: Rule) -> Callable[..., Any]:
    """Return a `ti.func` as `plain_function`, whose results are in the range of the rule's kind.

    A result that is not a number becomes the smallest one. Results of kinds with whole numbers are
    rounded down, as i32; others are f64.
    """
    kind, function = KINDS[rule.kind], plain_function(rule)
    least, most, is_whole = float(kind.least), float(kind.most), kind.is_whole

    @ti.func
    def bounded(result):
        inside = ti.select(result > ti.f64(least), result, ti.f64(least))
        inside = ti.select(inside < ti.f64(most), inside, ti.f64(most))
        return ti.cast(ti.floor(inside), ti.i32) if ti.static(is_whole) else inside

    return while_compiling(lambda *arguments: bounded(function(*arguments)))


def difference(rule: Rule, n: int = TRIES) -> str:
    """Return the first difference of a rule and its Python function for n drawn inputs, or ""."""
    drawn = list(tries(rule, n))
    try:
        results = _results(rule, drawn)
    except Exception as error:
        return last_line(error)
    for values, result in zip(drawn, results.tolist(), strict=True):
        try:
            reference = float(rule.function(**values))
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            return f"its Python function fails ({said}) for {values_shown(values)}"
        if result != reference:
            said = f"its kernel returns {result!r}, but its Python function {reference!r}"
            return f"{said}, for {values_shown(values)}"
    return ""


def _results(rule: Rule, drawn: list[dict[str, Any]]) -> np.ndarray:
    """Return the results of a rule in a kernel for sets of all arguments, float64 (n,)."""
    lengths = [read.length for read in rule.inputs.values()] + [0] * len(rule.parameters)
    function, names = plain_function(rule), (*rule.inputs, *rule.parameters)
    rows = np.array([np.hstack([*(values[name] for name in names), 0.0]) for values in drawn])
    results = np.zeros(len(rows))
    rows_type, results_type = (ti.types.ndarray(ti.f64, ndim) for ndim in (2, 1))

    @while_compiling
    def of_row(inputs: Any, row: Any) -> Any:
        arguments, at = [], 0
        for length in lengths:
            entries = [subscript(None, inputs, row, at + k) for k in range(max(1, length))]
            arguments.append(ti.Vector(entries) if length else entries[0])
            at += len(entries)
        return function(*arguments)

    @ti.kernel
    def compute(inputs: rows_type, outputs: results_type):
        ti.loop_config(serialize=True)
        for row in range(outputs.shape[0]):
            outputs[row] = of_row(inputs, row)

    with runtime.quiet():
        compute(rows, results)
    return results
