"""Rules that you write: the choice of an action, deposits, evaporation and rewards.

See `docs/how-to/models.md`, and `register` for the form of a rule.
"""

from taichi_ants.features.rule import Parameters, Rule, get, names
from taichi_ants.rules.functions import exp, log, pick, power
from taichi_ants.rules.inputs import KINDS
from taichi_ants.rules.rule import register

__all__ = ["KINDS", "Parameters", "Rule", "exp", "get", "log", "names", "pick", "power", "register"]
__dir__ = __all__.copy  # completion lists only public names
