"""Pages as files: their size, that they need nothing else, and where they come from."""

from __future__ import annotations

import html
import re

import numpy as np
import pytest

from taichi_ants import worlds
from taichi_ants.learners.policies import trail_follower
from taichi_ants.rendering import Episode
from taichi_ants.viewer import page, record_trace
from taichi_ants.viewer.page import part

TITLE = 'An <ant> & its "trail"'


@pytest.fixture(scope="module")
def episode():
    return record_trace(Episode.play(worlds.paper(), trail_follower()).trace, TITLE)


def luminance(colour: str) -> float:
    """As the contrast of WCAG 2 has it."""
    parts = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


@pytest.mark.parametrize("theme", [0, 1])
def test_text_can_be_read_and_ants_stand_out(theme):
    values = dict(re.findall(r"--([a-z-]+): ([^;]+);", part("colours.css").split("}")[theme]))

    def contrast(one: str, other: str) -> float:
        high, low = sorted([luminance(one), luminance(other)], reverse=True)
        return (high + 0.05) / (low + 0.05)

    for ink in ("ink", "faint", "chosen", "good", "bad"):
        assert contrast(values[ink], values["card"]) > 4.5, ink
    for cell in (values["empty"], *values["trail"].split()):
        # Where the trail comes near the colour of ants, the edge around them sets them apart.
        assert max(contrast(values[name], cell) for name in ("ant", "halo")) > 3
    for trail in values["trail"].split():  # food in small cells is a dot with a ring
        assert max(contrast(values[name], trail) for name in ("food", "food-floor")) > 1.75
    assert contrast(values["food"], values["food-floor"]) > 2.9
    levels = [luminance(colour) for colour in values["trail"].split()]
    assert levels == sorted(levels, reverse=theme == 0)


def test_notebooks_show_recordings(episode):
    shown = episode._repr_html_()
    assert shown.startswith("<iframe ")
    assert html.unescape(re.search(r'title="([^"]*)"', shown)[1]) == TITLE
    assert html.unescape(re.search(r'srcdoc="([^"]*)"', shown)[1]) == page(episode)
