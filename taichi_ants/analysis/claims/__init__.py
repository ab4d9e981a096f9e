"""The audit of the paper's empirical claims: each made precise, tested, and judged."""

from taichi_ants.analysis.claims.assess import SIMULTANEOUS_LEVEL, assess
from taichi_ants.analysis.claims.catalogue import CLAIMS
from taichi_ants.analysis.claims.model import Above, Claim, Contrast, Finding, Verdict, Within
from taichi_ants.analysis.claims.slice import NotTestedError, Slice
from taichi_ants.analysis.claims.tables import claims_markdown, claims_rows

__all__ = [
    "CLAIMS",
    "SIMULTANEOUS_LEVEL",
    "Above",
    "Claim",
    "Contrast",
    "Finding",
    "NotTestedError",
    "Slice",
    "Verdict",
    "Within",
    "assess",
    "claims_markdown",
    "claims_rows",
]
