"""What a task and a world use, and what those who run them support.

`Task.uses` and `World.uses` name every setting that differs from its default. Each engine,
environment and analysis has a set of the names that it supports, and refuses all others in one
sentence. So a feature that is added later is refused wherever no set names it: the two engines have
the features that declare hooks for them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from taichi_ants.errors import AntsError
from taichi_ants.features import FEATURES

# Of a lone ant, without what features of the model add. A group, such as `rewards`, stands for all
# of its settings.
PLAIN = frozenset(
    {
        *("observation", "rewards", "traffic", "turns_at_queen", "delivery"),
        *("evaporation_in_training", "evaporation_in_evaluation", "pheromone.evaporation=none"),
        *("pheromone.deposit=none", "pheromone.deposit=add", "pheromone.deposit=fading"),
        *("pheromone.level", "pheromone.cap", "pheromone.slope", "pheromone.view"),
        *("choice.rule=softmax", "choice.temperature"),
    }
)
LONE = PLAIN | {feature.name for feature in FEATURES if feature.runs_alone}
CHOICE = frozenset({"choice.rule", "choice.temperature", "choice.k", "choice.exponent"})
CHOICE |= {"choice.carriers_follow"}
FIELDS = frozenset({"fields", "reads", "outbound_cue", "homing_cue"})
FOODS = frozenset({"foods", "kinds of food"})
CASTES = frozenset({"castes"})
OWN_RULES = frozenset({"rules", "reward"})
# Of a colony, without what only colonies have of the features of the model.
BASE = LONE | CHOICE | FIELDS | FOODS | CASTES | OWN_RULES
BASE |= {"pheromone", "nests"}
BASE |= {"life.births", "life.lifespan", "life.regrowth", "life.pile_move_interval"}
COLONY = BASE | {feature.group for feature in FEATURES}


def refuse_unsupported(
    what: str, uses: Mapping[str, str], supports: Collection[str], instead: str = "leave it out"
) -> None:
    """Raise AntsError if `uses` has a feature that is not in `supports`.

    A set has a feature if it has its name with its value, its name, or its group. The message says
    that `what` does not support it, and what to do `instead`.
    """
    for feature, words in uses.items():
        name = feature.partition("=")[0]
        if not {feature, name, name.rpartition(".")[0]}.intersection(supports):
            raise AntsError(f"{words}, which {what} does not support; {instead}.")
