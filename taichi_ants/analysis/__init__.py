"""Analysis of results: statistics over seeds, baselines, figures, and tests of the paper's claims.

It does not import Taichi; it imports matplotlib and SciPy only where it uses them.
"""
