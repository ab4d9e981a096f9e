"""Recording of a running colony, as frames of changes.

A colony of one ant replays the episode of a trace.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from taichi_ants import learners
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.runs.results import Trace
from taichi_ants.errors import AntsError, count, expect
from taichi_ants.features import used_by
from taichi_ants.features.castes import update_weights_of
from taichi_ants.features.cues import CUES
from taichi_ants.features.feature import Feature, Mark
from taichi_ants.rendering.scene import name_parts
from taichi_ants.rendering.snapshots import colony_of_rollout, intervals
from taichi_ants.task.constants import ACTION_NAMES, N_ACTIONS, Event
from taichi_ants.viewer.frames import pack, types_of
from taichi_ants.viewer.page import Recording

_MOST_NAMES = 1 << 13  # states up to which a header names all states, seen or not
_RESTS = 15  # the action of an ant that rests in frames
_MOST = 2000  # points of curves

Point = tuple[float, ...]  # see `frames.POINT`


class Recorder:
    """Makes frames of the first world of a colony: `snapshot` of the present, `tick` over time.

    Args:
        colony: A colony in an episode.
        title: The title of the page; "" for a description of the colony.
        follow: The number of the ant that the page follows at first.

    >>> recorder = viewer.Recorder(colony, title="A colony")
    >>> frames = [recorder.snapshot(), recorder.tick(), recorder.tick(10)]
    >>> recording = viewer.Recording(recorder.header(), frames)
    """

    def __init__(self, colony: Colony, title: str = "", follow: int | None = None) -> None:
        expect("colony", colony, Colony)
        expect("title", title, str)
        self.colony, self._title, self._follow = colony, title, follow
        self.grid, self._n_states = colony.snapshot().grid, colony.task.n_states
        self._learns, owners = colony.sharing != "frozen", colony._owners
        dense = (one.dense for one in colony.pheromones)
        self.types = types_of(self.grid.size, self._n_states, *dense)
        self._known = np.zeros(owners * self._n_states, bool)  # rows of tables that were sent
        self._owners = np.full(owners, -1) if colony.one_a_slot else np.arange(owners)
        # For curves: the first episode, the ticks until the last end that was noted, its episode.
        self._first, self._before, self._ended = colony.episode, 0, -1
        self._every, self._seen = 1, 0  # one of `_every` points is kept
        self._points: list[Point] = []
        self._new: list[Point] = []
        self._forget()

    def _forget(self) -> None:
        """Begin with the data of a page that has read no frames."""
        self._sent: dict[str, Any] = {}  # numbers, queens, and layers of cells, as last sent
        self._table = np.full((len(self._known), N_ACTIONS), np.nan, np.float32)

    @property
    def ticks(self) -> int:
        """The number of ticks in all episodes."""
        return self._before + self.colony.ticks * (self.colony.episode != self._ended)

    def note(self, ended: bool = False) -> None:
        """Add a point of the curves: at the end of an episode, or within the first one.

        Call it with `ended` before another episode begins.

        >>> recorder = viewer.Recorder(colony)
        >>> frames = [recorder.snapshot(), recorder.tick(100)]
        >>> recorder.note(ended=True)
        >>> colony.end_episode()
        """
        colony = self.colony
        if not ended and colony.episode != self._first:
            return
        outcome, ticks = colony.outcome(), self.ticks
        if self._seen % self._every == 0:
            delivered = colony.delivered[0] + outcome.deliveries[0, 0]
            returns = outcome.returns[0, 0]
            numbers = (colony.episode, ticks, delivered, returns, colony.epsilon, ended)
            self._points.append(tuple(map(float, numbers)))
            self._new.append(self._points[-1])
        self._seen += 1
        if len(self._points) > _MOST:
            del self._points[1::2]
            self._every *= 2
        if ended:
            self._before, self._ended = ticks, colony.episode

    @property
    def _marks(self) -> list[tuple[Feature, Mark]]:
        return [(feature, mark) for feature in used_by(self.colony.task) for mark in feature.marks]

    def header(self) -> dict[str, Any]:
        """Return facts about all frames, JSON-compatible."""
        colony, task = self.colony, self.colony.task
        changes = task.life.births or task.life.lifespan
        ants = "Ants" if changes else count(colony.ants, "ant")
        is_own = task.choice.own_rule or not task.sees.encode.__module__.startswith("taichi_ants.")
        by_letters = colony.has_training and not is_own and not task.noise.misread
        names = task.cues
        few, seen = self._n_states <= _MOST_NAMES, np.flatnonzero(self._known) % self._n_states
        named = range(self._n_states) if few else np.unique(seen).tolist()
        return {
            "format": 6,
            "title": self._title or f"{ants} in a world of {self.grid.count} cells",
            "ranges": list(self.grid.ranges),
            "types": self.types,
            # `seen_by` is its view, "" if an ant may know more or less than its letters say.
            "pheromones": [
                {"name": name, "strongest": one.darkest, "seen_by": one.view if by_letters else ""}
                for name, one in zip(names, colony.pheromones, strict=False)
            ],
            "senses": {name: cue.words for name, cue in CUES.items()},  # what a better cell is
            "nests": colony.n_nests,
            "n_states": self._n_states,
            "names": {state: name_parts(task.sees, state) for state in named},
            "view": list(task.sees.cells),
            "letters": task.sees.letters,
            "actions": ACTION_NAMES,
            "events": [event.name for event in Event],
            "castes": list(task.castes),
            "foods": list(task.foods),
            "marks": [
                {"words": mark.words, "most": getattr(feature.of(task), mark.most, None)}
                for feature, mark in self._marks
            ],
            "rule": task.choice.rule,
            "values": colony.has_training,  # whether ants choose by action values
            "groups": [  # of ants: the castes, or one of all ants
                {
                    "cues": [names[cue] for cue in task.cues_of(caste)],
                    "learns": self._learns and not (caste and caste.policy),
                }
                for caste in task.castes.values() or [None]
            ],
            "learns": self._learns,
            "own_tables": colony.one_a_slot,
            "follow": self._follow,
            "about": self._about(),
        }

    def _about(self) -> list[tuple[str, str]]:
        colony, config = self.colony, self.colony.training
        x, y, z = self.grid.ranges
        task = colony.task
        lines = {
            "world": f"{self.grid.count} cells, ranges {x}, {y}, {z}",
            "ants at the start": str(colony.ants),
            "seed": str(colony.seeds[0]),
            "observation": f"{task.sees.name}, {self._n_states} states",
            "nests": str(colony.n_nests) if colony.n_nests > 1 else "",
            "castes": ", ".join(task.castes),
            "fields": ", ".join(task.fields),
            "kinds of food": ", ".join(task.foods),
        }
        if self._learns:
            lines["learner"] = learners.registry.label(config.learner)
            groups = {"nest": colony.n_nests, "caste": len(task.castes)}
            parts = " and ".join(name for name, n in groups.items() if n > 1)
            shared = f"one per {parts}" if parts else "shared"
            lines["table"] = "one per ant" if colony.one_a_slot else shared
            lines["learning rate"] = f"{config.learning_rate:g}"
            lines["discount"] = f"{config.discount:g}"
        elif colony.has_training:
            lines |= {"policy": "frozen", "epsilon": f"{colony.epsilon:g}"}
        if task.choice.rule != "greedy":
            lines["rule of choice"] = task.choice.rule
        return [(name, words) for name, words in lines.items() if words]

    def snapshot(self) -> bytes:
        """Return a frame of the present: the first frame, or after an intervention."""
        return self._frame({})

    def whole(self) -> bytes:
        """Return the last frame with all data, not only changes, for a page without frames.

        >>> recorder = viewer.Recorder(colony)
        >>> frames = [recorder.snapshot(), recorder.tick()]
        >>> len(recorder.whole()) > len(frames[-1])
        True
        """
        late = copy.copy(self)
        late._forget()
        late._known, late._owners = self._known.copy(), self._owners.copy()
        late._new = self._points
        return late._frame({})

    def tick(self, n: int = 1, td_errors: np.ndarray | None = None) -> bytes:
        """Return a frame after n more ticks; it has the actions of ants only if n is 1.

        `td_errors` are the TD errors of ants in the order of their numbers, if known.
        """
        if n > 1:
            self.colony.tick(n)
            return self._frame({})
        colony, slots = self.colony, self._living()
        states, numbers = colony.states[0, slots], colony.numbers[0, slots]
        before, ahead = self._tables(), np.zeros(len(slots), bool)
        if colony._model.draws_next_action:
            ahead = colony.next_actions[0, slots] >= 0
        colony.tick()
        # Slots of ants that died still hold their data.
        after = colony.numbers[0]
        order = np.argsort(after, kind="stable")
        places = order[np.searchsorted(after, numbers, sorter=order)]
        actions = colony.actions[0, places]
        executed = colony.executed[0, places]
        executed = np.where(executed < 0, _RESTS, executed)
        acts = {"acts": executed + 16 * colony.events[0, places]}
        acts["choices"] = np.where(actions < 0, _RESTS, actions + 8 * ahead)
        acts["rewards"] = colony.rewards[0, places]
        if td_errors is None and self._learns:
            td_errors = self._td_errors(before, slots, states, actions)
        return self._frame(acts if td_errors is None else {**acts, "td_errors": td_errors})

    def _living(self) -> np.ndarray:
        """Return the slots of living ants in the order of their numbers."""
        (slots,) = np.nonzero(self.colony.living[0])
        return slots[np.argsort(self.colony.numbers[0, slots], kind="stable")]

    def _tables(self) -> np.ndarray:
        """Return the rows of all tables, float32 (owners * n_states, 5)."""
        return self.colony.q_values[0].reshape(-1, N_ACTIONS)

    def _rows(self, slots: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Return the rows of `_tables` that hold the states of ants."""
        return self.colony.tables_of_ants[0, slots] * self._n_states + states

    def _td_errors(
        self, before: np.ndarray, slots: np.ndarray, states: np.ndarray, actions: np.ndarray
    ) -> np.ndarray:
        """Return the TD error of each ant; ants with the same state and action get their mean.

        NaN for learners with more than one update per step, and if the learning rate is 0.
        """
        errors, learner = np.full(len(slots), np.nan), learners.get(self.colony.training.learner)
        acted = actions >= 0  # ants that rest have not
        if learner.td_error is None or learner.plans or not acted.any():
            return errors
        slots, states = slots[acted], states[acted]
        pairs = self._rows(slots, states) * N_ACTIONS + actions[acted]
        moved = self._tables().astype(np.float64).ravel()[pairs] - before.ravel()[pairs]
        _, pair, ants = np.unique(pairs, return_inverse=True, return_counts=True)
        castes = self.colony.castes[0, slots]
        weights = update_weights_of(self.colony, castes, ants[pair])
        values = np.full(len(moved), np.nan)
        errors[acted] = np.divide(moved, weights, out=values, where=weights > 0)
        return errors

    def _frame(self, sections: dict[str, Any]) -> bytes:
        """Return a frame of the changes since the last one, added to `sections`."""
        colony, snapshot = self.colony, self.colony.snapshot()
        outcome, slots = colony.outcome(), self._living()
        order = np.argsort(snapshot.ant_numbers, kind="stable")  # as `slots`
        numbers = snapshot.ant_numbers[order]
        sections["cells"] = snapshot.ant_cells[order]
        carrying, nests = snapshot.ant_carries[order], snapshot.ant_nests[order]
        sections["poses"] = snapshot.ant_headings[order] + 8 * carrying + 16 * nests
        if colony.task.castes or colony._model.n_kinds > 1:
            foods = np.maximum(snapshot.ant_foods[order], 0)
            sections["groups"] = snapshot.ant_castes[order] + 16 * foods
        if self._marks:
            sections["marks"] = [
                mark.fades(snapshot.of_ants[mark.view][order], feature.of(colony.task))
                for feature, mark in self._marks
            ]
        for name, values in (("numbers", numbers), ("queens", snapshot.queens)):
            if not np.array_equal(values, self._sent.get(name, ())):
                sections[name] = self._sent[name] = values
        sections["states"] = colony.states[0, slots]
        tick = int(outcome.ticks[0, 0])
        totals = (outcome.deliveries[0, 0], outcome.returns[0, 0])
        rates = (colony.epsilon, colony.learning_rate)
        delivered = colony.delivered[0] + totals[0]
        counts = (len(numbers), delivered, self.ticks)
        stored = [colony._stored_pheromone(0, n) for n in range(len(colony.pheromones))]
        clocks = [clock for _, clock in stored]
        sections["clock"] = (colony.episode, tick, *totals, *rates, *counts, *clocks)
        sections["progress"], self._new = self._new, []
        layers = {"ground": snapshot.ground, "kinds": snapshot.food_kinds}
        layers |= {f"trail{number or ''}": layer.copy() for number, (layer, _) in enumerate(stored)}
        for name, layer in layers.items():
            cells = np.flatnonzero(self._sent.get(name, 0) != layer)
            sections |= {f"{name}_at": cells, name: layer[cells]}
        self._sent |= layers
        sections |= self._table_changes(slots, numbers, sections["states"])
        return pack(self.types, sections)

    def _table_changes(
        self, slots: np.ndarray, numbers: np.ndarray, states: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Return changed action values of the states that ants have visited."""
        if self.colony.one_a_slot:  # a slot's table belongs to the ant that lives there now
            new = slots[self._owners[slots] != numbers]
            self._owners[slots] = numbers
            self._known.reshape(-1, self._n_states)[new] = False
            self._table.reshape(len(self._owners), -1)[new] = np.nan
        self._known[self._rows(slots, states)] = True
        rows = np.flatnonzero(self._known)
        values = self._tables()[rows]
        row, action = np.nonzero(values != self._table[rows])
        self._table[rows] = values
        owner, state = np.divmod(rows[row], self._n_states)
        places = (self._owners[owner] * self._n_states + state) * N_ACTIONS + action
        return {"table_at": places, "table": values[row, action]}


def record_colony(
    colony: Colony,
    ticks: int = 0,
    frame_interval: int = 1,
    *,
    title: str = "",
    follow: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Return a recording of a colony's next ticks.

    Args:
        colony: A colony in an episode; it advances by `ticks`.
        ticks: The number of ticks; 0 records only the present.
        frame_interval: Ticks between frames; only 1 records the action of each ant.
        title, follow: As in `Recorder`.
        progress: Called after each frame with the completed share of the work.

    Raises:
        AntsError: A number is not allowed, or no episode has begun.

    >>> len(viewer.record_colony(colony, ticks=10, frame_interval=5).frames)
    3
    """
    between, done = intervals(colony, ticks, frame_interval, follow), 0
    recorder = Recorder(colony, title, follow)
    frames = [recorder.snapshot()]
    for n in between:
        frames.append(recorder.tick(n))
        done += n
        if progress is not None:
            progress(done / ticks)
    return Recording(recorder.header(), frames)


def record_trace(trace: Trace, title: str = "") -> Recording:
    """Return a recording of a `rollout` or `trace_training`; AntsError for any other trace.

    >>> trace = rollout(worlds.paper(), result.q_values[0, 0], max_steps=20)
    >>> len(viewer.record_trace(trace).frames) == len(trace) + 1
    True
    """
    expect("trace", trace, Trace)
    arguments = trace.arguments
    if arguments is None:
        raise AntsError(
            "the trace does not contain its world and settings, so it cannot be replayed; use a "
            "trace of rollout or trace_training."
        )
    expect("title", title, str)
    if arguments.config is None:
        title = title or "One ant that follows a policy"
        return record_colony(colony_of_rollout(arguments), len(trace), title=title, follow=0)
    # A colony of one ant with an independent table repeats the training.
    options: dict[str, Any] = {"sharing": "independent", "ends_at_delivery": True}
    colony = Colony(arguments.world, arguments.task, arguments.config, arguments.seed, 1, **options)
    colony.begin_episode(arguments.max_steps)
    recorder, frames = Recorder(colony, title, 0), []
    errors = np.zeros(len(trace)) if trace.td_errors is None else trace.td_errors
    for number, (step, error) in enumerate(zip(trace.steps.tolist(), errors, strict=True)):
        if step == 0 and number:
            recorder.note(ended=True)
            colony.end_episode()
            colony.begin_episode(arguments.max_steps)
        if step == 0:
            frames.append(recorder.snapshot())
        frames.append(recorder.tick(td_errors=np.array([error])))
    return Recording(recorder.header(), frames)
