"""Batched environments: many single ants, each in its own world, that take given actions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from taichi_ants import runtime
from taichi_ants.engines import layout
from taichi_ants.engines.layout import EXTRA_CELLS, TRUNCATED, Command
from taichi_ants.engines.runs.engine import laid_out
from taichi_ants.features import used_by
from taichi_ants.grid.constants import STREAM_ANT
from taichi_ants.grid.randomness import stream_state, words_of
from taichi_ants.records import Snapshot
from taichi_ants.task import Task
from taichi_ants.worlds.world import World

# Steps of all ants in a launch of a rollout, which cannot be interrupted; and on a GPU, numbers of
# their observations, because indices have 32 bits.
_STEPS_OF_LAUNCH, _NUMBERS_ON_GPU = 1 << 23, 1 << 28
# The arrays with one int32 per ant, the results of a single ant first.
_RESULTS = "states", "paper_states", "results", "reasons", "deliveries", "rewards_of"
_OF_ANTS = (
    *_RESULTS,
    *("taken", "commands"),
    *("start_cells", "start_headings", "worlds", "ant_cells", "headings", "carries", "carried"),
    *("steps", "changed", "final_states", "final_paper_states", "final_deliveries"),
)
_MOST_NUMBERS = 64  # that a step reads


class BatchedEnvironments:
    """n environments with one ant each.

    An ant depends only on its world, the task, its seed and its actions. All worlds have the same
    ranges; ant i lives in world i modulo the number of worlds. `ends` is the effect of a delivery
    on the episode: "terminates", "truncates" or "continues". In the last case food grows back at
    once. Trails evaporate if `falls`.

    Attributes:
        arrays: Arrays by name, with one row per ant, int32 if no other type is named. States:
            paper_states, states. Results of the last step: rewards_of, reasons (`Reason`), and
            results, see `layout.TERMINATED`; of a rollout, only whether the episode has ended. So
            has one that has not begun. Last states of an episode that a step has restarted:
            final_states, final_paper_states. Deliveries of the episode, and of one that a step has
            restarted: deliveries, final_deliveries.
        alone: A memoryview of all results of a single ant.
    """

    def __init__(
        self, worlds: Sequence[World], task: Task, n: int, max_steps: int, ends: str, falls: bool
    ) -> None:
        self.worlds, self.task, self.n = tuple(worlds), task, n
        self._launches: dict[tuple[bool, int], Any] = {}
        self._codes: np.ndarray | None = None  # workspace of rollouts
        self._cells_on_gpu: Any = None  # which are newer than those in `arrays`
        common = laid_out(self.worlds, task, falls)
        size = common["size"]
        number = np.arange(n, dtype=np.int32) % len(self.worlds)
        own = np.empty((n, size + EXTRA_CELLS), np.int32)
        own[:, :size] = common["world"].reshape(-1, size)[number]
        own[:, size:] = size, -1  # no cell has changed, see `step.restore`
        of_ants = {name: np.zeros(n, np.int32) for name in _OF_ANTS} | {"worlds": number}
        of_ants["results"][:] = TRUNCATED
        shared = {
            name: common.pop(name) for name in ("compass", "rewards", "closer", "trails", "world")
        }
        # A launch takes 0.4 microseconds for each array and 0.13 for each number, so a step has a
        # single array. The numbers are first, and random states have an even place.
        self._joined = layout.join(
            {
                "numbers": np.zeros(_MOST_NUMBERS, np.int32),
                "random_states": np.zeros(2 * n, np.int32),
                **of_ants,
                "after_end": np.full(1, Command.WAIT, np.int32),
                **shared,
                "own": own,
            }
        )
        self._numbers = {
            **common,
            "n": n,
            "n_steps": 1,
            "max_steps": max_steps,
            "regrows": int(ends == "continues"),
            "delivery_terminates": int(ends == "terminates"),
            "delivery_truncates": int(ends == "truncates"),
            # The cells of all worlds, then the cells of each ant.
            "cells_at": self._joined["world_at"],
            "shared_cells": shared["world"].size,
        }
        self._view()

    def _view(self) -> None:
        """Make the views of the memory, and the arguments of kernels."""
        self.arrays, memory = layout.split(self._joined), self._joined["memory"]
        self.arrays["random_states"] = self.arrays["random_states"].view(np.uint64)
        self.arrays["cells"] = memory[self._numbers["cells_at"] :]
        # "taken" and "commands" of a single ant as one number.
        self._given = memoryview(memory[self._joined["taken_at"] :][:2].view(np.int64))
        self._single: Any = None  # the launch of a step
        self.alone = memoryview(memory[self._joined[f"{_RESULTS[0]}_at"] :][: len(_RESULTS)])
        self._arguments = {**self._joined, **self._numbers}
        numbers = {name: one for name, one in self._arguments.items() if isinstance(one, int)}
        self._names, self.arrays["numbers"][: len(numbers)] = tuple(numbers), [*numbers.values()]
        # Besides them, kernels for lone ants read only the probabilities of features.
        read = {f"{name}_below" for one in used_by(self.task) for name in one.probabilities}
        self._of_steps = {name: self._arguments[name] for name in ("memory", *sorted(read))}

    def seed(self, seeds: Sequence[int], which: np.ndarray) -> None:
        """Set the seeds of some ants, int (k,): new random streams and start cells."""
        words = words_of(seeds)
        self.arrays["random_states"][which] = stream_state(words, STREAM_ANT, 0)
        for number, world in enumerate(self.worlds):
            here = self.arrays["worlds"][which] == number
            cells, headings = world.first_starts(words[here])
            self.arrays["start_cells"][which[here]] = cells
            self.arrays["start_headings"][which[here]] = headings

    def step(
        self,
        actions: np.ndarray | int,
        commands: np.ndarray | int = Command.STEP,
        after_end: Command = Command.WAIT,
    ) -> None:
        """Do a rollout of one step by commands (n,) to the ants, whose results are `arrays`."""
        self.arrays["taken"][:] = actions
        self.arrays["commands"][:] = commands
        self.arrays["after_end"][0] = after_end
        with runtime.alone:
            self._single = self._launch(False, 0)
        self._single.repeat(self._of_steps)

    def step_alone(self, action: int) -> bytes:
        """Let the only ant, whose episode has begun, act; return its `alone` after the step."""
        self._given[0] = action  # and the command STEP, which is 0
        (self._single or self._launch(False, 0)).repeat(self._of_steps)
        return self.alone.tobytes()

    def rollout(
        self,
        rows: Mapping[str, np.ndarray],
        shown: np.ndarray,
        begins: np.ndarray,
        after_end: Command,
        policy: tuple[np.ndarray, np.ndarray, float] | None,
    ) -> Callable[[str], np.ndarray]:
        """Take several steps, and record each; return a function that returns rows by name.

        On a GPU, results stay there until this function is called with their name.

        Args:
            rows: Arrays (steps, n, ...) by name. `taken`, int64, are the actions: given ones or,
                with a policy, those it chose. The results are `seen`, observations of the dtype of
                `shown`; `rewards_of`, float64; `result_rows`, uint8, see `layout.TERMINATED`; and,
                if the next episode begins in the step that ends one, `final_states`, int32.
            shown: The observation of each state, int64 or float32 (n_states, ...).
            begins: True for ants that start an episode in the first step, bool (n,).
            after_end: The command after the last step of an episode; STEP if the next episode
                begins in the same step.
            policy: The best actions in each state, as bits, int64 (n_states,), a random stream for
                each ant, uint64 (n,), and epsilon; or None.
        """
        launch = self._launch(policy is not None, shown[0].size)
        from taichi_ants.engines.device_memory import copy_out
        from taichi_ants.engines.launch import check_not_lost

        if self._codes is None:
            from taichi_ants.engines.runs.rollout_kernel import CODES_OF_CHUNK, WIDTH

            chunks = 1 if runtime.compiles_for_gpu() else -(-self.n // WIDTH)
            self._codes = np.empty(chunks * CODES_OF_CHUNK, np.int64)
        most = _STEPS_OF_LAUNCH
        if runtime.compiles_for_gpu():
            most = _NUMBERS_ON_GPU // shown[0].size
        steps = max(1, most // self.n)
        values = {
            **self._arguments,
            # As arrays of their own, which many steps read faster.
            **{name: self.arrays[name] for name in ("compass", "rewards", "closer")},
            "cells": self._arguments.get("cells", self.arrays["cells"]),
            "shown": shown.reshape(-1),
            "codes": self._codes,
        }
        if policy is not None:
            best, choices, epsilon = policy
            below = np.uint64(epsilon * 4294967296.0)
            values |= {"best": best, "choices": choices, "explore_below": below}
        self.arrays["commands"][:] = begins
        self.arrays["after_end"][0] = after_end
        on_gpu: list[tuple[dict[str, np.ndarray], dict[str, Any]]] = []
        with runtime.alone:
            for first in range(0, len(rows["taken"]), steps):
                part = {name: one[first : first + steps].reshape(-1) for name, one in rows.items()}
                several = {**values, **part, "n_steps": len(part["taken"]) // self.n}
                on_gpu.append((part, launch.without_outputs(several)))

        def fetch(name: str) -> np.ndarray:
            for part, outputs in on_gpu:
                if (copy := outputs.pop(name, None)) is not None:
                    check_not_lost([copy])
                    copy_out(copy, part[name])
            return rows[name]

        last = rows["rewards_of"][-1]
        if (rewards := on_gpu[-1][1].get("rewards_of")) is not None:
            copy_out(rewards, last, rewards.shape[0] - self.n)
        self.arrays["rewards_of"][:] = last
        return fetch

    def _launch(self, follows: bool, width: int) -> Any:
        """Return the `Launch` of a rollout with observations of `width` numbers."""
        if (follows, width) not in self._launches:
            runtime.start()  # configures Taichi before the imports below
            from taichi_ants.engines.device_memory import on_device
            from taichi_ants.engines.launch import Launch
            from taichi_ants.engines.runs.rollout_kernel import WIDTH, rollout_kernel
            from taichi_ants.engines.runs.step import Rules

            names = () if width else self._names
            form = Rules.of(self.task), follows, width, self.n <= WIDTH, names
            outputs = {"seen", "rewards_of", "result_rows", "final_states", "codes"}
            kernel_of, changed = partial(rollout_kernel, *form), {"memory", "choices"}
            launch = Launch(kernel_of, changed, outputs | {"taken"} if follows else outputs)
            self._launches[follows, width] = launch
            if runtime.compiles_for_gpu() and self._cells_on_gpu is None:
                self._cells_on_gpu = on_device(self.arrays["cells"])
                memory = self._joined["memory"][: self._joined["own_at"]]
                for arguments in (self._arguments, self._of_steps):
                    arguments |= {"memory": memory, "cells": self._cells_on_gpu}
        return self._launches[follows, width]

    def snapshot(self, number: int) -> Snapshot:
        """Return the present state of an ant's world; arrays are copies."""
        self._fetch_cells()
        arrays, grid = self.arrays, self.worlds[0].grid
        own = self._numbers["shared_cells"] + number * (grid.size + EXTRA_CELLS)
        ground, levels = layout.unpack_cells(arrays["cells"][own : own + grid.size])
        trail = np.maximum(levels - arrays["steps"][number] * self._numbers["evaporates"], 0)
        one = slice(number, number + 1)
        cells, headings = arrays["ant_cells"][one].copy(), arrays["headings"][one].copy()
        return Snapshot(grid, ground, trail, cells, headings, arrays["carries"][one].astype(bool))

    def _fetch_cells(self) -> None:
        """Copy the cells from the GPU, if they are there."""
        if self._cells_on_gpu is not None:
            from taichi_ants.engines.device_memory import copy_out
            from taichi_ants.engines.launch import check_not_lost

            check_not_lost([self._cells_on_gpu])
            copy_out(self._cells_on_gpu, self.arrays["cells"])

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without Taichi's objects, so that copies and pickles work."""
        self._fetch_cells()
        parts = ("worlds", "task", "n", "_joined", "_numbers")
        return {name: getattr(self, name) for name in parts}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _launches={}, _codes=None, _cells_on_gpu=None)
        self._view()
