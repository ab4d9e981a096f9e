"""The model: the properties of a task, its table and its worlds for which kernels are compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

from taichi_ants.features import used_by
from taichi_ants.features.cues import CUES
from taichi_ants.task.constants import ROW
from taichi_ants.task.task import Task


class Cues(NamedTuple):
    """The cues of some ants: numbers of pheromones, and their views.

    Ants with food follow the pheromone `followed`, see `steps.cue_level`. That is their homing cue
    unless `sense` is its name, a key of `CUES`. `half` says whether the view of the outbound cue is
    "half".
    """

    outbound: int
    followed: int
    sense: str
    half: bool
    homing_view: str

    @property
    def has_sense(self) -> bool:
        """Whether the homing cue is not a pheromone."""
        return self.sense != ""


class Model:
    """The properties that decide which kernels a colony needs; kernels read the rest as numbers.

    A model never changes. Models with equal properties are equal, and share kernels. A model does
    not pay for features that it does not use: kernels without births, deaths or food that changes
    are faster, and compile much faster.

    Args:
        learns: Whether ants learn, so that trails evaporate as in training.
        learner: The `Learner`; None if the ants do not learn.
        own_tables: Whether there is a table for each slot, not one for each world and group.
        is_given_actions: Whether ants take given actions.
    """

    def __init__(
        self,
        task: Task,
        learns: bool,
        learner: Any = None,
        own_tables: bool = False,
        is_given_actions: bool = False,
        n_nests: int = 1,
    ) -> None:
        self.learner, self.own_tables, self.is_given_actions = learner, own_tables, is_given_actions
        self.observation, self.traffic = task.sees, task.traffic
        self.ants_change, self.food_changes = task.ants_change, task.food_changes
        self.features = used_by(task)
        # Whether actions can be executed differently, and cells seen differently.
        self.slips = any("execute" in feature.hooks for feature in self.features)
        self.misreads = any("see" in feature.hooks for feature in self.features)
        self.n_nests, self.n_kinds = n_nests, max(1, len(task.foods))
        self.n_castes = len(task.castes)  # 0: ants have no castes
        # Whether the ants of a caste have different exploration rates.
        self.epsilon_varies = any(caste.epsilon_spread for caste in task.castes.values())
        # In a world: nests by castes.
        self.n_groups = n_nests * max(1, self.n_castes)
        # Whether deliveries are counted by nest and kind.
        self.counts_by_nest_and_kind = n_nests > 1 or self.n_kinds > 1
        # Whether ants must stay in their slots; else vacant slots are always the last ones.
        self.slots_matter = self.ants_change or own_tables or is_given_actions

        self.draws_next_action = learner is not None and learner.draws_next_action
        # Each ant learns into its own table, or all ants of a world into one table.
        self.independent = learner is not None and own_tables
        self.together = learner is not None and not own_tables
        self.begins = self.independent and learner.begin is not None
        self.plans_together = self.together and learner.plans
        self.n_numbers = task.n_states * ROW  # of a table: state-action pairs, and unused
        # Of all tables that ants of a world share: states, and pairs.
        self.n_rows = task.n_states * self.n_groups
        self.n_pairs = self.n_rows * ROW

        # By number of the pheromone, the trail first; only the views of cues are compiled.
        pheromones, pairs = task.pheromones_while(learns), task.all_cues
        self.dense_by_number = tuple(pheromone.dense for pheromone in pheromones)
        self.views = tuple(
            pheromone.view if any(number in pair for pair in pairs) else "half"
            for number, pheromone in enumerate(pheromones)
        )
        self.dense = any(self.dense_by_number)
        self.cues = tuple(self._cues(task, *pair) for pair in pairs)  # of all castes
        self.senses = tuple(dict.fromkeys(cues.sense for cues in self.cues if cues.sense))
        followed = {number for cues in self.cues for number in (cues.outbound, cues.followed)}
        self.sees_dense = any(self.dense_by_number[number] for number in followed)
        self.reads = tuple(task.number_of(name) for name in self.observation.reads)
        self.is_papers = self.observation.name == "paper"
        # The paper's state is the state index, unless ants misread cells.
        self.sees_paper_state = self.is_papers and not self.misreads
        # Whether the cell of an ant must show that the ant carries food.
        under_carriers = any(self.views[cue] == "strongest_under_carriers" for cue in followed)
        sees_loads = any(CUES[sense].sees_loads for sense in self.senses)
        self.sees_ants = not self.is_papers or under_carriers or sees_loads

        # Your own rules, in the order of their parameters, and where they are used.
        self.rules, self.choice = task.own_rules, task.choice.rule
        self.choice_rule, self.reward_rule = task.choice.own_rule, task.own_reward
        self.has_own_reward = self.reward_rule is not None
        self.deposit_rules = tuple(pheromone.own_deposit for pheromone in pheromones)
        self.evaporation_rules = tuple(pheromone.own_evaporation for pheromone in pheromones)
        # The names of all pheromones, if one of your rules can read them.
        self.field_names = (*task.pheromones,) if self.rules else ()
        # Whether pheromones are laid one after the other, because rules of deposits read others.
        self.lays_in_turn = any(rule.kind == "deposit" and rule.fields for rule in self.rules)
        inputs = [read for rule in self.rules for read in rule.inputs.values()]
        self.reads_deliveries = any(read.by_deliveries for read in inputs)

    def _cues(self, task: Task, outbound: int, homing: int) -> Cues:
        half = self.views[outbound] == "half"
        if homing >= 0:
            return Cues(outbound, homing, "", half, self.views[homing])
        followed = task.number_of(task.choice.carriers_follow or task.cues[outbound])
        return Cues(outbound, followed, task.cues[homing], half, "")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash(tuple(vars(self).values()))
