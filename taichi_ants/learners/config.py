"""The configuration of a learner."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from taichi_ants.errors import AntsError
from taichi_ants.settings import Setting, Settings, Share, declared, table_of

if TYPE_CHECKING:
    import numpy as np

Factor = Annotated[float, Setting(above=0, most=1)]
InitialValue = Annotated[float, Setting(least=-1_000_000, most=1_000_000)]


@dataclass(frozen=True)
class TrainingConfig(Settings, path="training"):
    """The learner and its settings, each declared with its range and meaning.

    Lower bounds of a decay never raise a value: if `min_epsilon` is larger than `epsilon`, epsilon
    does not change. If `initial_q` is larger than all possible returns ("optimistic"), ants try all
    actions. `hyperparameters` are those of the learner, sorted (name, number) pairs. Give them as a
    mapping or as keywords: `TrainingConfig("dyna_q", ..., planning_steps=5)`. All others have the
    defaults of `taichi_ants.learners.get(name).hyperparameters()`. Training checks that the learner
    exists, and its hyperparameters if you register it after this call.

    >>> TrainingConfig("dyna_q", 0.1, 0.9, 0.3, 0.99, planning_steps=3).planning_steps
    3
    """

    sentences: ClassVar[dict[str, str]] = {
        "": "Ants learn action values, which start at {initial_q}. After a step from state s by "
        "action a, `Q(s, a)` changes by the learning rate times `target - Q(s, a)`. The discount "
        "is {discount}, and ε {epsilon} in the first episode.",
        "learning_rate_decay=1": "The learning rate is {learning_rate}.",
        "learning_rate_decay": "The learning rate is {learning_rate} in the first episode; each "
        "episode multiplies it by {learning_rate_decay}, down to {min_learning_rate}.",
        "epsilon_decay": "Each episode multiplies ε by {epsilon_decay}, down to {min_epsilon}.",
    }

    learner: Annotated[str, Setting("name of the learner, such as sarsa or q_learning")]
    # Smaller step sizes could underflow to zero in float32.
    learning_rate: Annotated[
        float, Setting("learning rate of the first episode", least=1e-37, most=1)
    ]
    discount: Annotated[Share, Setting("discount factor")]
    epsilon: Annotated[
        Share, Setting("exploration rate (probability of a random action) in the first episode")
    ]
    epsilon_decay: Annotated[Factor, Setting("factor that multiplies epsilon after each episode")]
    min_epsilon: Annotated[Share, Setting("smallest value to which epsilon decays")] = 0.01
    learning_rate_decay: Annotated[
        Factor, Setting("factor that multiplies the learning rate after each episode")
    ] = 1.0
    min_learning_rate: Annotated[
        Share, Setting("smallest value to which the learning rate decays")
    ] = 0.0
    initial_q: Annotated[
        InitialValue,
        Setting("action values before learning; high values make ants try every action"),
    ] = 0.0
    hyperparameters: tuple[tuple[str, float], ...] = ()
    _checked: ClassVar[Callable[[Any, Mapping[str, Any]], dict[str, Any]]]  # the registry sets it

    if not TYPE_CHECKING:

        def __new__(cls, *values: Any, **named: Any) -> TrainingConfig:
            # First, because Python would only say that the setting with a misspelt name is missing.
            more = {n: v for n, v in named.items() if n not in cls.__match_args__}
            cls._checked(*values[:1] or [named.get("learner")], more)
            return object.__new__(cls)

    def __init__(
        self,
        learner: str,
        learning_rate: float,
        discount: float,
        epsilon: float,
        epsilon_decay: float,
        min_epsilon: float = 0.01,
        hyperparameters: Mapping[str, float] | Iterable[tuple[str, float]] = (),
        *,
        learning_rate_decay: float = 1.0,
        min_learning_rate: float = 0.0,
        initial_q: float = 0.0,
        **more: float,
    ) -> None:
        values = locals()
        for setting in declared(TrainingConfig):
            object.__setattr__(self, setting.name, values[setting.name])
        self.check()
        pairs = {**table_of("training.hyperparameters", hyperparameters), **more}
        checked = TrainingConfig._checked(learner, pairs)
        object.__setattr__(self, "hyperparameters", tuple(sorted(checked.items())))

    @classmethod
    def from_dict(cls, facts: Any) -> TrainingConfig:
        """Return the configuration in a mapping, which can have hyperparameters, too.

        >>> TrainingConfig.from_dict(config.as_dict()) == config
        True
        """
        return cls(**{**cls._required(facts), **facts})

    @classmethod
    def frozen(cls, epsilon: float = 0.0) -> TrainingConfig:
        """Return the settings of ants that explore with a constant epsilon, and do not learn.

        >>> TrainingConfig.frozen(epsilon=0.1).epsilon
        0.1
        """
        return cls("q_learning", 1.0, 1.0, epsilon, 1.0)

    @property
    def least_epsilon(self) -> float:
        """The epsilon at which decay ends, the smaller of `min_epsilon` and `epsilon`."""
        return min(self.min_epsilon, self.epsilon)

    @property
    def least_learning_rate(self) -> float:
        """The learning rate at which decay ends."""
        return min(self.min_learning_rate, self.learning_rate)

    def replace(self, /, **changes: Any) -> TrainingConfig:
        """Return the configuration with changes; a new learner starts without hyperparameters.

        >>> config.replace(learner="q_learning").learner
        'q_learning'
        """
        common = {s.name: changes.pop(s.name) for s in declared(type(self)) if s.name in changes}
        same = common.get("learner", self.learner) == self.learner
        kept = dict(self.hyperparameters) if same else {}
        return super().replace(**common, hyperparameters={**kept, **changes})

    def next_learning_rate(self, rate: float) -> float:
        """Return the learning rate of the episode after one with learning rate `rate`."""
        return max(self.least_learning_rate, rate * self.learning_rate_decay)

    def next_epsilon(self, epsilon: float) -> float:
        """Return the epsilon of the episode after one with this epsilon."""
        return max(self.least_epsilon, epsilon * self.epsilon_decay)

    @property
    def planning_steps(self) -> int:
        """The number of updates from a model after each step, which is a hyperparameter; else 0."""
        return int(dict(self.hyperparameters).get("planning_steps", 0))

    def as_dict(self) -> dict[str, Any]:
        """Return the settings as names and numbers; `TrainingConfig(**facts)` reads them."""
        return {**asdict(self), "hyperparameters": dict(self.hyperparameters)}


@dataclass(frozen=True)
class Hyperparameters(Settings, path="training"):
    """Base of the hyperparameters of a learner; by itself, no hyperparameters.

    Declare each field as `Annotated[int, Setting(...)]` or `Annotated[float, Setting(...)]`; in
    kernels it is i32 or f32.

    >>> @dataclass(frozen=True)
    ... class Traces(learners.Hyperparameters):
    ...     trace_decay: Annotated[float, learners.Setting("lambda", least=0, most=1)] = 0.9
    >>> Traces(0.5).trace_decay
    0.5
    """

    def __post_init__(self) -> None:
        kinds = {setting.name: setting.kind for setting in declared(type(self))}
        for field in fields(self):
            if kinds.get(field.name) not in (int, float):
                raise AntsError(
                    f"the field {field.name} has the type {field.type}; declare it as "
                    "Annotated[int, Setting(...)] or Annotated[float, Setting(...)]."
                )
        self.check()


def update_weights(alpha: float, most: int) -> np.ndarray:
    """Return the weight of the mean of n TD errors in an update of a shared value, by n.

    The weight is 1 - (1 - alpha)^n, the effect of n successive updates with learning rate alpha
    towards the same target. Kernels and reference both use these float32 numbers, at most `most` +
    1, because powers differ in the last bit between libraries. Larger n have the last weight.
    """
    import numpy as np

    rate = np.float32(alpha)
    kept = 1.0 - np.float64(rate)
    # Rounding the weight to float32 drops a power below 2^-26.
    different = math.ceil(26 / -math.log2(kept)) if 0 < kept < 1 else 2
    weights = (1.0 - kept ** np.arange(min(most, max(2, different)) + 1)).astype(np.float32)
    # In float64, 1 - (1 - alpha) can differ from alpha by a rounding error.
    weights[1:2] = rate
    return weights
