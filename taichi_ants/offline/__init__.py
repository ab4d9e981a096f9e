"""Data sets of transitions, and what is learned and judged from them without the world."""
