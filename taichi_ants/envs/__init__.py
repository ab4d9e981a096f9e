"""Environments for agents of others: Gymnasium, batches of environments, PettingZoo."""
