"""Functions of real numbers in Python floats, the second implementation of those of kernels."""

from taichi_ants.rules.functions import exp as exponential
from taichi_ants.rules.functions import log as logarithm
from taichi_ants.rules.functions import power

__all__ = ["exponential", "logarithm", "power"]
