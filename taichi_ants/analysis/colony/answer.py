"""The study in three sentences: do the rules help, do trails, does it help to train together."""

from __future__ import annotations

from taichi_ants.analysis.colony.contrasts import SERIES, Judged, Series
from taichi_ants.analysis.colony.study import (
    ABC,
    ALONE,
    ARENAS,
    PAPER,
    SILENT,
    Condition,
    Design,
    Measured,
)
from taichi_ants.analysis.findings import Verdict, too_few
from taichi_ants.analysis.tables import figure, joined
from taichi_ants.errors import count

# What the designs are called here, in a sentence of the form "64 ants ... deliver more ...".
_SENTENCES: dict[tuple[Design, Design], tuple[str, str]] = {
    (Design(ABC), Design(PAPER)): ("with all three rules", "than under the paper's rules"),
    (Design(PAPER), Design(SILENT)): (
        "that lay trails under the paper's rules",
        "than without trails",
    ),
    (Design(ABC), Design(ABC, ALONE)): (
        "with all three rules that train together",
        "than copies of one that trains alone",
    ),
}
_WHERE = {
    "paper": "in the paper's world",
    "open": "in open worlds",
    "piles": "with three far piles",
}
assert _WHERE.keys() == ARENAS.keys()
_OPEN = (Verdict.UNDECIDED, Verdict.EQUIVALENT, Verdict.TOO_FEW)


def answer(measured: Measured, judged: Judged) -> list[str]:
    """Three sentences about the largest colonies, computed from the verdicts."""
    by_designs = {
        (series.first, series.second): series
        for series in SERIES
        if series.measure == "deliveries" and series.against == "same"
    }
    return [
        _told(measured, judged, by_designs[designs], *words)
        for designs, words in _SENTENCES.items()
    ]


def _told(measured: Measured, judged: Judged, series: Series, who: str, than: str) -> str:
    """Where such ants deliver more than others, where less, and where nobody knows."""
    places: dict[Verdict, list[str]] = {}
    sizes = set()
    for arena, where in _WHERE.items():
        findings = judged.get((arena, series), {})
        n = max((ants for ants, _ in findings), default=1)
        if n > 1:
            means = [
                measured[Condition(arena, *design, n)][series.measure].mean()
                for design in (series.first, series.second)
            ]
            place = f"{' against '.join(map(figure, means))} {where}"
            places.setdefault(findings[n, n].verdict, []).append(place)
            sizes.add(n)
    if not places:
        return f"Whether ants {who} deliver more {than} is not tested here."
    ants = f"{count(max(sizes), 'ant')} {who}"
    still = joined([one for verdict in _OPEN for one in places.get(verdict, [])] or [""])
    known = [
        f"{more} {than}: {joined(places[verdict])}"
        for verdict, more in ((Verdict.SUPPORTED, "more"), (Verdict.CONTRADICTED, "less"))
        if verdict in places
    ]
    if Verdict.TOO_FEW in places:
        seeds = len(measured[next(iter(measured))][series.measure])
        return f"{too_few(seeds)} {ants} deliver more {than}: {still}."
    if not known:
        return f"Whether {ants} deliver more {than} stays open: {still}."
    more = f"; the difference stays open: {still}" if still else ""
    return f"{ants} deliver {'; '.join(known)}{more}."
