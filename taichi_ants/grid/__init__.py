"""The hexagonal grid and the random streams on the host; NumPy only."""
