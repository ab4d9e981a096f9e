"""Draw the three small pictures of the README, each for light and for dark pages.

The pictures show the results in `results/compare`, which the script makes first if they are
missing, and the published table of fixed_rules.py. The script publishes how often each learner
seems to be the best.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import csv
    from pathlib import Path
    from typing import Any

    import compare
    import matplotlib
    import numpy as np
    import published
    from matplotlib.figure import Figure

    from taichi_ants.analysis.behaviour import CIRCLES, WALKS
    from taichi_ants.analysis.tables import Table, percent
    from taichi_ants.studies.command import planned, run_study
    from taichi_ants.studies.command_line import Parser, run_command

ROOT = Path(__file__).parents[1]
REPETITIONS = 10_000  # of the paper's method
LEARNERS = "Q-learning", "SARSA", "Dyna-Q (p3)", "Dyna-Q (p5)"
_STEP, _LOOP, _INK, _FAINT = "teal", "amber", "ink", "faint"
THEMES = {  # colours of marks and text; the page shows through
    "light": {_STEP: "#1b8a92", _LOOP: "#d9480f", _INK: "#1f2328", _FAINT: "#59636e"},
    "dark": {_STEP: "#3fb6c8", _LOOP: "#ffb938", _INK: "#f0f6fc", _FAINT: "#9198a1"},
}


def policies(results: Path, delivery: str = "terminates") -> np.ndarray:
    """Return the behaviour of 100 final policies of Dyna-Q, index into `BEHAVIOURS`.

    It has 5 planning steps and the other hyperparameters of the paper's table 2.
    """
    with (results / "summary.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    told = {
        **{"learner": "dyna_q", "hyperparameters": "planning_steps=5", "delivery": delivery},
        **{"learning_rate": "0.01", "discount": "0.99", "epsilon": "0.5", "epsilon_decay": "0.995"},
    }
    (row,) = (n for n, one in enumerate(rows) if told.items() <= one.items())
    with np.load(results / "runs.npz") as runs:
        return np.asarray(runs["behaviours"][row])


def winners(results: Path) -> np.ndarray:
    """Return the share of repetitions of the paper's method in which each learner returns most.

    A repetition draws one of 100 seeds for each of 16 configurations of a learner and keeps the
    best return of the last 50 episodes. Updates at a delivery bootstrap.
    """
    with np.load(results / "runs.npz") as runs:
        returns = runs["return_last50"][:64].reshape(len(LEARNERS), 16, -1)
    random, each = np.random.default_rng(0), np.arange(16)
    seeds = random.integers(0, returns.shape[2], (REPETITIONS, len(LEARNERS), 16))
    best = np.stack(
        [of_one[each, seeds[:, n]].max(axis=1) for n, of_one in enumerate(returns)], axis=1
    )
    return np.bincount(best.argmax(axis=1), minlength=len(LEARNERS)) / REPETITIONS


def deliveries() -> dict[str, tuple[int, ...]]:
    """Return deliveries in the paper's world by rules: learned, and by the hand-written policy."""
    place, hands = "fixed_rules; the paper's world", ("learned", "by hand")
    return {
        rules: tuple(int(published.cell(f"{place}; {rules}; {one}")) for one in hands)
        for rules in ("paper's rules", "A + B + C", "queues")
    }


def _axes(colours: dict[str, str], title: str, below: str = "") -> tuple[Figure, Any]:
    figure = Figure(figsize=(3.4, 2.2), dpi=200)
    axes = figure.add_axes((0.03, 0.03, 0.94, 0.75))
    axes.set_axis_off()
    figure.text(0.03, 0.91, title, color=colours[_INK], fontsize=10, weight="bold")
    figure.text(0.03, 0.81, below, color=colours[_FAINT], fontsize=8.5)
    return figure, axes


def draw_policies(behaviours: np.ndarray, colours: dict[str, str]) -> Figure:
    """Return a picture with a dot for each policy."""
    figure, axes = _axes(colours, "100 trained policies", "none delivers")
    walks, circles = (int((behaviours == one).sum()) for one in (WALKS, CIRCLES))
    x, y = np.divmod(np.arange(len(behaviours)), 5)
    dots = [colours[_STEP]] * walks + [colours[_LOOP]] * (len(behaviours) - walks)
    axes.scatter(x, -y, s=36, c=dots, linewidths=0)
    look: dict[str, Any] = {"fontsize": 9, "weight": "bold"}
    axes.text(0, -5.6, f"{walks} walk the trail", color=colours[_STEP], **look)
    words = f"{circles} circle at the queen"
    axes.text(19.3, -5.6, words, color=colours[_LOOP], ha="right", **look)
    axes.set(xlim=(-0.5, 19.8), ylim=(-6.2, 0.6))
    return figure


def draw_winners(shares: np.ndarray, colours: dict[str, str]) -> Figure:
    """Return a picture of how often each learner seems to be the best."""
    figure, axes = _axes(colours, "Which learner wins?", "one run per configuration, repeated")
    for n, (name, share) in enumerate(zip(LEARNERS, shares, strict=True)):
        axes.barh(-n, share, 0.62, color=colours[_STEP])
        axes.text(-0.01, -n, name, color=colours[_INK], fontsize=9, ha="right", va="center")
        words = f"{100 * share:.0f} %"
        axes.text(share + 0.01, -n, words, color=colours[_INK], fontsize=9, va="center")
    axes.set(xlim=(-0.2, 0.45), ylim=(-3.5, 0.5))
    return figure


def draw_deliveries(by_rules: dict[str, tuple[int, ...]], colours: dict[str, str]) -> Figure:
    """Return a picture of deliveries by rules, of learned policies and of those by hand."""
    figure, axes = _axes(colours, "Food that 64 ants deliver", "in 1000 ticks, by the rules")
    for n, (rules, pair) in enumerate(by_rules.items()):
        name = {"A + B + C": "three rules"}.get(rules, rules)
        axes.text(-20, -n, name, color=colours[_INK], fontsize=9, ha="right", va="center")
        for value, at, colour in zip(pair, (0.17, -0.17), (_STEP, _LOOP), strict=True):
            axes.barh(-n + at, value, 0.3, color=colours[colour])
            axes.text(value + 12, -n + at, value, color=colours[_FAINT], fontsize=8, va="center")
    for at, words, colour in ((0.55, "learned", _STEP), (0.74, "by hand", _LOOP)):
        figure.text(at, 0.81, words, color=colours[colour], fontsize=8.5, weight="bold")
    axes.set(xlim=(-370, 1130), ylim=(-2.45, 0.45))
    return figure


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    parser.add_argument("--folder", type=Path, default=ROOT / "renders", help="write here")
    return parser.parse_args(arguments)


def make_findings(settings: argparse.Namespace) -> None:
    """Draw all three pictures, and publish the shares of the second."""
    results = ROOT / "results" / "compare"
    asked = compare.parse_arguments(["--out", str(results)])
    run_study(asked, planned(compare.__file__, asked))
    behaviours, shares, by_rules = policies(results), winners(results), deliveries()
    wins = [[name, percent(share)] for name, share in zip(LEARNERS, shares, strict=True)]
    published.show("paper_winners", [Table("", ("Learner", "best in"), wins)], True)
    with matplotlib.rc_context({"font.family": "DejaVu Sans"}):
        for theme, colours in THEMES.items():
            drawn = {
                "policies": draw_policies(behaviours, colours),
                "winners": draw_winners(shares, colours),
                "rules": draw_deliveries(by_rules, colours),
            }
            for name, figure in drawn.items():
                figure.savefig(settings.folder / f"finding_{name}_{theme}.png", transparent=True)


if __name__ == "__main__":
    run_command(lambda: make_findings(parse_arguments()))
