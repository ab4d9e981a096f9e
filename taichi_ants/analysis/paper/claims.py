"""All empirical claims of the paper, in its order, as `claims.toml` has them."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from typing import Any

from taichi_ants.analysis.findings import Criterion
from taichi_ants.analysis.paper import quantities
from taichi_ants.analysis.paper.published import FACTORS, VARIANTS
from taichi_ants.analysis.paper.quantities import Quantity
from taichi_ants.files import tomllib


@dataclass(frozen=True, eq=False)
class Claim:
    """An empirical claim of the paper, made precise.

    Attributes:
        id, section, statement: A unique name, the paper's section, its claim in our words.
        criterion: What every effect of the quantity must fulfil. It decides how far a word such as
            "about", "close" or "consistently" goes.
        quantity: What is computed.
        why: Why this criterion or quantity, where it is not plain.
    """

    id: str
    section: str
    statement: str
    criterion: Criterion
    quantity: Quantity
    why: str = ""

    @property
    def tested_on(self) -> str:
        """What is computed, and why so."""
        text = f"{self.quantity.words}: {'; '.join(self.quantity.effects)}"
        return f"{text}; {self.why}" if self.why else text

    @property
    def estimator(self) -> str:
        """What of the seeds must fulfil the criterion."""
        return "interquartile mean" if self.quantity.uses_iqm else "mean"


# Names in the file for arguments of quantities, besides measures.
_NAMED: dict[str, Any] = {
    **{one.label: one for one in VARIANTS},
    "at table 2": quantities.AT_TABLE_2,
    "at figure 1": quantities.AT_FIGURE_1,
    "mean of all": quantities.MEAN_OF_ALL,
    "least of all": quantities.LEAST_OF_ALL,
    "best on held-out seeds": quantities.BEST,
    "epsilon at table 2": quantities.EPSILON_AT_TABLE_2,
    **{f"effect of {name}": quantities.effect_of(name) for name in FACTORS},
    **{f"reversed effect of {name}": quantities.effect_of(name, sign=-1) for name in FACTORS},
    **{
        f"less exploration {e} {d}": quantities.less_exploration(e, d)
        for e in (0, 1)
        for d in (0, 1)
    },
}


def _claims() -> tuple[Claim, ...]:
    path = resources.files(__package__).joinpath("claims.toml")
    file = tomllib.loads(path.read_text(encoding="utf-8"))

    def arguments(word: str) -> list[Any]:
        if word in file["groups"]:
            return [one for words in file["groups"][word] for one in arguments(words)]
        both = [_NAMED.get(part, part) for part in word.split(" minus ")]
        return [tuple(both)] if both[1:] else both

    def claim(quantity: list[str], **facts: Any) -> Claim:
        compute, *words = quantity
        criterion = Criterion(**{n: facts.pop(n) for n in ("low", "high", "margin") if n in facts})
        given = [one for word in words for one in arguments(word)]
        return Claim(criterion=criterion, quantity=getattr(quantities, compute)(*given), **facts)

    return tuple(claim(**one) for one in file["claims"])


CLAIMS = _claims()
