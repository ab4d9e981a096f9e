"""The exception for users, checks of simple arguments, and the format of values in messages."""

from __future__ import annotations

import operator
import reprlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    import numpy as np


class AntsError(ValueError):
    """An invalid argument or file, or another request that cannot be fulfilled.

    The message is one sentence that names the value, what is allowed, and what to do. A very long
    message is cut in the middle. Commands print it on standard error and exit with status 2.

    >>> try:
    ...     worlds.build("papre")
    ... except AntsError as error:
    ...     print(str(error).partition(" (")[0])
    there is no world 'papre'
    """

    def __init__(self, message: object) -> None:
        # Other libraries copy an exception as `type(error)(error)`, so `message` may not be text.
        super().__init__(without_middle(str(message)))


def without_middle(message: str, most: int = 1000) -> str:
    """Return a message, without its middle if it has more than `most` characters."""
    half = (most - 5) // 2
    return message if len(message) <= most else f"{message[:half]} ... {message[-half:]}"


def refuse(name: str, value: object, allowed: str) -> NoReturn:
    """Raise the AntsError for a value that is not allowed."""
    raise AntsError(f"{name} is {shown(value)}; it must be {allowed}.")


def words_of(error: Exception, what: str = "this") -> str:
    """Return the sentence about an error, also about `what` there is too little memory for."""
    if isinstance(error, MemoryError):
        return f"there is too little memory for {what}; choose smaller numbers."
    return str(error)


@contextmanager
def enough_memory(what: str) -> Iterator[None]:
    """Return a decorator, or context, that raises AntsError if there is too little memory."""
    try:
        yield
    except MemoryError as error:
        raise AntsError(words_of(error, what)) from error


def unusable(registered: Any, fault: object) -> AntsError:
    """Return the error for a learner or an observation that cannot be used."""
    kind, why = type(registered).__name__, str(fault).replace(".)", ")")
    return AntsError(f"{kind.lower()} {registered.name!r} cannot be used: {why}; see help({kind}).")


def imported(feature: str, module: str, extra: str) -> Any:
    """Return a module that an extra of this package installs; AntsError if it is missing."""
    try:
        return import_module(module)
    except ImportError as error:
        how = f'run pip install -e ".[{extra}]" in your clone'
        raise AntsError(f"{feature} needs {module}, which cannot be imported; {how}.") from error


class _Short(reprlib.Repr):
    """Formats only the beginning of long texts and collections, which is also quick."""

    def repr_ndarray(self, array: object, level: int) -> str:
        if array.size <= self.maxlist:  # type: ignore[attr-defined]
            return repr(array)
        return f"an array of shape {array.shape} and type {array.dtype}"  # type: ignore[attr-defined]


def shown(value: object, most: int = 80) -> str:
    """Return a value as messages show it: its `repr` in a line of at most `most` characters."""
    short = _Short()
    short.maxstring = short.maxother = most
    try:
        text = " ".join(short.repr(value).split())
    except ValueError:  # Python does not write integers of more than 4300 digits
        text = "a huge number"
    return text if len(text) <= most else text[: most - 3] + "..."


def count(number_of: int, noun: str) -> str:
    """Return a number with its noun: "1 seed", "2 days", "3 deliveries"."""
    if number_of == 1:
        return f"1 {noun}"
    if noun.endswith("y") and not noun.endswith(("ay", "ey", "oy", "uy")):
        return f"{number_of} {noun[:-1]}ies"
    return f"{number_of} {noun}s"


def check_one_of(name: str, value: object, allowed: Sequence[str]) -> None:
    """Raise AntsError if the value called `name` is not one of the allowed words."""
    if not isinstance(value, str) or value not in allowed:
        refuse(name, value, f"one of {', '.join(allowed)}")


def is_flag(value: object) -> bool:
    """Return whether a value is a bool of Python or NumPy, without importing NumPy."""
    return isinstance(value, bool) or type(value).__name__ in ("bool", "bool_")


def checked_flag(name: str, value: object) -> bool:
    """Return a bool as a Python bool; AntsError for other values, even true ones like "off"."""
    if not is_flag(value):
        refuse(name, value, "True or False")
    return bool(value)


def whole(name: str, value: object, otherwise: str = "") -> int:
    """Return a whole number as a Python integer; AntsError for others, also bools and floats."""
    with suppress(TypeError):
        if not is_flag(value):
            return operator.index(value)  # type: ignore[arg-type]
    refuse(name, value, f"a whole number{otherwise}")


def checked_whole(
    name: str, value: object, least: int = 1, most: int = 2**31 - 1, otherwise: str = ""
) -> int:
    """Return a whole number between `least` and `most` as a Python integer; else AntsError."""
    number = whole(name, value, otherwise)
    if not least <= number <= most:
        raise AntsError(
            f"{name} is {shown(value)}; it must lie between {least} and {most}{otherwise}."
        )
    return number


def entries_of(values: object) -> list | None:
    """Return the entries of a sequence; None for other values, also for text and mappings."""
    if isinstance(values, (str, bytes, Mapping)):
        return None
    try:
        return list(values)  # type: ignore[call-overload]
    except TypeError:
        return None


def as_array(
    name: str,
    values: object,
    dtype: Any = "",
    shape: tuple[int | None, ...] | None = None,
    low: float | None = None,
    high: float | None = None,
) -> np.ndarray:
    """Return values as an array; AntsError unless it has the type, the shape and the bounds.

    `dtype` is a type, or letters of NumPy's kinds of types: "iu", "fiu" or "b". None in a shape
    stands for any length.
    """
    import numpy as np

    try:
        array = np.asarray(values)
    except ValueError:  # rows of different lengths
        array = np.empty(0, object)
    is_kind = isinstance(dtype, str) and dtype in _ARRAYS
    fits = array.dtype.kind in dtype if is_kind else array.dtype == dtype
    if shape is not None:
        fits &= len(shape) == array.ndim
        fits &= all(a in (b, None) for a, b in zip(shape, array.shape, strict=False))
    if not fits:
        form = _ARRAYS[dtype] if is_kind else f"type {np.dtype(dtype)}"
        lengths = ", ".join("n" if length is None else str(length) for length in shape or ())
        of = "" if shape is None else f" and of shape ({lengths}{',' * (len(shape) == 1)})"
        refuse(name, values, f"an array of {form}{of}")
    if low is not None:
        outside = ~((array >= low) & (array <= high))
        if outside.any():
            wrong = array[outside][0]
            raise AntsError(f"{name} contains {wrong}; all must lie between {low} and {high}.")
    return array


_ARRAYS = {"iu": "whole numbers", "fiu": "real numbers", "b": "True and False"}


def check_word(name: str, value: object) -> None:
    """Raise AntsError unless the value called `name` can be a name in Python."""
    if not isinstance(value, str) or not value.isidentifier():
        allowed = "a word of letters, digits and _ that does not start with a digit"
        refuse(name, value, allowed)


def expect(name: str, value: object, *kinds: type) -> None:
    """Raise AntsError unless the value called `name` is an instance of one of the kinds."""
    if not isinstance(value, kinds):
        names = (kind.__name__ for kind in kinds)
        words = [_PLAIN.get(n, f"{'an' if n[0] in 'AEIOU' else 'a'} {n}") for n in names]
        refuse(name, value, " or ".join(words))


_PLAIN = {"str": "text", "NoneType": "None", "ndarray": "an array", "PathLike": "a path"}
_PLAIN |= {"Mapping": "a mapping of names to values", "Iterable": "a list"}
_PLAIN |= {"World": "a World, such as worlds.paper()"}
_PLAIN |= {"Tidy": "a result of Colony.run, train or evaluate"}
