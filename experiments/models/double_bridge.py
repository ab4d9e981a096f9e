"""Let ants choose between the branches of a double bridge by the choice function of Deneubourg.

Ants choose by pheromone alone, with exponent 2, and with k = 5 deposits, which evaporate with a
half-life of 150 ticks. Ants with food know by the compass which cells are nearer to the queen. In
the model "both ways", all ants mark, and ants with food follow the marks of all ants. In the model
"on the return", only ants with food mark. Ants without food follow the marks of ants with food in
both models. On the late bridge, rock closes the short branch for the first half of the time. Shares
are of the crossings in the last tenth of the time.

The table has, for each bridge, the share of colonies with most crossings on the short branch, and
the share of colonies with at least 80 % of them on one branch. See docs/models/double_bridge.md.
"""

from itertools import product

import model_script  # whose import makes that of `bridge` possible
import numpy as np
from bridge import crossings

from taichi_ants import Colony, Field
from taichi_ants.analysis import style
from taichi_ants.studies.command_line import progress_bar
from taichi_ants.task import Choice, Life, Pheromone, Task
from taichi_ants.worlds import double_bridge

DEPOSIT, ANTS, TICKS, SHORT, LONG = 100, 60, 6000, 20, 37
MARKS = {
    **{"evaporation": "exponential", "half_life": 150},
    **{"deposit": "add", "level": DEPOSIT, "cap": 1_000_000},
}
ON_THE_RETURN = Task(
    pheromone=Pheromone(**MARKS),
    choice=Choice("deneubourg", k=5 * DEPOSIT, exponent=2),
    traffic="following",
    life=Life(regrowth=0),
    turns_at_queen=True,
)
MODELS = {
    "both ways": ON_THE_RETURN.replace(
        fields={"both": Field(deposited_when="always", **MARKS)}, choice={"carriers_follow": "both"}
    ),
    "on the return": ON_THE_RETURN,
}
# The length of the long branch, and the tick at which the short one opens.
BRIDGES = {"equal": (SHORT, 0), "short at once": (LONG, 0), "short late": (LONG, TICKS // 2)}


def shares(model, long, opens, seeds):
    """Return the share of the last crossings that are on the short branch, for each of n seeds."""
    found = np.empty(seeds)
    # Interventions, which open the short branch late, need a colony with a single world.
    pairs = [range(side, seeds, 2) for side in (0, 1)]
    several = [[seed] for seed in range(seeds)] if opens else pairs
    for some in filter(len, several):
        bridge = {"short": SHORT, "long": long, "mirrored": bool(some[0] % 2)}
        world = double_bridge(**bridge)
        colony = Colony(world, model, None, some, ANTS, sharing="frozen", schedule="by_world")
        late = crossings(colony, bridge, TICKS, opens)[-1].sum(axis=0)
        with np.errstate(invalid="ignore"):  # without any crossing, the share is not known
            found[list(some)] = late[0] / late.sum(axis=0)
    return found


def measure(seeds):
    """Return the shares of all colonies, and in percent whether they chose a branch."""
    found, numbers, summary = {}, [], []
    with progress_bar("Colonies on bridges") as progress:
        for model, bridge in product(MODELS, BRIDGES):
            every = shares(MODELS[model], *BRIDGES[bridge], len(seeds))
            found[f"{bridge}, {model}"] = known = every[np.isfinite(every)]
            numbers += [
                {"marks": model, "bridge": bridge, "seed": seed, "short_share": share}
                for seed, share in zip(seeds, every.tolist(), strict=True)
            ]
            for share in known.tolist():
                row = {"marks, bridge": f"{model}, {bridge}", "short (%)": 100 * (share > 0.5)}
                summary.append({**row, "one side (%)": 100 * (abs(share - 0.5) >= 0.3)})
            progress(len(found) / (len(MODELS) * len(BRIDGES)))

    def draw(panels):
        for axes, (case, known) in zip(panels.flat, found.items(), strict=True):
            axes.hist(known, np.linspace(0, 1, 11), color=style.BLUE)
            axes.set(title=case)
        for axes in panels[-1]:
            axes.set_xlabel("share on the short branch")

    title = "Double bridge: colonies by their use of the short branch"
    caption = f"{len(seeds)} colonies of {ANTS} ants in each panel, last tenth of {TICKS} ticks."
    panels = len(MODELS), len(BRIDGES)
    return model_script.ScriptResults(numbers, summary, title, draw, caption, panels, height=4.4)


if __name__ == "__main__":
    model_script.run(__file__, __doc__, measure, seeds=60)
