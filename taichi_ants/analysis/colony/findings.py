"""What the study found: sentences for each question and arena, computed from the data.

Every statement about more or less rests on the verdicts of `contrasts.judge_all`; where these can
tell no difference from chance, the sentence says so. Another outcome gives another sentence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from taichi_ants.analysis.colony.contrasts import (
    COPIES,
    CROWDING,
    CURE,
    FIRST,
    TRAIL,
    Judged,
    Sizes,
    Verdicts,
    decline,
    judge_all,
    peak,
)
from taichi_ants.analysis.colony.differences import Difference
from taichi_ants.analysis.colony.sentences import UNTOLD, ants, comparison, figure, percent
from taichi_ants.analysis.colony.study import (
    COPIED,
    COPIED_LONG,
    JOINT,
    LASTING,
    OFF,
    ON,
    OWN,
    PHEROMONES,
    THEN_JOINT,
    WAYS,
    Arena,
    ColonyStudy,
)

POSSIBLE = "How far is this from what is possible?"
# Crowding counts as cured if each ant delivers at least this share of what an ant alone does.
CURED = 0.9


@dataclass(frozen=True)
class Finding:
    """A sentence, and the question and the arena that it is about."""

    question: str
    arena: str
    sentence: str


def find(study: ColonyStudy, judged: Judged | None = None) -> list[Finding]:
    """All findings, by question.

    Args:
        study: The study.
        judged: Its verdicts, from `judge_all`; computed if None.
    """
    judged = judge_all(study) if judged is None else judged
    return [
        Finding(question, arena.name, f"In {arena.words}, {sentence}.")
        for question, answer in ANSWERS.items()
        for arena in study.arenas
        for sentence in answer(_Scene(study, arena, judged.get((arena.name, question), {})))
    ]


@dataclass(frozen=True)
class _Scene:
    """A study as seen in one arena, with the verdicts for one question."""

    study: ColonyStudy
    arena: Arena
    verdicts: Verdicts

    def sizes(self, way: str = COPIED, pheromone: str = ON) -> tuple[int, ...]:
        return self.study.sizes(self.arena, pheromone, way)

    def mean(self, way: str, n: int, measure: str = "deliveries", pheromone: str = ON) -> float:
        return self.study.mean(self.arena, pheromone, way, n, measure)

    def by_size(self, name: str) -> dict[int, Difference]:
        """The verdicts of a contrast between equally many ants."""
        return {n: difference for (n, _), difference in self.verdicts[name].items()}

    def compare(
        self, name: str, first: str, second: str, one: tuple[str, str], other: tuple[str, str]
    ) -> str:
        """`comparison` on a contrast; `one` and `other` are (way, pheromone)."""
        judged = self.by_size(name)
        means = [
            {n: self.mean(way, n, pheromone=pheromone) for n in judged}
            for way, pheromone in (one, other)
        ]
        return comparison(first, second, judged, *means)


def _copies(scene: _Scene) -> Iterator[str]:
    for name, way, who in (
        ("copies_total", COPIED, "copies of an ant trained alone"),
        ("joint_total", JOINT, "jointly trained ants"),
    ):
        if scene.verdicts[name]:
            totals = {n: scene.mean(way, n) for n in scene.sizes(way)}
            yield f"{who} {_growth(totals, scene.verdicts[name])}"


def _growth(totals: dict[int, float], verdicts: Mapping[Sizes, Difference]) -> str:
    top, first, last = peak(verdicts), min(totals), max(totals)
    if top == first:
        falls = decline(verdicts)
        numbers = f"{figure(totals[first])} per 1000 ticks with {first}, {figure(totals[last])}"
        if falls:
            return (
                f"deliver less the more there are, from {ants(falls[0])} on: {numbers} with {last}"
            )
        return f"deliver no more beyond chance the more there are: {numbers} with {last}"
    times = totals[top] / totals[first] if totals[first] > 0 else float("inf")
    text = (
        f"deliver more the more there are, up to {ants(top)}: {figure(totals[first])} per 1000 "
        f"ticks with {first}, {figure(totals[top])} with {top}, {figure(times)} times as many"
    )
    fewer = [n for n in totals if n > top and verdicts[n, top].sign < 0]
    if fewer:
        return f"{text}; with {fewer[0]} it is less again, {figure(totals[fewer[0]])}"
    if top == last:
        return f"{text}, and it still grows there"
    rest = f"beyond that no growth can be told from chance ({figure(totals[last])} with {last})"
    return f"{text}; {rest}"


def _crowding(scene: _Scene) -> Iterator[str]:
    for name, way, pheromone, who in (
        ("copies_each", COPIED, ON, "copies of an ant trained alone"),
        ("copies_each_off", COPIED, OFF, "copies that lay no trails"),
        ("joint_each", JOINT, ON, "jointly trained ants"),
    ):
        if scene.verdicts[name]:
            sizes = scene.sizes(way, pheromone)
            each = {n: scene.mean(way, n, "per_ant", pheromone) for n in sizes}
            blocked = {n: scene.mean(way, n, "blocked", pheromone) for n in sizes}
            yield _onset(who, each, blocked, decline(scene.verdicts[name]))


def _onset(who: str, each: dict[int, float], blocked: dict[int, float], onset: Sizes | None) -> str:
    first, last = min(each), max(each)
    if onset is None:
        return (
            f"{who} deliver no less each beyond chance in larger colonies: {figure(each[first])} "
            f"per 1000 ticks with {first}, {figure(each[last])} with {last}, where "
            f"{percent(blocked[last])} of the moves are blocked"
        )
    begin, before = onset
    text = (
        f"{who} deliver less each from {ants(begin)} on: {figure(each[begin])} per 1000 ticks "
        f"against {figure(each[before])} with {before}, while {percent(blocked[begin])} of the "
        "moves are blocked"
    )
    if begin == last:
        return text
    return f"{text}; with {last} it is {figure(each[last])} and {percent(blocked[last])}"


def _cure(scene: _Scene) -> Iterator[str]:
    jointly, copies = "jointly trained ants", "copies of an ant trained alone"
    long = f"copies of one trained alone for {scene.arena.long_factor} times as long"
    alone_first = "ants trained alone and then jointly"
    for name, first, second, one, other in (
        ("joint_copies", jointly, copies, JOINT, COPIED),
        ("joint_long", jointly, long, JOINT, COPIED_LONG),
        ("own_joint", "ants with a table each", "ants that share one", OWN, JOINT),
        ("then_joint", alone_first, "ants only trained jointly", THEN_JOINT, JOINT),
    ):
        if scene.verdicts[name]:
            yield scene.compare(name, first, second, (one, ON), (other, ON))
    for (n, _), difference in scene.verdicts["joint_against_one"].items():
        yield _cured(n, difference, scene.mean(JOINT, n, "per_ant"), scene.mean(COPIED, 1))


def _cured(n: int, difference: Difference, each: float, alone: float) -> str:
    numbers = f"each of {ants(n)} delivers {figure(each)} per 1000 ticks, one alone {figure(alone)}"
    if difference.low >= (CURED - 1) * alone:
        return f"joint learning cures crowding: {numbers}"
    if difference.sign < 0:
        return f"joint learning does not cure crowding: {numbers}"
    return f"whether joint learning cures crowding cannot be told from chance: {numbers}"


def _trail(scene: _Scene) -> Iterator[str]:
    none, lasting = "ants that lay none", "ants whose trails never evaporate"
    for name, way, pheromone, who, others in (
        ("trail_joint", JOINT, OFF, "jointly trained ants that lay trails", none),
        ("trail_copies", COPIED, OFF, "copies that lay trails", none),
        ("evaporation_joint", JOINT, LASTING, "jointly trained ants that lay trails", lasting),
        ("evaporation_copies", COPIED, LASTING, "copies that lay trails", lasting),
    ):
        if scene.verdicts[name]:
            yield scene.compare(name, who, others, (way, ON), (way, pheromone))
    yield from _reward(scene)


def _reward(scene: _Scene) -> Iterator[str]:
    """Whether reward and deliveries agree about the trail, where the latter differ most."""
    deliveries, rewards = scene.by_size("trail_joint"), scene.by_size("trail_reward")
    told = [n for n, difference in deliveries.items() if difference.sign]
    if not told:
        return
    n = max(told, key=lambda n: abs(deliveries[n].mean) / max(scene.mean(JOINT, n), 1e-9))
    with_trails, without = (
        f"{figure(scene.mean(JOINT, n, 'reward', pheromone))} reward and "
        f"{figure(scene.mean(JOINT, n, 'per_ant', pheromone))} deliveries"
        for pheromone in (ON, OFF)
    )
    numbers = (
        f"with {n}, each jointly trained ant gets {with_trails} per 1000 ticks where ants lay "
        f"trails, {without} where they do not"
    )
    signs = deliveries[n].sign, rewards[n].sign
    words = {
        (-1, 1): "trails pay ants for walking, not for delivering",
        (1, -1): "trails bring deliveries that cost reward",
        (1, 1): "trails raise reward and deliveries alike",
        (-1, -1): "trails lower reward and deliveries alike",
    }
    yield f"{words.get(signs, 'trails change deliveries, but not reward beyond chance')}: {numbers}"


def _first(scene: _Scene) -> Iterator[str]:
    for name, way in (("first_copies", COPIED), ("first_joint", JOINT)):
        for (n, _), difference in scene.verdicts[name].items():
            who = f"{n} copies" if way == COPIED else f"{n} jointly trained ants"
            crowd, one = (
                scene.mean(way, n, "first_delivery"),
                scene.mean(COPIED, 1, "first_delivery"),
            )
            fruitless = scene.mean(COPIED, 1, "fruitless")
            numbers = (
                f"{figure(crowd)} ticks to the first delivery against {figure(one)} (of one ant, "
                f"{percent(fruitless)} of the episodes end without and count in full)"
            )
            if difference.sign:
                sooner = "sooner" if difference.sign < 0 else "later"
                yield f"{who} deliver {sooner} than one ant: {numbers}"
            else:
                yield f"between {who} and one ant {UNTOLD}: {numbers}"


def _possible(scene: _Scene) -> Iterator[str]:
    limits = scene.arena.limits
    if not limits:
        return
    cycles = [limit.cycle for limit in limits]
    span = figure(min(cycles))
    if max(cycles) > min(cycles):
        span += f" to {figure(max(cycles))}"
    possible = _mean(limit.deliveries(1) for limit in limits)
    alone = [
        (scene.mean(COPIED, 1, pheromone=pheromone), trails)
        for pheromone, trails in PHEROMONES.items()
        if 1 in scene.sizes(COPIED, pheromone)
    ]
    text = (
        f"the shortest cycle from the queen to food and back takes one ant {span} ticks, so it can "
        f"deliver {figure(possible)} per 1000 ticks"
    )
    if alone:
        best, trails = max(alone)
        text += f", of which a trained one reaches {percent(best / possible)} ({trails})"
    yield text
    yield _busiest(scene)


def _busiest(scene: _Scene) -> str:
    study, arena = scene.study, scene.arena
    total, top = max(
        (study.mean(arena, c.pheromone, c.way, c.ants), c)
        for c in study.records
        if c.arena == arena.name
    )
    limit = _mean(limit.deliveries(top.ants) for limit in arena.limits)
    food = _mean(limit.food for limit in arena.limits)
    queen = _mean(limit.queen for limit in arena.limits)
    return (
        f"food can give {figure(food)} and the queen take {figure(queen)} per 1000 ticks; the "
        f"busiest colony ({ants(top.ants)}, {WAYS[top.way]}, {PHEROMONES[top.pheromone]}) delivers "
        f"{figure(total)}, {percent(total / limit)} of what so many ants can"
    )


def _mean(values: Iterable[float]) -> float:
    several = list(values)
    return sum(several) / len(several)


ANSWERS: dict[str, Callable[[_Scene], Iterator[str]]] = {
    COPIES: _copies,
    CROWDING: _crowding,
    CURE: _cure,
    TRAIL: _trail,
    FIRST: _first,
    POSSIBLE: _possible,
}
