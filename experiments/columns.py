"""The tables that studies write: what a row of each stands for, and each of their columns.

docs/reference/files.md shows them. A name in capitals stands for several names, see `NAMES` in
`taichi_ants.studies.columns`.
"""

from __future__ import annotations

from taichi_ants.studies.columns import CENTRE, IQM, Table

_CONFIGURATION = {
    "learner": "name of the learner",
    "hyperparameters": "settings that only this learner has; empty if it has none",
    "learning_rate": "learning rate of the first episode",
    "discount": "discount factor",
    "epsilon": "exploration rate of the first episode",
    "epsilon_decay": "factor that multiplies epsilon after each episode",
    "delivery": "what a delivery does to an episode: `truncates` or `terminates`",
}
_SUMMARY = {
    **_CONFIGURATION,
    "seeds": "number of seeds",
    **CENTRE,
    **IQM,
    "runs_BEHAVIOUR": "number of runs whose final policy behaves like this",
}
_CONDITION = {
    "world_kind": "kind of world in which ants are evaluated",
    "rules": "rules of the game",
    "regime": "how the policy was trained",
    "ants": "number of ants",
}

COMPARE = {
    "summary.csv": Table("configuration, over all seeds", _SUMMARY),
    "table2.csv": Table(
        "learner and delivery setting, at the configuration that represents the learner",
        {
            **_SUMMARY,
            "paper_configuration": "whether it is the configuration of the paper's table 2",
            "paper_return": "the paper's return",
            "paper_steps": "the paper's number of steps",
            "paper_deliveries": "the paper's number of deliveries",
            "best_run_of": "number of configurations of which the best run is chosen",
            "best_run_MEASURE_median": "median of that measure of the best run, over repetitions",
            "best_run_MEASURE_low": "2.5 % of the repetitions are below it",
            "best_run_MEASURE_high": "2.5 % of the repetitions are above it",
            "best_run_MEASURE_paper_percentile": "percentage of repetitions below the paper's"
            " figure",
        },
    ),
    "behaviours.csv": Table(
        "configuration and behaviour that occurs in it",
        {
            **_CONFIGURATION,
            "behaviour": "what the final policies do",
            "runs": "number of runs that do it",
            "return_last50_mean": "mean training return of these runs",
            "policy_return_mean": "mean return of the episodes by which they were classified",
            "greedy_return_mean": "mean return of their greedy rollouts",
            "greedy_steps_mean": "mean length of their greedy rollouts, in steps",
            "greedy_deliveries_mean": "mean deliveries of their greedy rollouts",
        },
    ),
    "claims.csv": Table(
        "claim of the paper and delivery setting",
        {
            "claim": "identifier of the claim",
            "section": "section of the paper",
            "statement": "the claim in a sentence",
            "quantity": "what is compared",
            "criterion": "range in which it must lie",
            "unit": "unit of the quantity",
            "delivery": "delivery setting",
            "estimator": "`interquartile mean` or `mean`",
            "contrast": "difference that decides, if the claim compares several",
            "effect": "estimate",
            "ci_low": "lower end of its interval",
            "ci_high": "upper end of its interval",
            "verdict": "verdict on the claim",
            "mean_contrast": "contrast, judged by the mean",
            "mean_effect": "estimate of the mean",
            "mean_ci_low": "lower end of the interval of the mean",
            "mean_ci_high": "upper end of the interval of the mean",
            "mean_verdict": "verdict by the mean",
            "level": "level of the intervals, corrected for their number",
            "seeds": "number of seeds",
        },
    ),
    "baselines.csv": Table(
        "bound and policy without learning",
        {
            "baseline": "name of the bound or policy",
            "discount": "discount for which the policy is optimal",
            "return_mean": "mean return of an episode",
            "steps_mean": "mean number of steps of an episode",
            "deliveries_mean": "mean number of deliveries of an episode",
            "note": "how the numbers were computed, or why there are none",
        },
    ),
}
COLONY = {
    "seeds.csv": Table(
        "condition and seed", {**_CONDITION, "seed": "the seed", "MEASURE": "value of the measure"}
    ),
    "conditions.csv": Table(
        "condition, over all seeds",
        {
            **_CONDITION,
            "seeds": "number of seeds",
            **CENTRE,
            "MEASURE_min": "least value over seeds",
            "MEASURE_max": "greatest value over seeds",
        },
    ),
    "differences.csv": Table(
        "paired difference of two conditions",
        {
            "world_kind": "kind of world",
            "question": "question that the difference answers",
            "statement": "the answer in a sentence, if it is supported",
            "measure": "measure whose difference it is",
            "ants": "number of ants of the first condition",
            "against": "number of ants of the second condition",
            "mean": "mean difference",
            "low": "lower end of its interval",
            "high": "upper end of its interval",
            "verdict": "verdict",
        },
    ),
}
BRIDGE = {
    "shares.csv": Table(
        "design, bridge, seed, load and tenth of the time",
        {
            "rules": "rules of the game",
            "aside": "shift of the food to the side, in cells",
            "ants": "number of ants",
            "slope": "decrease of deposits per tick since the load changed",
            "evaporation": "evaporation of trails",
            "bridge": "lengths of the branches",
            "seed": "seed of the training",
            "load": "`foragers` or `carriers`",
            "from_tick": "first tick of the span",
            "short": "number of ants that crossed by the short branch",
            "long": "number of ants that crossed by the long branch",
        },
    )
}
