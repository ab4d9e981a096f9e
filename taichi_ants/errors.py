"""The one exception that speaks to users, and how messages name values and numbers of things."""

from __future__ import annotations

import operator
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np


_MOST_CHARACTERS = 1000  # of a message


class AntsError(ValueError):
    """Something that the caller asked for cannot be done.

    Its message is one sentence that names the value, what is allowed and what to do; the middle of
    a very long one is left out. Command lines print it on standard error and exit with status 2.
    """

    def __init__(self, message: object) -> None:
        # Other libraries copy an exception as `type(error)(error)`, so it may not be text.
        super().__init__(without_middle(str(message)))


def without_middle(message: str, most: int = _MOST_CHARACTERS) -> str:
    """A message of at most so many characters: its middle is left out if it is longer."""
    half = (most - 5) // 2
    return message if len(message) <= most else f"{message[:half]} ... {message[-half:]}"


def unusable(thing: Any, fault: object) -> AntsError:
    """The error of a learner or an observation that cannot be used."""
    kind, said = type(thing).__name__, str(fault).replace(".)", ")")
    return AntsError(f"{kind.lower()} {thing.name!r} cannot be used: {said}; see help({kind}).")


class _Short(reprlib.Repr):
    """Looks at the beginning of long texts and collections only, so that it is quick as well."""

    def repr_ndarray(self, array: object, level: int) -> str:
        """A large array by its form; its numbers would fill many lines."""
        if array.size <= self.maxlist:  # type: ignore[attr-defined]
            return repr(array)
        return f"an array of shape {array.shape} and type {array.dtype}"  # type: ignore[attr-defined]


def shown(value: object, most: int = 80) -> str:
    """A value as a message names it: its `repr` in one line of at most so many characters."""
    short = _Short()
    short.maxstring = short.maxother = most
    try:
        text = " ".join(short.repr(value).split())
    except ValueError:  # Python writes no integers of more than 4300 digits
        text = "a huge number"
    return text if len(text) <= most else text[: most - 3] + "..."


def count(number_of: int, noun: str) -> str:
    """How many of something: "1 seed", "2 seeds", "3 deliveries"."""
    if number_of == 1:
        return f"1 {noun}"
    return f"{number_of} {noun[:-1]}ies" if noun.endswith("y") else f"{number_of} {noun}s"


def check_one_of(name: str, value: object, allowed: Sequence[str]) -> None:
    """Raises AntsError, naming the value `name`, if it is not one of the allowed words."""
    if not isinstance(value, str) or value not in allowed:
        raise AntsError(f"{name} is {shown(value)}; it must be one of {', '.join(allowed)}.")


def is_flag(value: object) -> bool:
    """Whether a value is a bool of Python or NumPy, which need not be imported for that."""
    return isinstance(value, bool) or type(value).__name__ in ("bool", "bool_")


def check_new_name(kind: str, name: object, built_in: Iterable[str]) -> None:
    """Raises AntsError unless you can register a learner or observation (`kind`) by this name."""
    if not isinstance(name, str) or not name.isidentifier():
        raise AntsError(
            f"the name of the {kind} is {shown(name)}; it must be a word of letters, digits and _ "
            "that does not start with a digit."
        )
    if name in built_in:
        raise AntsError(
            f"{name!r} is the name of a built-in {kind}, which cannot be replaced; choose another "
            "name."
        )


def checked_flag(name: str, value: object) -> bool:
    """True or False as a Python bool; AntsError for all else, such as the true text "off"."""
    if not is_flag(value):
        raise AntsError(f"{name} is {shown(value)}; it must be True or False.")
    return bool(value)


def whole(name: str, value: object, otherwise: str = "") -> int:
    """`value` as a Python integer; AntsError if it is not one (booleans and floats are not)."""
    try:
        if is_flag(value):
            raise TypeError
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise AntsError(
            f"{name} is {shown(value)}; it must be a whole number{otherwise}."
        ) from None


def checked_whole(
    name: str, value: object, least: int = 1, most: int = 2**31 - 1, otherwise: str = ""
) -> int:
    """`value` as a Python integer; as `whole`, also if it does not lie between least and most."""
    number = whole(name, value, otherwise)
    if not least <= number <= most:
        raise AntsError(
            f"{name} is {shown(value)}; it must lie between {least} and {most}{otherwise}."
        )
    return number


def entries_of(values: object) -> list | None:
    """The entries of a sequence; None for all else, text and mappings included."""
    if isinstance(values, (str, bytes, Mapping)):
        return None
    try:
        return list(values)  # type: ignore[call-overload]
    except TypeError:
        return None


def array_of(name: str, values: object) -> np.ndarray:
    """`values` as an array of whatever type they have; AntsError if they have no form."""
    import numpy as np

    try:
        return np.asarray(values)
    except ValueError:
        raise AntsError(f"{name} is {shown(values)}; it must be an array.") from None


def check_array(name: str, value: Any, dtype: str | np.dtype, shape: tuple[int, ...]) -> None:
    """Raises AntsError, naming the value `name`, unless it is an array of this type and shape."""
    if (getattr(value, "dtype", None), getattr(value, "shape", None)) != (dtype, shape):
        raise AntsError(
            f"{name} is {shown(value)}; it must be an array of shape {shape} and type {dtype}."
        )


def expect(name: str, value: object, *kinds: type) -> None:
    """Raises AntsError, naming the value `name`, if it is of none of the kinds."""
    if not isinstance(value, kinds):
        names = (kind.__name__ for kind in kinds)
        words = [_PLAIN.get(n, f"{'an' if n[0] in 'AEIOU' else 'a'} {n}") for n in names]
        raise AntsError(f"{name} is {shown(value)}; it must be {' or '.join(words)}.")


_PLAIN = {"str": "text", "NoneType": "None", "ndarray": "an array", "PathLike": "a path"}
