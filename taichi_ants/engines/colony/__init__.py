"""The engine of colonies: many ants in one or many worlds, tick by tick."""
