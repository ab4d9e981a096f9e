"""Declarations of settings.

A class of settings is a frozen dataclass whose fields declare range, unit, condition and help as
`Annotated[type, Setting(...)]`. These declarations generate checks, keys of sweep files,
command-line options, controls of pages, and the tables of the documentation.

    @dataclass(frozen=True)
    class Pheromone(Settings, path="task.pheromone"):
        evaporation: Annotated[Literal["linear", "exponential"], Setting("...")] = "linear"
        half_life: Annotated[
            float | None,
            Setting("time in which a trail halves", unit="ticks", above=0, usual=50.0,
               only=("evaporation", "exponential")),
        ] = None

    >>> Pheromone("exponential", half_life=0)
    AntsError: `task.pheromone.half_life` is 0; it must be above 0.

This module does not import NumPy, so that commands show their help quickly.
"""

from __future__ import annotations

import difflib
import math
import operator
import os
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, dataclass, fields, replace
from functools import cache, partial, reduce, wraps
from inspect import Signature, cleandoc, signature
from numbers import Real
from textwrap import fill
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic, Literal, NamedTuple, TypeVar

from taichi_ants.errors import AntsError, check_word, entries_of, is_flag, refuse, shown

Self = TypeVar("Self", bound="Settings")
Function = TypeVar("Function", bound=Callable[..., Any])
_KINDS: dict[type, str] = {bool: "True or False", int: "a whole number", float: "a number"}


@dataclass(frozen=True)
class Setting:
    """The declaration of a setting, except its type; several in one annotation are combined.

    Attributes:
        help: A phrase that describes the setting.
        unit: The unit of a number, for example "ticks".
        least, most: The smallest and the largest value.
        above: A lower bound that is not allowed itself.
        only: The name of another setting of the class, and the values of it that this setting
            requires; with other values it must have its default.
        usual: The value that replaces None where the setting has an effect.
        choices: A function that returns the allowed words, if plugins can register more.
        or_region: Whether the name of a region can replace a list of cells.
    """

    help: str = ""
    unit: str = ""
    least: float | None = None
    most: float | None = None
    above: float | None = None
    only: tuple[Any, ...] | None = None
    usual: Any = None
    choices: Callable[[], tuple[str, ...]] | None = None
    or_region: bool = False

    def replace(self, other: Setting) -> Setting:
        """Return the combination of both; where `other` declares something, it takes precedence."""
        defaults = vars(Setting())
        declared = {k: v for k, v in vars(other).items() if v is not defaults[k] and v != ""}
        return replace(self, **declared)


Share = Annotated[float, Setting(least=0, most=1)]
Count = Annotated[int, Setting(least=1, most=2**31 - 1)]
Seed = Annotated[int, Setting("any whole number")]
Flag = Annotated[bool, Setting()]


class DeclaredSetting(NamedTuple):
    """A declared setting.

    `path` is its full name. `kind` is bool, int, float, str, list, `Named`, or a class of settings;
    `entry` is the class of the entries of a `Named`. `words` are the allowed words if they are
    fixed; `default` is MISSING if the setting is required.
    """

    name: str
    path: str
    kind: type
    words: tuple[str, ...]
    optional: bool
    default: Any
    rule: Setting
    entry: type = NoneType

    @property
    def is_group(self) -> bool:
        """Whether the setting is a class of settings."""
        return issubclass(self.kind, Settings)

    @property
    def allowed(self) -> str:
        """The allowed values, in the words of messages and tables."""
        if self.kind is str:
            words = ", ".join(self.allowed_words)
            registered = ", or that of a plugin" if self.rule.choices else ""
            return f"one of {words}{registered}" if words else "text"
        if self.kind is Named:
            return f"a table of names, each with a {self.entry.__name__}"
        if self.is_group:
            words = ", ".join(self.kind.named())  # type: ignore[attr-defined]
            form = self.kind.form or f"a {self.kind.__name__}"  # type: ignore[attr-defined]
            yours = any(setting.rule.choices for setting in declared(self.kind))
            registered = ", or that of a plugin" if yours else ""
            return form + (f", or one of {words}{registered}" if words else "")
        if self.kind is list:
            one = self.rule.or_region
            return "a list of cells, or the name of a region" if one else "a list of numbers"
        return f"{_KINDS[self.kind]} {self._range}".rstrip()

    def about(self, value: Any) -> str:
        """Return the help of the command-line option whose default is `value`."""
        named = self.kind.named() if self.is_group else {}  # type: ignore[attr-defined]
        words = self.allowed_words or tuple(named)
        allowed = f"one of {', '.join(words)}" if words else self._range
        unit = f", in {self.rule.unit}" if self.rule.unit else ""
        parts = [self.rule.help + unit, *([allowed] if allowed else [])]
        if self.rule.only is not None:
            other, *values = self.rule.only
            flag = _below(self.path.rpartition(".")[0], other).replace("_", "-")
            parts.append(f"only with --{flag} {_either(str(word).lower() for word in values)}")
        default = self.rule.usual if value is None else value
        if self.is_group:
            default = next((name for name, preset in named.items() if preset == default), MISSING)
        if default is None or self.kind is bool:
            default = str(default).lower()
        return "; ".join(parts) + ("" if default is MISSING else f" (default: {default})")

    @property
    def in_words(self) -> tuple[str, str, str]:
        """The allowed values, the default and the meaning, as tables and docstrings show them."""
        rule = self.rule
        default = self.default if rule.usual is None else rule.usual
        if default is MISSING:
            default = "required"
        elif default is None or self.kind is Named:
            default = "none" if self.kind in (list, Named) else "off"
        else:
            default = f"`{self.kind.__name__}()`" if self.is_group else f"`{default!r}`"
        unit = f", in {rule.unit}" if rule.unit else ""
        only = ""
        if rule.only is not None:
            only = f"; only with `{rule.only[0]}` {_either(map(repr, rule.only[1:]))}"
        return self.allowed + unit, default, rule.help + only

    def checked(self, value: Any) -> Any:
        """Return a value as a Python object of the setting's kind; AntsError if not allowed."""
        word = self.kind is not str and isinstance(value, str) and value == "none"
        if self.optional and (value is None or word):
            return None  # files and command lines write "none", because they have no None
        converted = self._converted(value)
        if converted is None:
            self._refuse(value, self.allowed)
        if self.kind in (int, float):
            least, most, above = self.rule.least, self.rule.most, self.rule.above
            is_outside = least is not None and converted < least
            is_outside |= above is not None and converted <= above
            if is_outside or (most is not None and converted > most):
                self._refuse(value, self._range)
        return converted

    def _converted(self, value: Any) -> Any:
        """Return the value converted to the setting's kind; None if that is impossible."""
        if self.kind is bool or is_flag(value):
            return bool(value) if self.kind is bool and is_flag(value) else None
        try:
            if self.kind is int:
                return operator.index(value)
            if self.kind is float:
                return float(value) if isinstance(value, Real) and math.isfinite(value) else None
        except (TypeError, ValueError, OverflowError):  # integers can be too large for a float
            return None
        if self.kind is str:
            value = os.fspath(value) if isinstance(value, os.PathLike) else value
            allowed = self.allowed_words
            fits = isinstance(value, str) and (not allowed or value in allowed)
            return value if fits else None
        if self.kind is list:  # the code that uses the list checks its entries
            return value if self.rule.or_region and isinstance(value, str) else entries_of(value)
        if self.kind is Named:
            return self._named(value, {}) if isinstance(value, Mapping) else None
        if issubclass(self.kind, Settings):
            value = self.kind.converted(value)
            value = self.kind.from_dict(value) if isinstance(value, Mapping) else value
        return value if isinstance(value, self.kind) else None

    def _named(self, value: Mapping[Any, Any], start: Mapping[str, Any]) -> Named[Any]:
        """Return named settings in which `value` replaces or changes those of `start`."""
        entry, entries = self.entry, dict(start)
        for name, new in value.items():
            check_word(f"a name in `{self.path}`", name)
            try:
                kind = entry.entry_named(name)  # type: ignore[attr-defined]
                if isinstance(new, Mapping) and name in start:
                    new = start[name].replace(**new)
                entries[name] = new if isinstance(new, kind) else kind.from_dict(new)
            except AntsError as error:
                raise AntsError(str(error).replace(".NAME", f".{name}")) from None
        if len(entries) > (most := entry.most_entries):  # type: ignore[attr-defined]
            self._refuse(list(entries), f"{self.allowed}, at most {most}")
        return Named(entries)

    def _refuse(self, value: Any, allowed: str) -> None:
        has_none = self.optional and self.rule.only is None and not self.is_group
        or_none = ", or None" if has_none else ""
        refuse(f"`{self.path}`", value, allowed + or_none)

    @property
    def allowed_words(self) -> tuple[str, ...]:
        """The allowed words; empty if any text is allowed."""
        return self.rule.choices() if self.rule.choices else self.words

    @property
    def _range(self) -> str:
        rule = self.rule
        if rule.least is not None and rule.most is not None:
            return f"between {_plain(rule.least)} and {_plain(rule.most)}"
        bounds = {"above": rule.above, "at least": rule.least, "at most": rule.most}
        words = (f"{word} {_plain(n)}" for word, n in bounds.items() if n is not None)
        return " and ".join(words)


def _is_ready(cls: type) -> bool:
    """Return whether a class of settings is a dataclass yet; `dataclass` sets this name last."""
    return "__match_args__" in vars(cls)


class _Signature:
    """The arguments of a class of settings, with their types, but without declarations."""

    def __get__(self, _: object, cls: Any) -> Signature:
        if not _is_ready(cls):
            raise AttributeError("__signature__")
        hints = typing.get_type_hints(cls)
        _, *arguments = signature(cls.__init__).parameters.values()
        return Signature(
            [one.replace(annotation=hints.get(one.name, one.annotation)) for one in arguments]
        )


class _Documentation:
    """The docstring of a class of settings, followed by its settings as they are declared."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __get__(self, _: object, cls: type) -> str:
        if not _is_ready(cls) or not declared(cls):
            return self._text
        return _described(self._text, "Attributes", declared(cls))


def _described(text: str, heading: str, settings: Iterable[DeclaredSetting]) -> str:
    """Return a docstring, followed by settings as they are declared."""
    lines = [cleandoc(text), "", f"{heading}:"]
    for setting in settings:
        values, default, meaning = setting.in_words
        absent = default if default == "required" else f"default: {default}"
        line = f"{setting.name}: {meaning}; {values} ({absent})."
        lines.append(fill(line, 100, initial_indent=" " * 4, subsequent_indent=" " * 8))
    return "\n".join(lines)


class Settings:
    """Base of the classes of settings, which are frozen dataclasses.

    `path` is the full name of the settings in sweep files and messages. If the class is a setting
    of another class, the names that `named` returns are allowed as values. Raises AntsError if a
    value is not allowed, or would have no effect.
    """

    path: ClassVar[str] = ""
    most_entries: ClassVar[float] = math.inf  # of this class in a `Named`
    # What the description of a model says of these settings: a sentence for "NAME=VALUE", for a
    # setting "NAME" that differs from its default, and for "" always. `{NAME}` is a value.
    sentences: ClassVar[Mapping[str, str]] = {}
    form: ClassVar[str] = ""  # the values that stand for these settings, in the words of messages

    def __init_subclass__(cls, path: str = "", **more: Any) -> None:
        super().__init_subclass__(**more)
        cls.path = path or cls.path
        if cls.__doc__:
            cls.__doc__ = _Documentation(cls.__doc__)  # type: ignore[assignment]

    if not TYPE_CHECKING:  # type checkers and editors read the fields
        __signature__ = _Signature()

        def __new__(cls, /, *values: Any, **named: Any) -> Any:
            known = [field.name for field in fields(cls)]
            for name in named:  # Python's own message has no path and no similar names
                if name not in known:
                    groups = [setting for setting in declared(cls) if setting.is_group]
                    below = [f"{g.name}.{name}" for g in groups if name in g.kind.__annotations__]
                    says = not_a_setting(name, below or known)
                    raise AntsError(f"`{_below(cls.path, name)}` {says}")
            return super().__new__(cls)

    def __post_init__(self) -> None:
        self.check()
        for fault in self._faults():
            raise AntsError(fault)

    def __repr__(self) -> str:
        """Return the settings that differ from their defaults; for classes with `repr=False`."""
        values = [(setting, getattr(self, setting.name)) for setting in declared(type(self))]
        changed = [f"{s.name}={value!r}" for s, value in values if value != s.default]
        return f"{type(self).__name__}({', '.join(changed)})"

    @classmethod
    def named(cls) -> Mapping[str, Any]:
        """Return the named values of this class."""
        return {}

    @classmethod
    def converted(cls, value: Any) -> Any:
        """Return the settings that another value stands for, by default a name; else the value."""
        return cls.named().get(value) if isinstance(value, str) else value

    @classmethod
    def entry_named(cls, name: str) -> type[Settings]:
        """Return the class of the entry of this name in a `Named` of this class."""
        return cls

    def check(self) -> None:
        """Check each value, and convert it to its kind."""
        for setting in declared(type(self)):
            object.__setattr__(self, setting.name, setting.checked(getattr(self, setting.name)))
        for setting in declared(type(self)):
            if setting.rule.only is None:
                continue
            other, *values = setting.rule.only
            value = getattr(self, setting.name)
            if getattr(self, other) in values:
                if value is None:
                    object.__setattr__(self, setting.name, setting.rule.usual)
            elif value != setting.default:
                raise AntsError(
                    f"`{setting.path}` is {shown(value)}; leave it out unless `{other}` is "
                    f"{_either(map(repr, values))}."
                )

    def _faults(self) -> Iterator[str]:
        """Yield messages about combinations of values that are not allowed."""
        yield from ()

    def uses(self) -> dict[str, str]:
        """Return the features in use, each with the words of messages about it.

        A feature is a setting that differs from its default, by its name below these settings, for
        example `noise.slip`. If its values are words, it includes the value: `choice.rule=softmax`.
        A mapping of named settings is one feature.
        """
        features: dict[str, str] = {}
        for setting in declared(type(self)):
            value = getattr(self, setting.name)
            if value == setting.default:
                continue
            if isinstance(value, Settings):
                of_group = value.uses().items()
                features |= {f"{setting.name}.{name}": words for name, words in of_group}
            elif isinstance(value, Named):
                features[setting.name] = f"`{setting.path}` has {', '.join(value)}"
            else:
                word = f"={value}" if setting.allowed_words else ""
                features[setting.name + word] = f"`{setting.path}` is {shown(value)}"
        return features

    def replace(self: Self, /, **changes: Any) -> Self:
        """Return the settings with changes; settings that lose their effect get their defaults.

        To change a group, give a mapping of its settings; its entry "" is the value to start from.

        >>> Pheromone("exponential", half_life=30).replace(diffusion=0.1).half_life
        30.0
        """
        for setting in declared(type(self)):
            name = setting.name
            if setting.rule.only and name not in changes:
                other, *values = setting.rule.only
                if changes.get(other, getattr(self, other)) not in values:
                    changes[name] = setting.default
            elif isinstance(value := changes.get(name), Mapping) and setting.kind is Named:
                changes[name] = setting._named(value, getattr(self, name))
            elif setting.is_group and is_table(value):
                inner = dict(value)
                start = setting.checked(inner.pop("")) if "" in inner else getattr(self, name)
                changes[name] = start.replace(**inner)
        return replace(self, **changes)  # type: ignore[type-var]

    @classmethod
    def from_dict(cls: type[Self], facts: Any) -> Self:
        """Return the settings in a mapping, checked; groups are mappings or names.

        >>> Task.from_dict({"observation": "ants", "pheromone": {"level": 300}}).pheromone.level
        300
        """
        return cls(**cls._required(facts)).replace(**facts)

    @classmethod
    def _required(cls, facts: Mapping[str, Any]) -> dict[str, Any]:
        """Return the settings that have no default; AntsError if one is missing in a table."""
        if not is_table(facts):
            refuse(f"`{cls.path}`", facts, "a table of settings")
        required = [setting for setting in declared(cls) if setting.default is MISSING]
        for setting in required:
            if setting.name not in facts:
                cls.__new__(cls, **facts)  # raises an error if the name is misspelt
                raise AntsError(f"`{setting.path}` is missing; add it.")
        return {setting.name: facts[setting.name] for setting in required}


Entry = TypeVar("Entry")


class Named(dict[str, Entry], Generic[Entry]):
    """An ordered, read-only mapping from names to settings of one class, for example fields.

    The path of the class of the entries ends in ".NAME". In sweep files each entry is a table:
    `[task.fields.home]`. Equal mappings have equal entries in the same order.
    """

    def _refuse(self, *arguments: Any, **named: Any) -> Any:
        raise TypeError("named settings are read-only; use `replace` of what has them")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __eq__(self, other: object) -> bool:
        return isinstance(other, dict) and list(self.items()) == list(other.items())

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(tuple(self.items()))

    def __reduce__(self) -> Any:
        return Named, (dict(self),)


def named_groups(cls: Any) -> Iterator[DeclaredSetting]:
    """Yield the settings of a class, and of its groups, that are mappings of named settings."""
    return (setting for setting in all_of(cls) if setting.kind is Named)


def settings_of_entry(group: DeclaredSetting, name: str) -> dict[str, DeclaredSetting]:
    """Return the declarations of the entry of this name in a named group, by their full names."""
    entry: Any = group.entry.entry_named(name)  # type: ignore[attr-defined]
    of_entry = {
        f"{group.path}.{name}{setting.path.removeprefix(entry.path)}": setting
        for setting in all_of(entry)
    }
    return {path: setting._replace(path=path) for path, setting in of_entry.items()}


def declared(cls: Any) -> tuple[DeclaredSetting, ...]:
    """Return the settings of a class or function: its fields or arguments with a `Setting`."""
    return _read(cls)


@cache
def _read(cls: Any) -> tuple[DeclaredSetting, ...]:
    settings, hints = [], typing.get_type_hints(cls, include_extras=True)
    for name, default in _defaults(cls):
        hint = hints.get(name)
        # Python 3.10 makes arguments with the default None optional.
        if typing.get_origin(hint) is typing.Union:
            hint = typing.get_args(hint)[0]
        if typing.get_origin(hint) is not Annotated:
            continue
        kind, *rules = typing.get_args(hint)
        rule = reduce(Setting.replace, rules)
        optional = typing.get_origin(kind) in (typing.Union, UnionType)
        if optional:
            (kind,) = [part for part in typing.get_args(kind) if part is not NoneType]
        origin, inner = typing.get_origin(kind), typing.get_args(kind)
        words = inner if origin is Literal else ()
        entry = inner[0] if origin is Named else NoneType
        kind = {Literal: str, Named: Named, Sequence: list}.get(origin or kind, kind)
        path = _below(getattr(cls, "path", "world"), name)  # functions build worlds
        settings.append(DeclaredSetting(name, path, kind, words, optional, default, rule, entry))
    return tuple(settings)


def _defaults(cls: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(cls, type):
        for attribute in fields(cls):
            make = attribute.default_factory
            yield attribute.name, attribute.default if make is MISSING else make()
    else:
        for name, argument in signature(cls).parameters.items():
            yield name, MISSING if argument.default is argument.empty else argument.default


def checked(function: Function, path: str = "world") -> Function:
    """Return a function that checks its declared arguments in each call; use as a decorator.

    Messages call the arguments `path.NAME`: `world.NAME`, because most such functions build worlds.
    """
    form = signature(function)
    function.path = path  # type: ignore[attr-defined]

    @wraps(function)
    def calls(*positional: Any, **named: Any) -> Any:
        try:
            arguments = form.bind(*positional, **named).arguments
        except TypeError as error:
            raise TypeError(f"{function.__name__}() {error}") from None
        arguments |= {
            setting.name: setting.checked(arguments[setting.name])
            for setting in declared(function)
            if setting.name in arguments
        }
        return function(**arguments)

    if "Args:" not in (text := function.__doc__ or ""):
        calls.__doc__ = _described(text, "Args", declared(function))
    return calls  # type: ignore[return-value]


checked_arguments = partial(checked, path="")  # for functions that do not build worlds


def all_of(cls: Any) -> Iterator[DeclaredSetting]:
    """Yield the settings of a class, each group followed by its own settings."""
    for setting in declared(cls):
        yield setting
        if setting.is_group:
            yield from all_of(setting.kind)


def not_a_setting(name: object, known: Iterable[str], group: str = "") -> str:
    """Return the end of a message about an unknown name, with the most similar known names."""
    names, sought = list(known), str(name).lower()
    # Longer names are similar by chance.
    near = difflib.get_close_matches(sought, names, 3, 0.7 if len(sought) < 9 else 0.75) or names
    of = f" of {group}" if group else ""
    if not near:
        return f"is not a setting{of}, which has none; leave it out."
    choice = _either(near) if len(near) <= 2 else f"one of {', '.join(near)}"
    return f"is not a setting{of}; choose {choice}."


def is_table(value: object) -> typing.TypeGuard[Mapping[str, Any]]:
    """Return whether a value is a mapping whose names are text."""
    return isinstance(value, Mapping) and all(isinstance(name, str) for name in value)


def table_of(path: str, values: Any) -> Mapping[str, Any]:
    """Return a table of settings, or pairs of a name and a value, as a table; else AntsError."""
    with suppress(TypeError, ValueError):
        if is_table(table := dict(values)):
            return table
    refuse(f"`{path}`", values, "a table of settings")


def flat(tree: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return nested mappings as settings by their full names, which begin with `before`."""
    named: dict[str, Any] = {}
    for name, value in tree.items():
        path = _below(before, name)
        named |= flat(value, path) if isinstance(value, Mapping) else {path: value}
    return named


def nested(named: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by full names as nested mappings, the form that `Settings.replace` takes."""
    tree: dict[str, Any] = {}
    for path, value in named.items():
        *outer, last = path.split(".")
        branch = tree
        for part in outer:
            inner = branch.setdefault(part, {})
            if not isinstance(inner, dict):
                inner = branch[part] = {"": inner}
            branch = inner
        if isinstance(branch.get(last), dict):
            branch[last][""] = value
        else:
            branch[last] = value
    return tree


def _below(path: str, name: object) -> str:
    return f"{path}.{name}" if path else str(name)


def _either(values: Iterable[str]) -> str:
    """Return values as "a", "a or b", or "a, b or c"."""
    *others, last = values
    return f"{', '.join(others)} or {last}" if others else last


def _plain(bound: float) -> str:
    """Return a bound as users write it, with all digits of a whole number: 1000000."""
    return str(bound) if isinstance(bound, int) else f"{bound:g}"
