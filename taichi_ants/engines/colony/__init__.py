"""Worlds of many ants that act and learn in lockstep, tick by tick."""
