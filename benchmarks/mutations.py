"""Put small errors into a copy of the package, and count those that the quick tests notice.

    python benchmarks/mutations.py                   # all mutations, 10 to 20 s each
    python benchmarks/mutations.py statistics files  # mutations that contain one of these words

A mutation is a wrong change of one line, with the tests that must notice it. The script prints
"noticed", "NOT NOTICED", or "stale" if the old text does not occur exactly once. It exits with 1
unless all mutations were noticed. It first runs the tests without mutations, which must pass.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
TIMEOUT = 300.0  # seconds; a mutation that makes tests take longer counts as noticed

RUNS = "tests/engines/runs/test_against_reference.py"
BATCHED = "tests/engines/runs/test_batched.py"
COLONY = "tests/engines/colony/test_against_reference.py"
RASTER = "tests/rendering/test_raster.py"
CASTES = "tests/engines/colony/test_castes.py"
ENGINE = "tests/engines/colony/test_engine.py"
SCHEDULES = "tests/engines/colony/test_schedules.py"
BY_ANT = "tests/engines/colony/test_by_ant.py"
TRAFFIC = "tests/engines/colony/test_traffic.py"
STATISTICS = "tests/analysis/test_statistics.py"
FINDINGS = "tests/analysis/test_findings.py"
ARCHIVES = "tests/files/test_archives.py"
FILES = "tests/files/test_files.py"
STUDIES = "tests/studies/test_study.py"
EXECUTORS = "tests/studies/test_executors.py"
RAY = "tests/studies/test_ray.py"
GROWING = "tests/commands/test_growing.py"
RECORDING = "tests/viewer/test_recording.py"
SERVER = "tests/live/test_server.py"
SESSION = "tests/live/test_session.py"
SETTINGS = "tests/test_settings.py"
PROTOCOL = "tests/engines/colony/test_protocol.py"
MEASURES = "tests/measures"
RESULTS_OF_RUNS = "tests/analysis/test_results.py"
SWEEPS = "tests/commands/test_sweep_measures.py"
CHOICE = "tests/task/test_choice.py"
OWN_RULES = "tests/rules"
ARCHIVE = "tests/commands/test_archive.py"
ODD = "tests/report/test_odd.py"
NUMBERS = "tests/task/test_numbers.py"
ROLLOUT = "tests/envs/test_rollout.py"
ON_GPU = "tests/engines/test_gpu.py"
DESIGN = "tests/studies/test_design.py"
FEATURES = "tests/test_features.py"

# (file in taichi_ants/, old text, new text, tests that must notice)
MUTATIONS = [
    # Rules of users.
    ("rules/language.py", '"modulo({}, {})"', '"ti.floor({} / {})"', OWN_RULES),
    # Rules.
    ("features/labour.py", "chance = 1.0 / (1.0 + raised)", "chance = 1.0 - raised", CASTES),
    ("features/labour.py", "waits = drawn < 0.0", "waits = False", CASTES),
    ("features/labour.py", "and a.carries == 0:", "and True:", CASTES),
    ("features/labour.py", "lowered > 0.0, lowered", "True, lowered", COLONY),
    (
        "engines/colony/learning.py",
        "columns.of_caste(c, ant, CasteRow.LEARNS) == 1.0 if",
        "True if",
        COLONY,
    ),
    ("engines/colony/steps.py", ">> number & 1 == 1", ">> 0 & 1 == 1", COLONY),
    ("engines/colony/life.py", "ti.cast(bound <= word, ti.i32)", "0", COLONY),
    ("features/castes.py", "int(quotas[i]) - quotas[i])", "quotas[i])", CASTES),
    ("engines/colony/steps.py", "if c.counts_without_food == 1:", "if False:", COLONY),
    ("engines/colony/steps.py", "ti.select(carries == had_food, age, 0)", "age", COLONY),
    (
        "engines/colony/trail.py",
        "laid == Occasion.DEAD_END, cell, goes",
        "False, cell, goes",
        COLONY,
    ),
    ("engines/colony/trail.py", "event == Event.DELIVERED", "event == Event.BLOCKED", COLONY),
    ("engines/colony/trail.py", "(action == PICK_UP) & (event", "(event", COLONY),
    ("engines/colony/steps.py", "(field.half, carries", "(True, carries", COLONY),
    ("task/model.py", "task.choice.carriers_follow or ", "", CHOICE),
    ("measures/tidy.py", "column.startswith(f", "column == (f", RESULTS_OF_RUNS),
    ("rendering/rasteriser.py", "ANTS[snapshot.ant_nests]", "ANTS[0 * snapshot.ant_nests]", RASTER),
    (
        "viewer/recorder.py",
        "self.colony.tables_of_ants[0, slots] *",
        "0 * slots *",
        RECORDING,
    ),
    (
        "rendering/rasteriser.py",
        "FOODS[np.maximum(snapshot.ant_foods, 0)]",
        "FOODS[0 * snapshot.ant_foods]",
        RASTER,
    ),
    ("engines/colony/state.py", "if n > 1}", "if per != NEST}", COLONY),
    ("features/foods.py", "slots], state.kinds[w, slots]", "slots], 0", COLONY),
    ("task/rules/actions.py", "heading < 3, heading + 3", "heading < 2, heading + 3", RUNS),
    ("task/rules/actions.py", "return code & 1 == 0", "return code & 2 == 0", RUNS),
    ("task/rules/conflicts.py", "(other, tick) > key", "(other, tick) < key", COLONY),
    ("engines/colony/steps.py", "(index != queen)", "(index < 0)", COLONY),
    ("features/foods.py", "left = cell.loads - 1", "left = cell.loads - 2", COLONY),
    ("engines/colony/life.py", "put(c.nest, ant, nest)", "put(c.nest, ant, 0)", COLONY),
    ("features/foods.py", "cell.kind_of = ti.cast(a.kind, ti.u8)", "pass", COLONY),
    ("task/rules/conflicts.py", "loaded > other_loaded or", "loaded < other_loaded or", TRAFFIC),
    (
        "task/rules/conflicts.py",
        "rivals_left &= rivals_left - ti.u64(1)",
        "rivals_left = ti.u64(0)",
        COLONY,
    ),
    ("task/rules/conflicts.py", "compass[N_HEADINGS - i]", "compass[i + 1]", COLONY),
    ("engines/colony/steps.py", "enters &= actions.MOVES >> action", "enters &= 1", COLONY),
    ("engines/colony/steps.py", "goes = cell + enters * (wanted - cell)", "goes = wanted", COLONY),
    (
        "engines/colony/learning.py",
        "n + ti.cast(known == 0, ti.i32)",
        "n + ti.cast(known != 0, ti.i32)",
        COLONY,
    ),
    ("task/rules/conflicts.py", "stays = had_ant(", "stays = not had_ant(", TRAFFIC),
    ("task/rules/conflicts.py", "(WINS | TAKES_FOOD) == WINS", "WINS == WINS", TRAFFIC),
    ("task/rules/conflicts.py", "True, Event.PUSHED", "True, Event.ENTERED_EMPTY", COLONY),
    ("task/rules/actions.py", "(action == GIVE) & (", "(action == GIVE) | (", RUNS),
    ("task/rules/actions.py", "turns_at_queen == 1", "turns_at_queen == 0", RUNS),
    ("task/rules/actions.py", "(is_last | delivered &", "(is_last & delivered &", RUNS),
    ("task/rules/pheromone.py", "ti.min(level + p.deposit_level, p.cap)", "p.cap", COLONY),
    ("task/rules/pheromone.py", "ti.min(carried, p.fades_after)", "carried", ENGINE),
    ("task/rules/pheromone.py", "if after < 1.0:", "if after < 0.5:", COLONY),
    ("task/rules/pheromone.py", "levels[neighbour] * share", "level * share", COLONY),
    ("task/rules/policy.py", "if values[FORWARD] > larger", "if values[FORWARD] >= larger", RUNS),
    ("task/rules/policy.py", "larger(values[2], values[3])", "values[2]", RUNS),
    (
        "task/rules/policy.py",
        "(low_word(bits), N_ACTIONS)\n    if high_word(bits) >= explore_below:\n        others",
        "(high_word(bits), N_ACTIONS)\n    if high_word(bits) >= explore_below:\n        others",
        RUNS,
    ),
    (
        "task/rules/policy.py",
        "(1.0 - explores) / ti.cast(popcnt(best)",
        "1.0 / ti.cast(popcnt(best)",
        "tests/offline/test_recording.py",
    ),
    ("task/rules/policy.py", "cumulative <= drawn", "cumulative < drawn / 2", CHOICE),
    ("task/rules/policy.py", "(is_open_at * is_nearer).sum() > 0", "False", COLONY),
    ("arithmetic/numbers.py", "if m > ti.f64(SQRT_2)", "if m > ti.f64(2.0)", NUMBERS),
    ("arithmetic/guards.py", "result = mul(a, b)\n", "return mul(a, b)\n", ON_GPU),
    ("arithmetic/guards.py", "hidden(divisor, next(uses))", "divisor", ON_GPU),
    (
        "engines/runs/rollout_kernel.py",
        "record(a, t * a.n + i, code)",
        "record(a, i, code)",
        ON_GPU,
    ),
    ("features/noise.py", "ti.cast(other >= code", "ti.cast(other > code", CHOICE),
    (
        "task/rules/vision.py",
        "observation.reads[i])[k] = 0",
        "observation.reads[i])[k] += 0",
        f"{COLONY}::test_misread_cells_show_no_further_pheromone",
    ),
    ("engines/colony/steps.py", "ti.select(is_true == 1, level, 0)", "level", COLONY),
    (
        "engines/colony/learning.py",
        "c.streams[ant] == c.first",
        "0 * c.streams[ant] != 1 + c.first",
        CHOICE,
    ),
    ("arithmetic/random_bits.py", "ti.u64(27)", "ti.u64(28)", RUNS),
    ("task/rules/vision.py", "2 * level >= ti.max", "2 * level > ti.max", COLONY),
    ("task/rules/vision.py", "ti.max(strongest, 1)", "ti.max(strongest, 0)", RUNS),
    ("task/rules/vision.py", "nearer >> 1 & 1", "nearer >> 2 & 1", RUNS),
    ("task/observations/built_in.py", "code = 6", "code = 5", COLONY),
    (
        "task/observations/built_in.py",
        "level < view.strongest -",
        "level <= view.strongest -",
        "tests/engines/test_views.py",
    ),
    ("task/observations/built_in.py", "5 * index + code", "5 * index + view.codes[k]", COLONY),
    ("task/rewards.py", "[[Event.ENTERED_EMPTY, Event.PUSHED]]", "[Event.ENTERED_EMPTY]", TRAFFIC),
    # Engines.
    ("engines/runs/kernels.py", "step[k] + 1 == a.max_steps", "step[k] == a.max_steps", RUNS),
    ("engines/runs/kernels.py", "clock[k] += a.evaporates", "clock[k] += 1", RUNS),
    ("engines/runs/rollout_kernel.py", "steps == a.max_steps", "steps > a.max_steps", BATCHED),
    ("engines/runs/rollout_kernel.py", "base = own", "base = origin", ROLLOUT),
    ("engines/runs/step.py", "enters & ant.carries", "moves & ant.carries", BATCHED),
    ("task/rules/vision.py", "(state >> 1) & 21", "(state >> 1) & 5", BATCHED),
    ("engines/runs/rollout_kernel.py", "ant.random_state = stream", "pass", BATCHED),
    (
        "engines/runs/kernels.py",
        "a.trace[row, 5] = lanes.paper_state[k]",
        "a.trace[row, 5] = lanes.state[k]",
        RUNS,
    ),
    ("engines/runs/kernels.py", "lanes.lays[k] == 1, laid", "lanes.lays[k] == 0, laid", RUNS),
    ("engines/runs/kernels.py", "ti.cast(lanes.n_choices[k] > 1, ti.i32)", "0", RUNS),
    ("engines/runs/kernels.py", "ti.cast(lanes.explore_below[k] > 0, ti.i32)", "0", RUNS),
    ("engines/runs/step.py", "a.regrows == 0", "a.regrows == 1", RUNS),
    ("features/life.py", "a.age >= lifespan", "a.age > lifespan", COLONY),
    ("engines/colony/life.py", "tick >= taken + waits", "tick > taken + waits", COLONY),
    (
        "engines/colony/life.py",
        "(tick + 1) % c.pile_move_interval",
        "tick % c.pile_move_interval",
        COLONY,
    ),
    ("engines/colony/life.py", "== 1, FOOD, EMPTY)", "== 1, EMPTY, EMPTY)", COLONY),
    (
        "engines/colony/life.py",
        "FIRST_DELIVERY, w] = tick + 1",
        "FIRST_DELIVERY, w] = tick",
        COLONY,
    ),
    ("engines/colony/life.py", "c.number[ant] < c.n_ants", "c.number[ant] < c.n_ants - 1", COLONY),
    ("engines/colony/learning.py", "tick + 1 == c.length", "tick == c.length", COLONY),
    ("engines/colony/learning.py", "* _ONE + 0.5)", "* _ONE)", COLONY),
    ("engines/colony/learning.py", "shape[0] - 1)]  #", "shape[0] - 2)]  #", COLONY),
    ("engines/colony/learning.py", "c.initial_q, 0.0)", "0.0, 0.0)", COLONY),
    ("engines/colony/learning.py", "if number > c.sums_of", "if number < c.sums_of", COLONY),
    (
        "engines/colony/learning.py",
        "max(c.latest[entry], words)",
        "min(c.latest[entry], words)",
        BY_ANT,
    ),
    ("engines/colony/learning.py", "max(c.latest[joined]", "min(c.latest[joined]", BY_ANT),
    (
        "engines/colony/learning.py",
        "c.sums[joined] += c.sums[entry]",
        "c.sums[joined] = c.sums[entry]",
        BY_ANT,
    ),
    ("engines/colony/kernels.py", "if running == 1 and slot <", "if slot <", ENGINE),
    ("engines/colony/device.py", "if numbers != self._numbers:", "if not self._numbers:", BY_ANT),
    ("engines/colony/steps.py", "moves & (1 - enters)", "moves & enters", COLONY),
    ("engines/colony/steps.py", "tick) > level_of", "tick) >= level_of", TRAFFIC),
    ("engines/colony/steps.py", "c.carried[ant] = 1", "c.carried[ant] = 0", COLONY),
    (
        "engines/colony/interventions.py",
        "(episode << 32) + numbers",
        "(episode << 31) + numbers",
        PROTOCOL,
    ),
    ("engines/colony/interventions.py", 'f"{change.path}_decay": 1.0, ', "", SESSION),
    ("engines/colony/interventions.py", "numbers < colony.ants ", "numbers < 0 ", PROTOCOL),
    # Protocols.
    (
        "engines/colony/timetable.py",
        "colony.ticks < tick < end",
        "colony.ticks + 1 < tick < end",
        PROTOCOL,
    ),
    ("engines/colony/timetable.py", "~(done & event.once)", "~done", PROTOCOL),
    ("engines/colony/timetable.py", "        done |= worlds", "        done &= worlds", PROTOCOL),
    ("engines/colony/interventions.py", "nest)) + 0.5)", "nest)))", PROTOCOL),
    ("engines/colony/interventions.py", "max(episode, 0))", "0)", PROTOCOL),
    ("engines/colony/stepping.py", "if stale.any():", "if False:", PROTOCOL),
    ("engines/colony/stepping.py", "median(self.recent) / self", "recent[-1] / self", SCHEDULES),
    ("engines/colony/stepping.py", "if counts else pace", "if False else pace", SCHEDULES),
    ("engines/colony/kernels.py", "done * blocks)", "done)", BY_ANT),
    ("engines/colony/kernels.py", "done += 1", "done += of != WORLD", BY_ANT),
    ("protocol.py", "range(self.interval, length", "range(0, length", PROTOCOL),
    ("protocol.py", "value > self.above", "value >= self.above", PROTOCOL),
    # Learners.
    ("learners/expected_sarsa.py", "ti.f32(0.2)", "ti.f32(0.25)", RUNS),
    ("learners/double_q.py", "next_values[a] > largest", "next_values[a] >= largest", RUNS),
    ("learners/dyna_q.py", "(bits_of(rng)), n_visited)", "(bits_of(rng)), n_visited - 1)", RUNS),
    ("learners/model.py", "& 2047)", "& 1023)", RUNS),
    ("learners/prioritized_sweeping.py", "if ti.abs(error) >", "if error >", RUNS),
    ("learners/sarsa_lambda.py", "rates.discount * rates.trace_decay", "rates.trace_decay", RUNS),
    ("learners/n_step_sarsa.py", "(ends == 1 and", "(step.terminated == 1 and", RUNS),
    # Statistics.
    (
        "analysis/statistics.py",
        "cut = ordered.shape[1] // 4",
        "cut = ordered.shape[1] // 5",
        STATISTICS,
    ),
    ("analysis/statistics.py", "ddof=1", "ddof=0", STATISTICS),
    ("analysis/statistics.py", "stdtrit(kept - 1,", "stdtrit(kept,", STATISTICS),
    ("analysis/statistics.py", "2.0 ** (1 - n) >", "2.0 ** -n >", STATISTICS),
    ("analysis/statistics.py", "np.minimum(bootstrap", "np.maximum(bootstrap", STATISTICS),
    ("analysis/statistics.py", "np.sqrt(n / (n - 1))", "np.sqrt((n - 1) / n)", STATISTICS),
    ("analysis/statistics.py", "cubes / (6 *", "cubes / (3 *", STATISTICS),
    ("analysis/statistics.py", "levels * (last + 2) - 1", "levels * last", STATISTICS),
    ("analysis/findings.py", "max(1, len(readings))", "max(1, len(contrasts))", FINDINGS),
    ("analysis/findings.py", "< self.low or low > self.high", "< self.low", FINDINGS),
    (
        "analysis/findings.py",
        "-small <= low and high <= small",
        "-small < low < high < small",
        FINDINGS,
    ),
    ("analysis/findings.py", "first = min(findings", "first = max(findings", FINDINGS),
    ("analysis/findings.py", "np.clip(ends, *contrast.possible)", "np.array(ends)", FINDINGS),
    # Files.
    ("files/archives.py", " {array.shape}\\n", "\\n", ARCHIVES),
    ("files/archives.py", "if size > most:", "if size > 2 * most:", ARCHIVES),
    ("files/archives.py", "(kind, version) !=", "(kind, self.version) !=", ARCHIVES),
    ("files/__init__.py", 'with open(temporary, "wb")', 'with open(target, "wb")', FILES),
    ("files/__init__.py", "None if v != v else v", "v", FILES),
    ("studies/store.py", "if set(arrays.files) != {_ABOUT, *every}:", "if False:", STUDIES),
    ("studies/store.py", "if all(parts_of(name, b.", "if any(parts_of(name, b.", STUDIES),
    ("studies/store.py", "np.nan if array.dtype.kind", "0 if array.dtype.kind", STUDIES),
    ("studies/study.py", "(indices, -(-len(indices) // most))", "(indices, 1)", STUDIES),
    ("studies/study.py", "- work / 2", "", STUDIES),
    ("studies/study.py", "chain(point)[0]", "chain(point)[-1]", STUDIES),
    ("studies/study.py", "needed & first.missing(store)", "needed & False", STUDIES),
    ("studies/study.py", "len(failed) == _HOPELESS and", "False and", EXECUTORS),
    ("studies/points.py", "if setting != (", "if True or (", STUDIES),
    ("studies/points.py", '"physics": PHYSICS, "kind"', '"kind"', STUDIES),
    ("studies/points.py", "= declared.checked(settings[declared.name])", "= 0.5", STUDIES),
    ("studies/executors.py", "if deaths[piece] < TRIES:", "if False:", EXECUTORS),
    ("studies/executors.py", "if of_study != versions():", "if False:", EXECUTORS),
    ("studies/executors.py", " and len(coming) < 2 * workers:", ":", EXECUTORS),
    ("studies/ray.py", "            _check_listens(address)", "            pass", RAY),
    ("studies/folder.py", 'runs in ("points", "seeds")):', 'runs in ("points",)):', GROWING),
    ("studies/folder.py", "if before and not force:", "if False:", GROWING),
    ("studies/folder.py", "and checksum_of(folder / name) == checksum", "", GROWING),
    ("studies/sweep.py", "array[p, s].astype(float)", "array[p, 0].astype(float)", GROWING),
    # Recorder and viewer.
    ("viewer/recorder.py", "executed + 16 *", "executed + 8 *", RECORDING),
    ("viewer/recorder.py", "[order] + 8 * carrying", "[order] + 8 * ~carrying", RECORDING),
    ("viewer/recorder.py", "*rates, *counts, *clocks)", "*rates, *counts, *[0] * 9)", RECORDING),
    ("viewer/recorder.py", "colony.delivered[0] + totals", "0 * totals", SESSION),
    ("viewer/recorder.py", "        late._forget()\n", "", SESSION),
    ("viewer/recorder.py", "[new] = False", "[new] = True", RECORDING),
    (
        "viewer/recorder.py",
        "castes, ants[pair])",
        "castes, pair * 0 + 1)",
        RECORDING,
    ),
    ("viewer/frames.py", '"u2" if size < 2**16', '"u2" if size < 2**17', RECORDING),
    ("viewer/recorder.py", "self._ended = ticks,", "self._ended = 0,", SESSION),
    # Server.
    ("live/server.py", "self.in_flight >= _MOST_IN_FLIGHT", "self.in_flight < 0", SERVER),
    ("live/server.py", "not (knows or (", "not (True or (", SERVER),
    ("live/server.py", "len(host) == 1 and host[0] in hosts", "len(host) == 1", SERVER),
    ("live/server.py", "self._runs and bool(self.pages)", "self._runs", SERVER),
    ("live/server.py", 'request.get("do") in _CHANGES', "False", SERVER),
    ("live/server.py", "in_a_row or before.to_bytes() == session.to_bytes()", "in_a_row", SERVER),
    # Worlds and the grid.
    (
        "worlds/open_world.py",
        "3 * ranges // 4",
        "2 * ranges // 3",
        "tests/worlds/test_open_world.py",
    ),
    ("worlds/open_world.py", "rocks[clearing] = False", "pass", "tests/worlds/test_open_world.py"),
    (
        "worlds/double_bridge.py",
        "_corridor(long - ahead, ahead + aside",
        "_corridor(long - ahead, ahead",
        "tests/worlds/test_double_bridge.py",
    ),
    (
        "worlds/validation.py",
        '(2 if name == "trails" else 0)',
        "2",
        "tests/worlds/test_world_validation.py",
    ),
    (
        "worlds/world.py",
        "np.lexsort((words(cells), distance[near]))",
        "words(cells).argsort()",
        "tests/worlds",
    ),
    ("worlds/world.py", "offsets).ravel()", "offsets[:5]).ravel()", "tests/worlds"),
    ("grid/hexgrid.py", "difference > -y", "difference >= -y", "tests/grid"),
    # Measures and results.
    (
        "engines/colony/steps.py",
        "Tally.CARRIED, chunk, carried)",
        "Tally.CARRIED, chunk, 1)",
        COLONY,
    ),
    ("measures/built_in.py", 'ratio(counts["carried"]', 'ratio(counts["moves"]', MEASURES),
    ("measures/built_in.py", "float(steps - 1)", "float(steps)", MEASURES),
    ("measures/built_in.py", "level, n in pairs)", "level, _ in pairs for n in (1,))", MEASURES),
    ("measures/built_in.py", "log(len(levels)))", "log(len(levels) + 1))", MEASURES),
    ("measures/series.py", "if self._read.get(world) == tick:", "if False:", MEASURES),
    ("measures/finished.py", "* 1000 / run.ticks", "/ run.ticks", MEASURES),
    ("measures/finished.py", "changes.shape[-1] / 2", "changes.shape[-1]", MEASURES),
    ("registry.py", " or name in self._reserved", "", "tests/test_registry.py"),
    ("measures/built_in.py", "[snapshot.ant_cells].sum(", ".sum(", MEASURES),
    ("measures/tidy.py", "ticks == last[which", "ticks <= last[which", RESULTS_OF_RUNS),
    ("analysis/results.py", "goes_on, np.roll(begins, -1)", "goes_on, begins + 1", RESULTS_OF_RUNS),
    ("analysis/results.py", "- values[1])", "- values[0])", RESULTS_OF_RUNS),
    ("studies/sweep.py", "arrays[key][..., -1]", "arrays[key][..., 0]", SWEEPS),
    # Settings.
    ("settings.py", "converted <= above", "converted < above", SETTINGS),
    ("settings.py", "elif value != setting.default:", "elif False:", SETTINGS),
    ("settings.py", " and math.isfinite(value)", "", SETTINGS),
    ("settings.py", "changes[name] = setting.default", "pass", SETTINGS),
    ("settings.py", 'branch[part] = {"": inner}', "branch[part] = {}", SETTINGS),
    # Features, and what supports them.
    ("features/support.py", ".intersection(supports):", ":", FEATURES),
    ("settings.py", "if value == setting.default:", "if True:", FEATURES),
    # Designs.
    ("studies/design.py", "margin = 0.5 if axis.whole else 0.0", "margin = 0.0", DESIGN),
    ("studies/design.py", "low * (1 - share)", "low * share", DESIGN),
    ("studies/design.py", "from_last[-1] = True", "from_last[-1] = False", DESIGN),
    ("analysis/sensitivity.py", "default_rng(RANDOM_SEED)", "default_rng(0)", DESIGN),
    # Archives of studies, and descriptions of models.
    ("commands/reproduce.py", "> MOST_BYTES:", "> 2 * MOST_BYTES:", ARCHIVE),
    ("commands/reproduce.py", "len(names) - len(equal):", "0:", ARCHIVE),
    ("commands/reproduce.py", "if code and not settings.trust_code:", "if False:", ARCHIVE),
    ("files/__init__.py", "return copy or path", "return path", ARCHIVE),
    ("report/odd.py", 'return row.get(f"{group}.{other}") in needed', "return True", ODD),
    ("report/odd.py", "value[n] if name in varies", "value[0] if name in varies", ODD),
    ("report/odd.py", 'and not row["episodes"]', "and False", ODD),
]


def main(words: list[str]) -> int:
    """Return 0 if tests notice all mutations that contain one of the words, else 1."""
    chosen = [one for one in MUTATIONS if not words or any(w in " ".join(one) for w in words)]
    found: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as name:
        place = Path(name, "copy")
        ignored = shutil.ignore_patterns(".git", "__pycache__", ".*_cache")
        shutil.copytree(ROOT, place, ignore=ignored)
        for tests in dict.fromkeys(one[3] for one in chosen):
            if fails(place, tests):
                raise SystemExit(f"{tests} fails without a mutation; fix the test first.")
        for path, old, new, tests in chosen:
            start = time.monotonic()
            outcome = tried(place, place / "taichi_ants" / path, old, new, tests)
            found[outcome] = found.get(outcome, 0) + 1
            seconds = time.monotonic() - start
            print(f"{outcome:11}  {seconds:4.0f} s  {path}: {old} -> {new}", flush=True)
    print(", ".join(f"{n} {outcome}" for outcome, n in found.items()))
    return 0 if set(found) == {"noticed"} else 1


def tried(place: Path, file: Path, old: str, new: str, tests: str) -> str:
    """Return the outcome of one mutation of a file in a copy of the project at `place`."""
    text = file.read_text()
    if text.count(old) != 1:
        return "stale"
    write(file, text.replace(old, new))
    try:
        return "noticed" if fails(place, tests) else "NOT NOTICED"
    finally:
        write(file, text)


def write(file: Path, text: str) -> None:
    """Write a module, and remove its bytecode.

    Python compares bytecode by size and seconds, so it could reuse that of another mutation.
    """
    file.write_text(text)
    for compiled in file.parent.glob(f"__pycache__/{file.stem}.*.pyc"):
        compiled.unlink()


def fails(place: Path, tests: str) -> bool:
    """Return whether tests fail in a copy of the project, cannot be imported, or take too long."""
    environment = {**os.environ, "PYTHONPATH": str(place)}
    command = [sys.executable, "-m", "pytest", "-x", "-n0", "-p", "no:cacheprovider", tests]
    options = {"capture_output": True, "text": True, "timeout": TIMEOUT}
    try:
        done = subprocess.run(command, cwd=place, env=environment, **options)
    except subprocess.TimeoutExpired:
        return True
    if done.returncode > 2:  # a failure of pytest itself, such as a missing file
        raise SystemExit(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
    return bool(done.returncode)


if __name__ == "__main__":
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    words = "try mutations that contain one of these words (default: all)"
    parser.add_argument("words", nargs="*", metavar="WORD", help=words)
    sys.exit(main(parser.parse_args().words))
