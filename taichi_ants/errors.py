"""The one exception that speaks to users."""

from __future__ import annotations


class AntsError(ValueError):
    """Something that the caller asked for cannot be done.

    Its message is one sentence that names the value, what is allowed and what to do. The command
    lines print it on standard error and exit with status 2; library users catch it as a
    `ValueError`.
    """


def checked_flag(name: str, value: object) -> bool:
    """True or False as a Python bool; text such as "off" would count as True.

    Raises:
        AntsError: `value` is neither; names it `name`.
    """
    import numpy as np  # not above: command lines show their help without it

    if not isinstance(value, (bool, np.bool_)):
        raise AntsError(f"{name} is {value!r}; it must be True or False.")
    return bool(value)
