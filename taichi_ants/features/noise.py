"""Noise: failures of actions and observations.

A slip, and each cell in view, takes one draw of 64 bits. The upper word decides whether the action
slips or the cell is misread. The lower word chooses the executed action among all five, or the code
seen among the other three, in ascending order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from taichi_ants.features.feature import Feature
from taichi_ants.kernel_functions import bits, ti
from taichi_ants.settings import Setting, Settings, Share

_ACTIONS, _OTHER_CODES = 5, 3


@dataclass(frozen=True)
class Noise(Settings, path="task.noise"):
    """Failures of actions and observations; by default, there are none.

    With probability `slip`, an ant executes one of the five actions, drawn uniformly, instead of
    the action that it chose. Learners learn about the chosen action. With probability `misread`, an
    ant sees a cell in view as another of the four codes, drawn uniformly. This changes the state
    index by which ants choose and learn, but not the results and rewards of actions.

    >>> Task(noise=task.Noise(slip=0.1)).noise.slip
    0.1
    """

    sentences: ClassVar[dict[str, str]] = {
        "slip": "With probability {slip}, an ant executes any of the five actions instead of the "
        "chosen one.",
        "misread": "With probability {misread}, an ant sees a cell as one of the three other "
        "codes.",
    }

    slip: Annotated[Share, Setting("probability that an ant executes a random action")] = 0.0
    misread: Annotated[Share, Setting("probability that a cell is seen as another code")] = 0.0


SLIP = Feature(Noise, switch="slip", probabilities=("slip",), runs_alone=True)
MISREAD = Feature(Noise, switch="misread", probabilities=("misread",), runs_alone=True)


@SLIP.at("execute")
def slip(a, action, stream):
    """Let the ant execute another action than it chose."""
    after = bits.advance(stream)
    words = bits.bits_of(after)
    slips = bits.high_word(words) < a.slip_below
    return ti.select(slips, bits.below(bits.low_word(words), _ACTIONS), action), after


@MISREAD.at("see")
def misread(a, code, stream):
    """Let the ant see another code than the cell has."""
    after = bits.advance(stream)
    words = bits.bits_of(after)
    other = bits.below(bits.low_word(words), _OTHER_CODES)
    other += ti.cast(other >= code, ti.i32)
    return ti.select(bits.high_word(words) < a.misread_below, other, code), after
