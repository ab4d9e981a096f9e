"""The comparison in three sentences: who returns most, who needs the fewest steps, what ants do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from taichi_ants.analysis.behaviour import CIRCLES, DELIVERS, OTHER, WALKS, counts
from taichi_ants.analysis.findings import LEAST_SEEDS, Finding, Verdict, too_few
from taichi_ants.analysis.paper.audit import Audit
from taichi_ants.analysis.paper.claims import Claim
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.tables import figure, joined, number, percent, sentence, thousands
from taichi_ants.errors import count

# The claims that answer the question, each as said where it holds and where it does not.
_CLAIMS = {
    "q-return-highest": ("Q-learning returns most", "Q-learning does not return most"),
    "overall-sarsa-length": ("SARSA needs the fewest steps", "SARSA does not need the fewest"),
}
USUAL_SEEDS = 100  # what `compare` takes unless told otherwise
MORE = f"compare --seeds {USUAL_SEEDS} tells more"
NEEDS = "that takes the paper's world, its configurations and 100 episodes"


def answer(comparison: Comparison, lines: Sequence[Mapping], audit: Audit) -> list[str]:
    """Three sentences, computed from the verdicts and from what the final policies do.

    `lines` are those of `table2.table2`.
    """
    by_id = {claim.id: (claim, findings) for claim, findings in audit.items()}
    verdicts = {one.verdict for name in _CLAIMS for one in by_id[name][1].values()}
    seeds = len(comparison.seeds)
    if verdicts == {Verdict.NOT_TESTED}:
        first = f"The paper's claims are not tested here: {NEEDS}."
    elif verdicts == {Verdict.UNDECIDED} and seeds < LEAST_SEEDS:
        claims = " or ".join(holds for holds, _ in _CLAIMS.values())
        first = f"{too_few(seeds)} {claims}, as the paper says; {MORE}."
    else:
        told = [_told(*words, *by_id[name]) for name, words in _CLAIMS.items()]
        return [*told, _doings(comparison)]
    return [first, _extremes(lines, seeds), _doings(comparison)]


def _told(holds: str, fails: str, claim: Claim, findings: Mapping[str, Finding]) -> str:
    """What became of a claim, with the numbers; delivery settings that agree share the words."""
    seeds = max(one.contrast.seeds for one in findings.values())
    stays_open = f"whether {holds}, as the paper says, stays open"
    if seeds < USUAL_SEEDS:
        says = "" if seeds < LEAST_SEEDS else ", as the paper says"
        stays_open = f"{too_few(seeds)} {holds}{says}"
    words = {
        Verdict.SUPPORTED: f"{holds}, as the paper says",
        Verdict.CONTRADICTED: f"{fails}, although the paper says so",
        Verdict.EQUIVALENT: f"{fails}, although the paper says so",
        Verdict.UNDECIDED: stays_open,
        Verdict.NOT_TESTED: f"whether {holds}, as the paper says, is not tested",
    }
    alike: dict[str, dict[str, str]] = {}  # the numbers of settings, by the words
    for setting, one in findings.items():
        alike.setdefault(words[one.verdict], {})[setting] = _numbers(one, claim.quantity.unit)
    parts = []
    for said, numbers in alike.items():
        same = len(set(numbers.values())) == 1
        by_setting = [f"with {setting} delivery {one}" for setting, one in numbers.items()]
        where = "" if len(alike) == 1 else f"with {joined(list(numbers))} delivery "
        told = next(iter(numbers.values())) if same else "; ".join(by_setting)
        parts.append(f"{where}{said}: {told}" if told else f"{where}{said}")
    if seeds < USUAL_SEEDS and any(one.verdict is Verdict.UNDECIDED for one in findings.values()):
        parts.append(MORE)
    return sentence(f"{'; '.join(parts)}.")


def _numbers(finding: Finding, unit: str) -> str:
    """The contrast that decided, its effect and its interval; nothing of what few seeds say."""
    contrast = finding.contrast
    if finding.verdict is Verdict.NOT_TESTED:
        return NEEDS
    if finding.verdict is Verdict.UNDECIDED and contrast.seeds < LEAST_SEEDS:
        return ""
    effect, low, high = map(number, (finding.effect, finding.low, finding.high))
    text = f"{contrast.label} is {effect} {unit}, between {low} and {high}"
    return text + (", too little to matter" if finding.verdict is Verdict.EQUIVALENT else "")


def _extremes(lines: Sequence[Mapping], seeds: int) -> str:
    """The learners that return most and least in the typical run."""
    where = "In the typical run" if seeds >= LEAST_SEEDS else f"With {count(seeds, 'seed')}"
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
    codes = comparison.behaviours
    done, all_of_them = counts(codes), f"{thousands(codes.size)} final policies"
    delivers = done.pop(DELIVERS, 0)
    if not done:
        return f"All of {all_of_them} deliver." if codes.size > 1 else "The final policy delivers."
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
