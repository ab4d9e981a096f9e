"""Features of the model. Each is one file: its settings, arrays, hooks, measures and words.

The engine, the state of a colony, its snapshots and files, your rules, measures, recordings and the
description of a model walk over the declarations; none of them names a feature. `FEATURES` lists
the features in the order of their hooks, which is the order of random draws, and `POINTS` the
places in a tick at which hooks run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple

from taichi_ants.features.points import POINTS
from taichi_ants.kernel_functions import Function, KernelFunction
from taichi_ants.settings import Settings

if TYPE_CHECKING:
    import numpy as np

ANT, NEST, CELL = "ant", "nest", "cell"
# Of `taichi_ants.task`, which imports the features.
Task = Any
Caste = Any
State = Any  # a `ColonyState`
_default: Any = cache(lambda settings: settings())  # of a group; they cost more than the rest


class Array(NamedTuple):
    """An array of a colony by ant, or by world and nest, cell, or what a feature counts.

    Attributes:
        name: Its name in hooks; that of the array in kernels, and in files.
        per: ANT, NEST, CELL, or one of `Feature.spaces`.
        dtype: The type in kernels; "i1", "i4" or "f4" per ant.
        view: Its name as an attribute of a colony; of a feature, also that of a snapshot, with
            "ant_" in front. "" if it has none.
        shown_as: The type of the attribute, which is a copy; "" for a writable view.
        words, values, unit: The name, the values and the unit in the description of a model, which
            leaves out arrays without a name.
        start: The value at the start of an episode, and where no ant is.
        instead: The array that the attribute shows if a colony does not need this one; "" for 0.
        always: Whether kernels have the array, with one entry, if the model does not need it.
        doc: The docstring of the attribute, without type and shape.
    """

    name: str
    per: str
    dtype: str
    view: str = ""
    shown_as: str = ""
    words: str = ""
    values: str = "at least 0"
    unit: str = ""
    start: int = 0
    instead: str = ""
    always: bool = False
    doc: str = ""


class Mark(NamedTuple):
    """How pages show an array of the ants: those of which it is true, or small, look faded.

    Attributes:
        view: The view of the array.
        words: The words in the legend and at an ant.
        most: The setting of the feature with the value at which ants are not faded; "" if the array
            is true or false.
    """

    view: str
    words: str
    most: str = ""

    def fades(self, values: np.ndarray, settings: Any) -> np.ndarray:
        """Return how faded ants are, uint8 (n,), from 0 to 255 for true, or for 0."""
        import numpy as np

        most = getattr(settings, self.most) if self.most else None
        shares = values if most is None else 1.0 - np.clip(values / most, 0.0, 1.0)
        return np.rint(255 * shares).astype(np.uint8)


class Input(NamedTuple):
    """An input of your rules: its meaning, and its number of entries if it is a vector, else 0.

    `by_deliveries` says whether it changes with the deliveries of a tick before ants observe.
    """

    meaning: str
    length: int = 0
    by_deliveries: bool = False


@dataclass(eq=False, frozen=True, repr=False)
class Feature:
    """A group of rules, or a part of one.

    Attributes:
        settings: The class of its group of settings in a task.
        switch: The setting of which the default means that a task does not use the feature; by
            default all settings of the group.
        uses: A function of a task that says whether it uses the feature, instead of the switch.
        runs_alone: Whether lone ants have the feature, too.
        spaces: What it counts, with functions of a colony that return its number in a world.
        arrays: The arrays that it adds to the state of a colony.
        numbers: Settings that hooks read as `a.task.GROUP.SETTING`, f64.
        probabilities: Settings that hooks read as `a.SETTING_below`: a bound of random words, u64.
        of_castes: Numbers of each caste, f64, which hooks read as `a.NAME`: functions of a task and
            a caste.
        fixed: A function of a caste whose result cannot change in an episode.
        columns: A function of a colony that returns the arrays (W, ants) of ants that start, where
            these are not 0.
        filled: A function of a colony and of kinds of food (...,), which returns the arrays of
            cells that are filled with this food.
        tables_by: The name of an array of ants, and of what it numbers: ants of a nest with equal
            numbers share a table of action values.
        policies: A function of a task that returns the policies that ants with a number in
            `tables_by` follow, by this number, and their names in messages.
        without_files: A function of a task that returns one without files as policies.
        constants: A function of a colony that returns further arrays of its kernels.
        refusals: A function of a colony's task, worlds and sharing that yields why it cannot be.
        counts: A function of a colony that returns further results of the episode so far (W, ...),
            by their names in `ColonyEpisodes`; also if no task uses the feature.
        paid: A function of a colony and of rewards by event (W, capacity), which returns rewards.
        shown: A function of a colony, the number of a world, the slots of its ants, and of whether
            cells have food, which returns fields of a `Snapshot`.
        newborn: A function of a colony, a world, the nests (n,) of ants that an intervention adds,
            and a function that draws n words. It returns their arrays (n,) where these are not 0.
        faults: A function of a task that yields what is wrong with it, as sentences.
        example: Settings of a task that uses the feature.
        measures: Its measures by name: a function of a `Snapshot`, the unit, and words.
        marks: The marks by which pages show its arrays of ants.
        hooks: Its hooks by the names of points.
        inputs: Inputs of your rules by name, with the functions of an ant that return them.
    """

    settings: type[Settings]
    switch: str = ""
    uses: Callable[[Task], bool] | None = None
    runs_alone: bool = False
    spaces: Mapping[str, Callable[[State], int]] = field(default_factory=dict)
    arrays: tuple[Array, ...] = ()
    numbers: tuple[str, ...] = ()
    probabilities: tuple[str, ...] = ()
    of_castes: Mapping[str, Callable[[Task, Caste], float]] = field(default_factory=dict)
    fixed: Callable[[Caste], Any] = lambda caste: None
    columns: Callable[[State], Mapping[str, Any]] = lambda state: {}
    filled: Callable[..., Mapping[str, Any]] = lambda state, kinds: {}
    tables_by: str = ""
    policies: Callable[[Task], Mapping[int, tuple[str, str]]] = lambda task: {}
    without_files: Callable[[Task], Task] = lambda task: task
    constants: Callable[[State], Mapping[str, Any]] = lambda state: {}
    refusals: Callable[[Task, Any, str], Iterator[str]] = lambda task, worlds, sharing: iter(())
    counts: Callable[[State], Mapping[str, Any]] = lambda state: {}
    paid: Callable[[State, np.ndarray], np.ndarray] = lambda state, rewards: rewards
    shown: Callable[..., Mapping[str, Any]] = lambda state, w, slots, is_food: {}
    newborn: Callable[..., Mapping[str, Any]] = lambda state, w, nests, draw: {}
    faults: Callable[[Task], Iterator[str]] = lambda task: iter(())
    example: Mapping[str, Any] = field(default_factory=dict)
    measures: Mapping[str, tuple[Function, str, str]] = field(default_factory=dict)
    marks: tuple[Mark, ...] = ()
    hooks: dict[str, KernelFunction] = field(default_factory=dict)
    inputs: dict[str, tuple[Input, KernelFunction]] = field(default_factory=dict)

    @cached_property
    def group(self) -> str:
        """The name of its group of settings in a task."""
        return self.settings.path.split(".")[1]

    @property
    def name(self) -> str:
        """Its name: the group, with the switch after a point if it has one."""
        return f"{self.group}.{self.switch}" if self.switch else self.group

    def of(self, task: Task) -> Any:
        """Return its settings in a task."""
        return getattr(task, self.group)

    def is_used(self, task: Task) -> bool:
        """Whether a task uses the feature."""
        if self.uses is not None:
            return self.uses(task)
        chosen, default = self.of(task), _default(self.settings)
        if self.switch:
            return getattr(chosen, self.switch) != getattr(default, self.switch)
        return chosen != default

    def at(self, point: str) -> Callable[[Function], KernelFunction]:
        """Register a function as the hook at a point, as a decorator."""

        def register(body: Function) -> KernelFunction:
            given, expected = " ".join(signature(body).parameters), POINTS[point]
            if given != expected:
                raise TypeError(f"{body.__name__} has ({given}), but {point} needs ({expected})")
            self.hooks[point] = KernelFunction(body)
            return self.hooks[point]

        return register

    def input(self, meaning: str, by_deliveries: bool = False) -> Callable[[Function], Function]:
        """Register a function of an ant as an input of your rules, as a decorator."""

        def register(body: Function) -> KernelFunction:
            read = Input(f"{meaning}; needs `{self.settings.path}`", by_deliveries=by_deliveries)
            self.inputs[body.__name__] = read, KernelFunction(body)
            return self.inputs[body.__name__][1]

        return register
