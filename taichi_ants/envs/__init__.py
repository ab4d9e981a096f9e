"""Environments for agents of others: Gymnasium, batches of environments, PettingZoo."""

from taichi_ants.task.events import Event, Reason

__all__ = ["Event", "Reason"]
