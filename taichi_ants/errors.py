"""The one exception that speaks to users."""

from __future__ import annotations


class AntsError(ValueError):
    """Something that the caller asked for cannot be done.

    Its message is one sentence that names the value, what is allowed and what to do. The command
    lines print it on standard error and exit with status 2; library users catch it as a
    `ValueError`.
    """
