"""The comparison in a few sentences: who returns most, who needs the fewest steps, what ants do.

Each sentence about a claim names its configurations, its deliveries and its number of seeds.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from taichi_ants.analysis.behaviour import CIRCLES, DELIVERS, OTHER, WALKS, counts
from taichi_ants.analysis.findings import LEAST_SEEDS, Finding, Verdict, too_few
from taichi_ants.analysis.paper.audit import Audit
from taichi_ants.analysis.paper.claims import Claim
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.published import GRID
from taichi_ants.analysis.tables import figure, joined, number, percent, sentence, thousands
from taichi_ants.errors import count


class _Headline(NamedTuple):
    """A claim in few words: where it holds, where it does not, and its configurations."""

    holds: str
    fails: str
    where: str


_TABLE_2 = "at the configurations of table 2"
# The claims that answer the question. Two of them are about steps, because they disagree.
_CLAIMS = {
    "q-return-highest": _Headline(
        "Q-learning returns most", "Q-learning does not return most", _TABLE_2
    ),
    "overall-sarsa-length": _Headline(
        "SARSA needs the fewest steps",
        "SARSA does not need the fewest steps",
        f"in the mean of all {len(GRID)} configurations",
    ),
    "sarsa-much-shorter": _Headline(
        "SARSA's episodes are much shorter than Q-learning's",
        "SARSA's episodes are not much shorter than Q-learning's",
        _TABLE_2,
    ),
}
HEADLINES = tuple(_CLAIMS)
USUAL_SEEDS = 100  # what `compare` takes unless told otherwise
MORE = f"compare --seeds {USUAL_SEEDS} tells more"
NEEDS = "that takes the paper's world, its configurations and 100 episodes"


def answer(comparison: Comparison, lines: Sequence[Mapping], audit: Audit) -> list[str]:
    """Return sentences that are computed from the verdicts and from what the final policies do.

    `lines` are those of `table2.table2`.
    """
    by_id = {claim.id: (claim, findings) for claim, findings in audit.items()}
    verdicts = {one.verdict for name in _CLAIMS for one in by_id[name][1].values()}
    seeds = len(comparison.seeds)
    if verdicts == {Verdict.NOT_TESTED}:
        first = f"The paper's claims are not tested here: {NEEDS}."
    elif seeds < LEAST_SEEDS and verdicts <= {Verdict.UNDECIDED, Verdict.NOT_TESTED}:
        first = f"{too_few(seeds)} the paper's claims hold; {MORE}."
    else:
        told = [_told(words, *by_id[name]) for name, words in _CLAIMS.items()]
        return [*told, _doings(comparison)]
    return [first, _extremes(lines, seeds), _doings(comparison)]


def _told(headline: _Headline, claim: Claim, findings: Mapping[str, Finding]) -> str:
    """What became of a claim, with the numbers; delivery settings that agree share the words."""
    seeds = max(one.contrast.seeds for one in findings.values())
    holds, fails = (f"{words} {headline.where}" for words in headline[:2])
    stays_open = f"whether {holds}, as the paper says, stays open"
    if seeds < USUAL_SEEDS:
        says = "" if seeds < LEAST_SEEDS else ", as the paper says"
        stays_open = f"{too_few(seeds)} {holds}{says}"
    words = {
        Verdict.SUPPORTED: f"{holds}, as the paper says",
        Verdict.CONTRADICTED: f"{fails}, contrary to the paper",
        Verdict.EQUIVALENT: f"{fails}, contrary to the paper",
        Verdict.UNDECIDED: stays_open,
        Verdict.NOT_TESTED: f"whether {holds}, as the paper says, is not tested: {NEEDS}",
    }
    # The delivery settings, by the words and then by the numbers.
    alike: dict[str, dict[str, list[str]]] = {}
    for setting, one in findings.items():
        numbers = alike.setdefault(words[one.verdict], {})
        numbers.setdefault(_numbers(one, claim.quantity.unit), []).append(setting)
    over, parts = f"over {count(seeds, 'seed')}", []
    for said, by_numbers in alike.items():
        told = [
            f"with {joined(settings)} delivery {numbers}"
            for numbers, settings in by_numbers.items()
            if numbers
        ]
        settings = [setting for several in by_numbers.values() for setting in several]
        if len(alike) > 1:
            said = f"with {joined(settings)} delivery {said}"
            told = [*by_numbers] if len(by_numbers) == 1 and told else told
        parts.append(f"{said}: {over}, {'; '.join(told)}" if told else said)
    if seeds < USUAL_SEEDS and any(one.verdict is Verdict.UNDECIDED for one in findings.values()):
        parts.append(MORE)
    return sentence(f"{'; '.join(parts)}.")


def _numbers(finding: Finding, unit: str) -> str:
    """The contrast that decided, its effect and its interval; nothing if they say nothing."""
    contrast = finding.contrast
    if finding.verdict is Verdict.NOT_TESTED:
        return ""
    if finding.verdict is Verdict.UNDECIDED and contrast.seeds < LEAST_SEEDS:
        return ""
    effect, low, high = map(number, (finding.effect, finding.low, finding.high))
    text = f"{contrast.label} is {effect} {unit}, between {low} and {high}"
    return text + (", too little to matter" if finding.verdict is Verdict.EQUIVALENT else "")


def _extremes(lines: Sequence[Mapping], seeds: int) -> str:
    """The learners that return most and least in the typical run."""
    where = "In the typical run" if seeds >= LEAST_SEEDS else f"With {count(seeds, 'seed')}"
    where += " at the configurations of the table below"
    ordered = sorted(lines, key=lambda line: line["return_last50_iqm"], reverse=True)
    told = [
        f"{Variant(line['learner'], line['hyperparameters']).label} with {line['delivery']} "
        f"delivery returns {number(line['return_last50_iqm'])}"
        for line in (ordered[0], ordered[-1])
    ]
    if len(ordered) == 1:
        return f"{where}, {told[0]} in {number(lines[0]['steps_last50_iqm'])} steps."
    return f"{where}, {told[0]}, the most, and {told[1]}, the least."


def _doings(comparison: Comparison) -> str:
    """What the final policies do, and whose they mostly are that do not deliver."""
    codes, (rows, seeds) = comparison.behaviours, comparison.behaviours.shape
    grid = f"{count(rows, 'configuration')}, {count(seeds, 'seed')} each"
    done, all_of_them = counts(codes), f"{thousands(codes.size)} final policies ({grid})"
    delivers = done.pop(DELIVERS, 0)
    if not done:
        return f"All {all_of_them} deliver." if codes.size > 1 else "The final policy delivers."
    rest = joined([f"{thousands(n)} {_DOING[code]}" for code, n in done.items()])
    text = f"Of {all_of_them}, {thousands(delivers) if delivers else 'none'} deliver; {rest}"
    idle: Counter = Counter()
    for row, runs in zip(comparison.rows, codes, strict=True):
        idle[row.variant, row.delivery] += int((runs != DELIVERS).sum())
    if len(idle) > 1:
        [((variant, setting), most)] = idle.most_common(1)
        share = percent(most / idle.total())
        whose = f"{variant.label} with {setting} delivery"
        text += f"; of those that do not deliver, {share} are {whose}"
    return f"{text}."


_DOING = {WALKS: "walk the trail", CIRCLES: "circle with food", OTHER: "do something else"}


def temptation(baselines: Sequence[Mapping]) -> str:
    """What pays more than deliveries, where the optimal policy makes none; else nothing."""
    known = [row for row in baselines if row["return_mean"] is not None]
    fair = [row["return_mean"] for row in known if row["baseline"] == "shortest delivery"]
    for row in known:
        idle = row["baseline"] == "optimal policy" and row["deliveries_mean"] == 0
        if idle and fair and row["return_mean"] > fair[0]:
            return (
                f"At discount {row['discount']:g} the optimal policy does not deliver either: it "
                f"returns {figure(row['return_mean'])}, the shortest delivery {figure(fair[0])}."
            )
    return ""
