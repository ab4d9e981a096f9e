"""Search for the half-life and the slope of trails with which 64 ants fetch most from far piles.

Optuna chooses the settings of each trial. The best ones are then compared with the default by
held-out seeds, because the best of many trials was also lucky. The journal keeps all trials: to
continue a search, also one that was killed, run the command again.

Requires Optuna: `pip install -e ".[search]"`. Takes about half a minute on one core.
"""

import argparse
from pathlib import Path

import optuna

from taichi_ants import Colony, TrainingConfig, load_policy, task, worlds
from taichi_ants.analysis.statistics import bootstrap_interval

POLICY = load_policy(Path(__file__).parents[1] / "experiments/policies/far_piles.npz").q_values
FOLLOW = TrainingConfig("q_learning", 0.1, 0.9, epsilon=0.01, epsilon_decay=1)
SEEDS, HELD_OUT = range(16), range(16, 76)
DEFAULT = {"half_life": 50.0, "slope": 10}


def deliveries(trail, seeds):
    """Return the food items that colonies deliver in 1000 ticks, one seed and world each."""
    trail = {"evaporation": "exponential", **trail}
    rules = task.queueing().replace(pheromone=trail, life={"regrowth": 0})
    places, how = [worlds.far_piles(seed) for seed in seeds], {"sharing": "frozen"}
    colony = Colony(places, rules, FOLLOW, seeds, ants=64, q_values=POLICY, **how)
    return colony.run(episodes=1, ticks=1000).deliveries[0].astype(float)


def objective(trial):
    half_life = trial.suggest_float("half_life", 10, 10_000, log=True)
    slope = trial.suggest_int("slope", 1, 50, log=True)
    return deliveries({"half_life": half_life, "slope": slope}, SEEDS).mean()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=40, help="in all; default: %(default)s")
    parser.add_argument("--journal", default="search.journal", help="default: %(default)s")
    args = parser.parse_args()
    file = optuna.storages.journal.JournalFileBackend(args.journal)
    storage = optuna.storages.JournalStorage(file)
    given = {"direction": "maximize", "load_if_exists": True}
    study = optuna.create_study(study_name="trails", storage=storage, **given)
    for number in range(len(study.trials), args.trials):
        study.sampler = optuna.samplers.TPESampler(seed=number)  # the same if resumed
        study.optimize(objective, n_trials=1)
    best, usual = deliveries(study.best_params, HELD_OUT), deliveries(DEFAULT, HELD_OUT)
    low, high = (end.item() for end in bootstrap_interval((best - usual)[None]))
    print(f"best of {len(study.trials)} trials: {study.best_params}; default: {DEFAULT}")
    print(f"held-out seeds: {best.mean():.0f} food items against {usual.mean():.0f}, ", end="")
    print(f"difference {(best - usual).mean():.1f} [{low:.1f}, {high:.1f}]")
