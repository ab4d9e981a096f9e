"""Castes of ants, and the division of a nest's ants into castes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from taichi_ants.errors import AntsError, count
from taichi_ants.features.feature import ANT, Array, Feature, State, Task
from taichi_ants.features.labour import Threshold
from taichi_ants.features.life import Ticks
from taichi_ants.grid.constants import MAX_CASTES, MAX_NESTS
from taichi_ants.settings import Setting, Settings

if TYPE_CHECKING:
    import numpy as np

CASTE = "caste"  # an entry for each caste
ALL, NOTHING = "all", "none"  # values of `Caste.lays` that are not names
Rate = Annotated[float | None, Setting(least=0, most=1)]
Number = Annotated[int | None, Setting(least=0)]
Temperature = Annotated[float | None, Setting(least=1e-6, most=1e6)]
Attraction = Annotated[float | None, Setting(least=0.001, most=1e6)]
Exponent = Annotated[float | None, Setting(least=0, most=20)]


@dataclass(frozen=True, repr=False)
class Caste(Settings, path="task.castes.NAME"):
    """A caste of ants, for colonies only.

    Ants of a caste share a table of action values, and can have their own numbers. None means that
    they have those of the task, or of the training. Castes without `share` and `ants` divide the
    remaining share equally. `threshold` can also be a number, which is a fixed threshold.

    >>> castes = {"scouts": {"share": 0.25, "epsilon": 0.5}, "others": {}}
    >>> Task(castes=castes).castes["scouts"].epsilon
    0.5
    """

    sentences: ClassVar[dict[str, str]] = {
        "share": "It has the share {share} of the ants of a nest.",
        "ants": "It has {ants} ants in each nest at the start.",
        "nest": "Only nest {nest} has it.",
        "policy": "Its ants follow the policy `{policy}` and do not learn.",
        "epsilon": "Its exploration rate is {epsilon}.",
        "epsilon_spread": "The rates of its ants differ from that by up to {epsilon_spread}.",
        "learning_rate": "Its learning rate is {learning_rate}.",
        "discount": "Its discount is {discount}.",
        "temperature": "Its temperature is {temperature}.",
        "lays": "Its ants lay these pheromones: {lays}.",
        "outbound_cue": "Without food, its ants see cells as T by `{outbound_cue}`.",
        "homing_cue": "With food, its ants see cells as S by `{homing_cue}`.",
        "lifespan": "Its ants die at the age of {lifespan} ticks.",
        "threshold.distribution=fixed": "The threshold of its ants is {threshold.value}.",
        "threshold.distribution=uniform": "The thresholds of its ants are uniform, "
        "{threshold.value} ± {threshold.spread}.",
        "threshold.distribution=normal": "The thresholds of its ants are normal, with the mean "
        "{threshold.value} and the standard deviation {threshold.spread}, without negative ones.",
        "threshold.distribution=lognormal": "The thresholds of its ants are lognormal, with the "
        "median {threshold.value} and the standard deviation {threshold.spread} of the logarithm.",
    }

    most_entries = MAX_CASTES

    share: Annotated[Rate, Setting("share of the ants of a nest, after `ants` of castes")] = None
    ants: Annotated[
        Number, Setting("ants in each nest at the start, instead of a share", most=1 << 24)
    ] = None
    nest: Annotated[Number, Setting("number of its nest; off: each nest", most=MAX_NESTS - 1)] = (
        None
    )
    policy: Annotated[
        str | None, Setting("policy file, or name of a hand-written policy, to follow; off: learn")
    ] = None
    epsilon: Annotated[Rate, Setting("constant exploration rate")] = None
    epsilon_spread: Annotated[
        Rate, Setting("half the range of exploration rates around `epsilon`", most=0.5)
    ] = None
    learning_rate: Annotated[Rate, Setting("constant learning rate", least=1e-37)] = None
    discount: Annotated[Rate, Setting("discount factor")] = None
    temperature: Annotated[Temperature, Setting("temperature of the rule softmax")] = None
    k: Annotated[Attraction, Setting("attraction of a cell without a trail (deneubourg)")] = None
    exponent: Annotated[Exponent, Setting("exponent of the attraction of a cell (deneubourg)")] = (
        None
    )
    lays: Annotated[str, Setting("pheromones to lay: all, none, or names with commas")] = ALL
    outbound_cue: Annotated[str | None, Setting("pheromone seen as T; off: that of the task")] = (
        None
    )
    homing_cue: Annotated[str | None, Setting("cue seen as S; off: that of the task")] = None
    lifespan: Annotated[Ticks, Setting("age at which an ant dies; off: that of the task")] = None
    threshold: Annotated[Threshold, Setting("response thresholds of the ants")] = Threshold()

    def _faults(self) -> Iterator[str]:
        path, spread, epsilon = self.path, self.epsilon_spread, self.epsilon
        if self.share is not None and self.ants is not None:
            yield f"`{path}.ants` is {self.ants}, but `share` is {self.share}; give one of them."
        if spread is not None and epsilon is None:
            yield f"`{path}.epsilon_spread` is {spread}, but `epsilon` is off; set it, too."
        if spread is not None and epsilon is not None and spread > min(epsilon, 1 - epsilon):
            yield (
                f"`{path}.epsilon_spread` is {spread}; with `epsilon` {epsilon} it must be at most "
                f"{min(epsilon, 1 - epsilon):g}, because rates lie between 0 and 1."
            )

    def pheromones_laid(self, names: Sequence[str]) -> list[str]:
        """Return the pheromones that the ants lay, of those with these names."""
        if self.lays in (ALL, NOTHING):
            return list(names) if self.lays == ALL else []
        return [name.strip() for name in self.lays.split(",")]


def parts_in(castes: Mapping[str, Caste], nest: int) -> list[tuple[int, float]]:
    """Return the `ants` of each caste of a nest, 0 without, and its share of all other ants there.

    AntsError if the nest has no caste, or shares do not add up to 1.
    """
    ours = [caste for caste in castes.values() if caste.nest in (None, nest)]
    if not ours:
        raise AntsError(
            f"`task.castes` has no caste for nest {nest}; add one, or leave `nest` out of a caste."
        )
    shares = [caste.share for caste in ours if caste.share is not None]
    n_open = sum(caste.share is None and caste.ants is None for caste in ours)
    left = 1.0 - sum(shares)
    if left < -1e-9 or (shares and not n_open and left > 1e-9):
        raise AntsError(
            f"the shares of `task.castes` in nest {nest} add up to {sum(shares):g}; they must add "
            "up to 1, or to less if another caste has neither `share` nor `ants`."
        )
    equal, parts = max(left, 0.0) / max(n_open, 1), []
    for caste in castes.values():
        share = equal if caste.share is None else caste.share
        part = (0, share) if caste.ants is None else (caste.ants, 0.0)
        parts.append(part if caste.nest in (None, nest) else (0, 0.0))
    return parts


def numbers_in(castes: Mapping[str, Caste], nest: int, n: int) -> list[int]:
    """Return the number of ants of each caste among the n ants of a nest at the start.

    The ants that `ants` does not give to castes are divided by shares: each caste gets the whole
    part of its quota, which is rounded to nine decimals, and the castes with the largest remainders
    get one more. The first of equal remainders comes first.

    AntsError if there are too few ants, or ants without a caste.
    """
    parts = parts_in(castes, nest)
    given = sum(ants for ants, _ in parts)
    rest = n - given
    if rest < 0 or (rest > 0 and not any(share for _, share in parts)):
        raise AntsError(
            f"the castes have {given} ants in nest {nest}, but {n} ants start there; change "
            "`ants` of a caste, or give a caste a share."
        )
    quotas = [round(share * rest, 9) for _, share in parts]
    counts = [ants + int(quota) for (ants, _), quota in zip(parts, quotas, strict=True)]
    order = sorted(range(len(quotas)), key=lambda i: int(quotas[i]) - quotas[i])
    for i in order[: n - sum(counts)]:
        counts[i] += 1
    return counts


def chances_in(castes: Mapping[str, Caste], nest: int, n: int) -> list[float]:
    """Return the probability of each caste for an ant that is born in a nest that n ants start.

    That is the caste's share, or its `ants` divided by n.
    """
    parts, most = parts_in(castes, nest), max(n, 1)
    rest = (n - sum(ants for ants, _ in parts)) / most if n else 1.0
    return [ants / most + share * rest for ants, share in parts]


def _columns(state: State) -> dict[str, np.ndarray]:
    """Return the caste of each ant that starts, int8 (W, ants)."""
    import numpy as np

    nests = state.nests_at_start
    castes = np.zeros(nests.shape, np.int8)
    for w, nest in np.ndindex(len(nests), state.n_nests):
        ours = nests[w] == nest
        numbers = numbers_in(state.task.castes, nest, int(ours.sum()))
        castes[w, ours] = np.repeat(np.arange(len(numbers)), numbers)
    return {"caste": castes}


def numbers_of_castes(features: tuple[Feature, ...]) -> dict[str, Any]:
    """Return the numbers of castes that features declare, by name, in order."""
    return {name: of for feature in features for name, of in feature.of_castes.items()}


def _constants(state: State) -> dict[str, np.ndarray]:
    """Return the numbers and update weights of castes, chances of newborn ants, and scratch."""
    import numpy as np

    nests, chances, castes = state.nests_at_start, [], state.task.castes.values()
    for w, nest in np.ndindex(len(nests), state.n_nests):
        n = int(np.count_nonzero(nests[w] == nest))
        chances.append(np.cumsum(chances_in(state.task.castes, nest, n)))
    rows = numbers_of_castes(state._model.features).values()
    weights = [state._update_weights(caste.learning_rate or 0.0) for caste in castes]
    longest = max(map(len, weights))
    return {
        # By number and caste, f64.
        "castes": np.array([[of(state.task, caste) for caste in castes] for of in rows], float),
        # By caste and n, see `update_weights`; unused without an own learning rate.
        "caste_weights": np.stack(
            [np.pad(one, (0, longest - len(one)), mode="edge") for one in weights]
        ),
        # By world, nest and caste: cumulative.
        "caste_chances": np.concatenate(chances),
        "delivered_by_caste": np.zeros(len(nests) * state.chunks * MAX_CASTES, np.int32),
    }


def update_weights_of(state: State, castes: np.ndarray, ants: np.ndarray) -> np.ndarray:
    """Return the weight of the mean error of several ants of a caste in an update.

    Arrays (n,), int and float64. Castes that do not learn have the weight 0.
    """
    import numpy as np

    weights = state.arrays["weights"]
    weights = weights[np.minimum(ants, len(weights) - 1)]
    if not state.task.castes:
        return weights
    own, numbers = state.arrays["caste_weights"], state.arrays["castes"][:, castes]
    numbers = dict(zip(CASTES.of_castes, numbers, strict=False))
    of_castes = own[castes, np.minimum(ants, own.shape[1] - 1)]
    weights = np.where(numbers["learning_rate"] >= 0, of_castes, weights)
    return np.where(numbers["learns"] == 1, weights, 0.0)


def _refusals(task: Task, worlds: Any, sharing: str) -> Iterator[str]:
    for name, caste in task.castes.items():
        if caste.nest is not None and caste.nest >= (n := worlds[0].n_nests):
            yield (
                f"`task.castes.{name}.nest` is {caste.nest}, but the world has "
                f"{count(n, 'nest')}, numbered from 0; choose one of them."
            )
        if caste.policy is not None and sharing == "independent":
            yield (
                f"`task.castes.{name}.policy` is {caste.policy!r}, but sharing is "
                '"independent", so each ant learns into its own table; set sharing to "shared" or '
                '"frozen".'
            )


def _newborn(state: State, w: int, nests: np.ndarray, draw: Callable[[int], np.ndarray]) -> Any:
    import numpy as np

    if len(state.task.castes) == 1:
        return {}
    drawn = (draw(len(nests)) >> np.uint64(32)) / 2.0**32
    bounds = state._part("caste_chances", w).reshape(state.n_nests, -1)[nests, :-1]
    return {"caste": np.count_nonzero(bounds <= drawn[:, None], axis=1)}


def _policies(task: Task) -> dict[int, tuple[str, str]]:
    """Return the policies of castes by number, and their names in messages."""
    return {
        number: (caste.policy, f"`task.castes.{name}.policy`")
        for number, (name, caste) in enumerate(task.castes.items())
        if caste.policy is not None
    }


def _without_policies(task: Task) -> Task:
    follow = [name for name, caste in task.castes.items() if caste.policy is not None]
    return task.replace(castes={name: {"policy": "random"} for name in follow})


def _counts(state: State) -> dict[str, np.ndarray]:
    """Return the deliveries by caste, (W, castes); one column for all ants without castes."""
    by_caste = state.caste_deliveries if state.task.castes else state.deliveries[:, None]
    return {"caste_deliveries": by_caste}


def _lays(task: Task, caste: Caste) -> int:
    """Return a bit for each pheromone that the ants of a caste lay."""
    names = list(task.pheromones)
    return sum(1 << names.index(name) for name in set(caste.pheromones_laid(names)))


def _own(name: str) -> Callable[[Task, Caste], float]:
    """Return a function of the number of a caste; that of the colony is -1."""
    return lambda task, caste: -1.0 if getattr(caste, name) is None else getattr(caste, name)


CASTES = Feature(
    Caste,
    uses=lambda task: bool(task.castes),
    spaces={CASTE: lambda state: len(state.task.castes)},
    tables_by=CASTE,
    policies=_policies,
    without_files=_without_policies,
    arrays=(
        Array("caste", ANT, "i1", "castes", "i4", doc="Number of the caste"),
        Array(
            "caste_deliveries",
            CASTE,
            "i4",
            "caste_deliveries",
            "i4",
            unit="items",
            doc="Deliveries of each caste in this episode",
        ),
    ),
    of_castes={
        "epsilon": _own("epsilon"),
        "epsilon_spread": lambda task, caste: caste.epsilon_spread or 0.0,
        **{name: _own(name) for name in ("learning_rate", "discount")},
        "learns": lambda task, caste: caste.policy is None,
        "lays": _lays,
        "cues": lambda task, caste: task.all_cues.index(task.cues_of(caste)),
    },
    fixed=lambda caste: (
        *(caste.share, caste.ants, caste.nest, caste.policy),
        bool(caste.epsilon_spread),
    ),
    columns=_columns,
    constants=_constants,
    counts=_counts,
    refusals=_refusals,
    newborn=_newborn,
)
