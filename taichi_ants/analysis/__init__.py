"""Analysis of sweeps: statistics over seeds, figures, and the audit of the paper's claims.

Reads a `Comparison` (NumPy arrays) and nothing else; imports no Taichi. matplotlib and SciPy are
imported where they are used.
"""
