"""Compare golden hashes with those recorded: python tests/golden/record.py [SECTION ...] [--write]

Sections are colonies, trainings, studies and frames, or a part of one: a group of colonies, such as
`labour`, a learner or a study. Without names all are compared, in six minutes of processor time.
The command says what differs first, and ends with status 1.

`--write` records the hashes anew. Results may change only in a commit that says why and raises
`taichi_ants.PHYSICS`: it refuses hashes that changed with the same number, and a new number with
the same hashes. Values are hashed in a fixed order and as fixed types, without the names of fields,
columns and files. Where these are renamed, the lists below name them anew, and the hashes stay.
"""

import argparse
import csv
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT, RECORDED = HERE.parents[1], HERE / "golden.json"
PLACES = map(str, (ROOT, HERE, HERE.parent / "support"))
sys.path[:0] = [path for path in PLACES if path not in sys.path]
os.environ.setdefault("TI_ADVANCED_OPTIMIZATION", "0")  # compiles faster, with equal results

import drawing  # noqa: E402
import numpy as np  # noqa: E402
from random_colonies import RandomColony, forager  # noqa: E402
from random_worlds import random_world  # noqa: E402

from taichi_ants import (  # noqa: E402
    PHYSICS,
    AntsError,
    Colony,
    evaluate,
    rendering,
    runtime,
    trace_training,
    train,
    worlds,
)

# What is hashed of a colony after each tick. These lists are the only place that knows the names.
OF_COLONY = ("q_values", "stimuli", "running", "episode_ticks", "deliveries", "living")
OF_ANTS = ("numbers", "cells", "headings", "carrying", "paper_states", "states", "actions",
    "executed", "events", "rewards", "streams", "nests", "castes", "idle",
    "thresholds")  # fmt: skip
OF_SNAPSHOT = ("ground", "trail", "food_kinds", "ant_foods", "ant_carried")
OF_EPISODES = ("returns", "ticks", "deliveries", "first_delivery", "moves", "blocked", "carried",
    "births", "waiting_births", "deaths", "regrown", "living", "deliveries_by_nest_and_kind",
    "caste_deliveries")  # fmt: skip
OF_TRACE = ("episodes", "steps", "cells", "headings", "paper_states", "states", "actions",
    "rewards", "next_paper_states", "next_states", "terminated", "events", "q_values",
    "td_errors", "tables", "executed")  # fmt: skip
OF_RUNS = ("returns", "steps", "deliveries")
OF_STATE = ("q", "random_states", "epsilon", "learning_rate")
MEASURES = ("deliveries", "living", "carriers", "distance")

# Studies: the arguments of their commands, and the files that are hashed.
SHORT = {r"seeds = \d+": "seeds = 2", "episodes = 500": "episodes = 50"}
SHORT |= {"episodes = 30": "episodes = 4", r"\bticks = \d+": "ticks = 90"}
SHORT |= {r"measure_every = \d+": "measure_every = 30", r"\[0, 3000\]": "[0, 40]"}
SWEEPS = ("learning_rates", "trails", "late_branch")
COMPARE = f"{ROOT}/experiments/compare.py --quick --no-figures"
COLONY = (
    f"{ROOT}/experiments/colony.py study --seeds 2 --sizes 1 4 --no-figures --episodes 3 "
    "--ticks 90 --rollouts 2 --world-kinds paper open piles moving"
)
TABLES = ("runs.npz", "summary.csv", "table2.csv", "claims.csv", "behaviours.csv", "baselines.csv")
STUDIES = {
    "compare": (COMPARE, TABLES),
    "colony": (COLONY, ("seeds.csv", "conditions.csv", "differences.csv")),
    **{name: (f"-m taichi_ants sweep {name}.toml", ("runs.csv", "summary.csv")) for name in SWEEPS},
}


class Digest:
    """A hash of arrays, whatever their types."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def add(self, *arrays: Any) -> None:
        """Add arrays: their shapes, and their values as float64, int64 or uint64."""
        for one in map(np.asarray, arrays):
            kind = {"f": np.float64, "u": np.uint64}.get(one.dtype.kind, np.int64)
            wide = np.ascontiguousarray(one, kind)
            if kind is np.float64:
                wide = np.where(np.isnan(wide), np.nan, wide)  # one of many
            elif kind is np.uint64 and one.dtype.itemsize < 8:
                wide = wide.astype(np.int64)
            self._hash.update(repr(one.shape).encode())
            self._hash.update(wide.data)

    def text(self) -> str:
        """Return the start of the hash of all arrays so far."""
        return self._hash.hexdigest()[:6]


def add_colony(digest: Digest, colony: Colony) -> None:
    """Add the state of a colony, between two ticks."""
    digest.add(*(getattr(colony, name) for name in OF_COLONY))
    living = colony.living
    digest.add(*(getattr(colony, name)[living] for name in OF_ANTS))
    for world in range(len(living)):
        snapshot = colony.snapshot(world)
        digest.add(*(getattr(snapshot, name) for name in OF_SNAPSHOT))
        digest.add(*snapshot.fields.values())
    add_all(digest, colony.outcome(), OF_EPISODES)


def add_all(digest: Digest, record: Any, names: Iterable[str]) -> None:
    """Add some arrays of a record."""
    digest.add(*(getattr(record, name) for name in names if getattr(record, name) is not None))


def of_colony(drawn: RandomColony, schedule: str) -> str:
    """Return hashes of two worlds: after each ten of 2 * 40 ticks, and after 30 with a protocol."""
    world, task, training, seed = drawn.model
    colony = Colony(world, task, training, [seed, seed + 1], **drawn.options, schedule=schedule)
    digest, found = Digest(), []
    for _ in range(2):
        colony.begin_episode(40)
        add_colony(digest, colony)
        for tick in range(40):
            colony.tick()
            if tick == 19:
                drawing.disturb(colony)
            add_colony(digest, colony)
            if tick % 10 == 9:
                found.append(digest.text())
        colony.end_episode()
    try:
        events = drawing.random_events(drawn)
        done = colony.run(1, 30, measures=MEASURES, every=1, protocol=events)
        add_all(digest, done, OF_EPISODES)
        digest.add(*done.series.values.values())
        add_colony(digest, colony)
    except AntsError:  # the worlds do not allow an event
        digest.add(-1)
    return "".join([*found, digest.text()])


def of_training(made: tuple) -> str:
    """Return hashes of two runs, of the trace of one with its tables, and of rollouts."""
    world, config, seed, task = made
    found, digest = [], Digest()
    result = train(world, config, [seed, seed + 1], 6, 80, task)
    add_all(digest, result, OF_RUNS)
    add_all(digest, result.state, OF_STATE)
    found.append(digest.text())
    add_all(digest, trace_training(world, config, seed, 3, 40, task), OF_TRACE)
    found.append(digest.text())
    table = result.state.q[0, :, 0, :, :5]
    add_all(digest, evaluate(world, table, 3, [seed, seed + 1], 80, task, 0.1), OF_RUNS)
    return "".join([*found, digest.text()])


def colonies(groups: Iterable[str], most: int) -> Iterator[tuple[str, str]]:
    """Yield names and hashes of the first colonies of some groups."""
    for group in groups:
        for number, (name, drawn) in enumerate(drawing.colonies_of(group, most)):
            yield name, of_colony(drawn, ("by_world", "by_chunk")[number % 2])


TRAINED = ("q_learning", "sarsa", "expected_sarsa", "double_q", "dyna_q", "sarsa_lambda")
TRAINED = (*TRAINED, "n_step_sarsa", "prioritized_sweeping")


def trainings(learners: Iterable[str], most: int) -> Iterator[tuple[str, str]]:
    """Yield names and hashes of the first trainings of some learners."""
    for learner in learners:
        noisy = learner in ("sarsa", "dyna_q")
        for name, made in drawing.random_trainings(learner, most, noisy):
            yield name, of_training(made)


def studies(names: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield names and hashes of the files of studies, which run as commands."""
    with tempfile.TemporaryDirectory() as folder:
        for name in SWEEPS:
            text = (ROOT / f"experiments/sweeps/{name}.toml").read_text()
            for long, short in SHORT.items():
                text = re.sub(long, short, text)
            Path(folder, f"{name}.toml").write_text(text)
        for name in names:
            line, files = STUDIES[name]
            command = [sys.executable, *f"{line} --out {name}".split()]
            path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
            environ = {**os.environ, "PYTHONPATH": path}
            ran = subprocess.run(command, cwd=folder, env=environ, capture_output=True, text=True)
            if ran.returncode:
                raise SystemExit(f"{name} failed:\n{ran.stderr}")
            for number, file in enumerate(files):
                yield f"{name}-{number}", of_file(Path(folder, name, file))


def of_file(path: Path) -> str:
    """Return the hash of the arrays of a file, or of the columns of a table."""
    digest = Digest()
    if path.suffix == ".npz":
        with np.load(path) as arrays:
            digest.add(*(one for one in arrays.values() if one.dtype.kind != "U"))
    else:
        with path.open(newline="", encoding="utf-8") as lines:
            columns = zip(*list(csv.reader(lines))[1:], strict=True)
            digest.add(*map(column_values, columns))
    return digest.text()


def column_values(cells: tuple[str, ...]) -> np.ndarray:
    """Return ten digits of each number, or for texts the numbers of the rows that have the same.

    The last digits of means depend on NumPy, and texts on names.
    """
    try:
        return np.array([float(f"{float(cell or 'nan'):.10g}") for cell in cells])
    except ValueError:
        return np.array([cells.index(cell) for cell in cells])


def frames() -> Iterator[tuple[str, str]]:
    """Yield hashes of twenty frames: worlds, an ant that follows a policy, and colonies."""
    pictures = [rendering.picture(worlds.paper())]
    pictures += [rendering.picture(random_world(seed), (320, 240)) for seed in range(4)]
    table = forager("paper")
    episode = rendering.Episode.play(worlds.paper(), table, seed=3, max_steps=5)
    pictures += list(rendering.frames(episode.snapshots(), (500, 300)))[:5]
    for group in ("nests", "castes_fields"):
        _, drawn = next(drawing.colonies_of(group, 1))
        colony = Colony(*drawn.model, **drawn.options)
        colony.begin_episode()
        snapshots = rendering.colony_snapshots(colony, 20, 5, follow=0)
        pictures += list(rendering.frames(snapshots, (400, 400)))
    for number, pixels in enumerate(pictures):
        digest = Digest()
        digest.add(pixels)
        yield f"frame-{number}", digest.text()


def section(name: str, most: int | None = None) -> dict[str, str]:
    """Return the hashes of a section, of a group of colonies, of a learner or of a study."""
    of_group, of_learner = most or drawing.PER_GROUP, most or 13
    found: Iterator[tuple[str, str]]
    if name in ("colonies", *drawing.GROUPS):
        groups = drawing.GROUPS if name == "colonies" else (name,)
        found = colonies(groups, of_group)
    elif name in ("trainings", *TRAINED):
        found = trainings(TRAINED if name == "trainings" else (name,), of_learner)
    elif name in ("studies", *STUDIES):
        found = studies(STUDIES if name == "studies" else (name,))
    elif name == "frames":
        found = frames()
    else:
        raise SystemExit(f"there is no section {name!r}; see the head of {Path(__file__).name}.")
    return dict(found)


def recorded() -> tuple[int, dict[str, str]]:
    """Return the recorded physics number and hashes."""
    facts = json.loads(RECORDED.read_text()) if RECORDED.exists() else {"physics": 0, "hashes": {}}
    return facts["physics"], facts["hashes"]


def differences(found: dict[str, str], expected: dict[str, str]) -> list[str]:
    """Return a line for each hash that differs, with the first part of it that does."""
    lines = []
    for name, text in found.items():
        if name not in expected:
            lines.append(f"{name} is not recorded")
        elif text != expected[name]:
            pairs = zip(text, expected[name], strict=False)
            part = next((n for n, (a, b) in enumerate(pairs) if a != b), 0) // 6
            parts = max(len(text), len(expected[name])) // 6
            ticks = f", ticks {10 * part + 1} to {10 * part + 10} of 80" if parts == 9 else ""
            lines.append(f"{name}: differs in part {part + 1} of {parts}{ticks}")
    return lines


def refusal(changed: bool, number: int, old_number: int) -> str | None:
    """Return why hashes must not be recorded with this physics number, or None."""
    if changed and number <= old_number:
        return (
            f"hashes changed, but PHYSICS is {number}, as recorded; if the results should change, "
            "raise taichi_ants.PHYSICS, and say why in the commit."
        )
    if not changed and old_number and number != old_number:
        return f"PHYSICS is {number} and was {old_number}, but no hash changed; leave it as it was."
    return None


def write(found: dict[str, str], is_all: bool) -> None:
    """Record hashes; those of other sections stay, unless `found` is all there is."""
    old_number, expected = recorded()
    changed = any(expected.get(name, text) != text for name, text in found.items())
    refused = refusal(changed, PHYSICS, old_number)
    if refused:
        raise SystemExit(refused)
    if changed and not is_all:
        raise SystemExit("hashes changed; record all sections at once, without names.")
    hashes = found if is_all else {**expected, **found}
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(text)}" for name, text in hashes.items())
    RECORDED.write_text(f'{{"physics": {PHYSICS}, "hashes": {{\n{lines}\n}}}}\n')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sections", nargs="*", metavar="SECTION")
    parser.add_argument("--write", action="store_true", help="record the hashes anew")
    parser.add_argument("--threads", type=int, help="number of threads (default: all)")
    options = parser.parse_args()
    runtime.start(options.threads)
    found: dict[str, str] = {}
    _, expected = recorded()
    for name in options.sections or ("colonies", "trainings", "studies", "frames"):
        part = section(name)
        lines = differences(part, expected)
        print(
            f"{name}: {len(part)} hashes, {len(lines)} differ", *lines[:20], sep="\n  ", flush=True
        )
        found |= part
    if options.write:
        write(found, not options.sections)
    elif differences(found, expected):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
