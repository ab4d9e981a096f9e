"""Deliveries over time: rows, their file, and the figure."""

from __future__ import annotations

import numpy as np

from taichi_ants.studies.one_colony import Span, Totals, draw, spans

TOTALS = [Totals(5, 10, 100, 50), Totals(7, 14, 300, 100), Totals(8, 14, 300, 100)]
ROWS = [Span(5, 7, 2.0, 0.25), Span(7, 8, 0.0, 0.0)]


def test_rates_are_means_over_spans_even_where_nobody_moves() -> None:
    assert spans(TOTALS) == ROWS
    assert spans(TOTALS[:1]) == []


def test_the_figure_shows_its_rows() -> None:
    upper, lower = draw(ROWS, "3 ants").axes
    for axis, expected in ((upper, [2.0, 0.0]), (lower, [25.0, 0.0])):
        steps = axis.patches[-1].get_data()
        assert steps.values.tolist() == expected
        assert np.array_equal(steps.edges, [5, 7, 8])
    assert lower.get_xlim() == (5, 8)
