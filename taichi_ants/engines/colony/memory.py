"""The arrays and numbers of a colony in the memory of a device, as kernels read them.

A launch costs microseconds for each argument, and a GPU allows 64. So the device has one array for
each type of numbers, in which all arrays of this type follow each other. The first entries are what
kernels read as numbers: those of the model, the place of each array, and its shape.
"""

from typing import Any, NamedTuple

from taichi.lang.impl import expr_init, subscript

from taichi_ants.kernel_functions import Named, while_compiling

KINDS = "i8", "u8", "i32", "i64", "u64", "f32", "f64"  # the types of numbers


class Contents(NamedTuple):
    """The numbers that kernels read, by name and kind, and the arrays: name, kind, dimensions."""

    numbers: tuple[tuple[str, str], ...]
    arrays: tuple[tuple[str, str, int], ...]

    def heads(self) -> dict[str, list[str]]:
        """Return the names of the numbers at the start of the memory of each kind.

        Those of an array are `NAME.place`, and `NAME.0`, `NAME.1` of its shape.
        """
        heads: dict[str, list[str]] = {kind: [] for kind in KINDS}
        for name, kind in self.numbers:
            heads[kind].append(name)
        for name, _, ndim in self.arrays:
            heads["i32"] += [f"{name}.place", *(f"{name}.{axis}" for axis in range(ndim))]
        return heads


class _Held:
    """An array in kernels: the part of a memory that begins at a place."""

    def __init__(self, memory: Any, place: Any, shape: tuple[Any, ...]) -> None:
        self.memory, self.place, self.shape = memory, place, shape

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, tuple):
            row, column = index
            index = row * self.shape[1] + column
        return subscript(None, self.memory, self.place + index)


@while_compiling
def number_of(contents: Contents, memories: Any, name: str) -> Any:
    """Return a whole number, while a kernel compiles."""
    return subscript(None, memories.i32, contents.heads()["i32"].index(name))


@while_compiling
def view_of(contents: Contents, memories: Any) -> Named:
    """Return the arrays and numbers by name, as rules read them, while a kernel compiles."""
    # Read once into variables, because a compiler reads memory again after each write into it.
    known = {
        name: expr_init(subscript(None, getattr(memories, kind), place))
        for kind, names in contents.heads().items()
        for place, name in enumerate(names)
    }
    for name, kind, ndim in contents.arrays:
        shape = tuple(known[f"{name}.{axis}"] for axis in range(ndim))
        known[name] = _Held(getattr(memories, kind), known[f"{name}.place"], shape)
    return Named(known.__getitem__)
