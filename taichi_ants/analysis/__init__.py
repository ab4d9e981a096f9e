"""What to make of results: statistics over seeds, baselines, figures, the paper's claims tested.

Imports no Taichi; matplotlib and SciPy are imported where they are used.
"""
