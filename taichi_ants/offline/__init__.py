"""Data sets of transitions, offline learning and off-policy evaluation."""

from taichi_ants.offline.dataset import Dataset
from taichi_ants.offline.evaluation import PolicyValues, importance_sampling, model_based
from taichi_ants.offline.learners import (
    EmpiricalModel,
    batch_q_learning,
    fitted_q_iteration,
    pessimistic_q_iteration,
)
from taichi_ants.offline.recording import record, record_colony

__all__ = [
    "Dataset", "EmpiricalModel", "PolicyValues", "batch_q_learning", "fitted_q_iteration",
    "importance_sampling", "model_based", "pessimistic_q_iteration", "record", "record_colony",
]  # fmt: skip
__dir__ = __all__.copy  # completion lists only public names
