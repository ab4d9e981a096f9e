"""Settings, declared once.

A class of settings is a frozen dataclass whose fields carry range, unit, condition and help as
`Annotated[type, Is(...)]`. Checks, keys of sweep files, command-line options, controls of pages and
the tables of the documentation are all made from these declarations.

    @dataclass(frozen=True)
    class Pheromone(Settings, path="task.pheromone"):
        evaporation: Annotated[Literal["linear", "exponential"], Is("how ...")] = "linear"
        half_life: Annotated[
            float | None,
            Is("time in which a trail halves", unit="ticks", above=0, usual=50.0,
               only=("evaporation", "exponential")),
        ] = None

    >>> Pheromone("exponential", half_life=0)
    AntsError: `task.pheromone.half_life` is 0; it must be above 0.

Nothing here needs NumPy, so that command lines show their help quickly.
"""

from __future__ import annotations

import difflib
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from numbers import Real
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    NamedTuple,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from taichi_ants.errors import AntsError, is_flag, shown

Self = TypeVar("Self", bound="Settings")


@dataclass(frozen=True)
class Is:
    """What holds for a setting besides its type.

    Several of them in one annotation add up: `Ticks = Annotated[int, Is(unit="ticks", least=1)]`.

    Attributes:
        help: A phrase or sentence that says what the setting does.
        unit: Of the number, such as "ticks".
        least, most: Bounds that are allowed themselves.
        above: A bound that is not.
        only: The name of another setting of the class, and the values of it with which this one
            means something; with others it has its default.
        usual: The value it takes where it means something and is None.
        choices: Return the words that are allowed, for those that can be registered.
    """

    help: str = ""
    unit: str = ""
    least: float | None = None
    most: float | None = None
    above: float | None = None
    only: tuple[Any, ...] | None = None
    usual: Any = None
    choices: Callable[[], tuple[str, ...]] | None = None

    def but(self, other: Is) -> Is:
        """Both, of which `other` counts where it says something."""
        given = {one.name: getattr(other, one.name) for one in fields(other)}
        usual = vars(Is())
        return replace(self, **{k: v for k, v in given.items() if v is not usual[k] and v != ""})


class Setting(NamedTuple):
    """One setting as it was declared.

    Attributes:
        name: Of the field.
        path: The full name, as sweep files have it, such as "task.pheromone.half_life".
        kind: bool, int, float, str, or a class of settings.
        words: The words that are allowed, where they are fixed.
        optional: Whether it may be None.
        default: As in the class; MISSING if it has none.
        rule: All that was said of it.
    """

    name: str
    path: str
    kind: type
    words: tuple[str, ...]
    optional: bool
    default: Any
    rule: Is

    @property
    def is_group(self) -> bool:
        """Whether it is a class of settings itself."""
        return issubclass(self.kind, Settings)

    @property
    def has_names(self) -> bool:
        """Whether it is a class of settings of which some values have names."""
        return self.is_group and bool(self.kind.named())  # type: ignore[attr-defined]

    @property
    def allowed(self) -> str:
        """The values that are allowed, as messages and tables name them."""
        return self._kind_in_words + (f" {self._range}" if self._range else "")

    def checked(self, value: Any) -> Any:
        """A value as a Python object of the setting's kind.

        Raises:
            AntsError: The value is not allowed; names the setting by its path.
        """
        if value is None and self.optional:
            return None
        found = self._converted(value)
        if found is None:
            self._refuse(value, self.allowed)
        if self.kind in (int, float) and not self._in_range(found):
            self._refuse(value, self._range)
        return found

    def _converted(self, value: Any) -> Any:
        """The value as one of the kind; None if it is of another one."""
        flag = is_flag(value)
        if self.kind is bool:
            return bool(value) if flag else None
        if self.kind is int:
            try:
                return None if flag else operator.index(value)
            except TypeError:
                return None
        if self.kind is float:
            if flag or not isinstance(value, Real):
                return None
            try:
                return float(value) if math.isfinite(value) else None
            except OverflowError:  # an integer beyond all floats
                return None
        if self.kind is str:
            allowed = self._all_words
            fits = isinstance(value, str) and (not allowed or value in allowed)
            return value if fits else None
        if issubclass(self.kind, Settings) and isinstance(value, str):
            value = self.kind.named().get(value)
        return value if isinstance(value, self.kind) else None

    def _in_range(self, value: float) -> bool:
        rule = self.rule
        return (
            (rule.least is None or value >= rule.least)
            and (rule.most is None or value <= rule.most)
            and (rule.above is None or value > rule.above)
        )

    def _refuse(self, value: Any, allowed: str) -> None:
        or_none = ", or None" if self.optional and self.rule.only is None else ""
        raise AntsError(f"`{self.path}` is {shown(value)}; it must be {allowed}{or_none}.")

    @property
    def _all_words(self) -> tuple[str, ...]:
        return self.rule.choices() if self.rule.choices else self.words

    @property
    def _kind_in_words(self) -> str:
        if self.kind is str:
            return f"one of {', '.join(self._all_words)}" if self._all_words else "text"
        if self.is_group:
            words = ", ".join(self.kind.named())  # type: ignore[attr-defined]
            return f"a {self.kind.__name__}" + (f", or one of {words}" if words else "")
        return {bool: "True or False", int: "a whole number", float: "a number"}[self.kind]

    @property
    def _range(self) -> str:
        rule = self.rule
        if rule.above is not None:
            upper = "" if rule.most is None else f" and at most {_plain(rule.most)}"
            return f"above {_plain(rule.above)}{upper}"
        if rule.least is not None and rule.most is not None:
            return f"between {_plain(rule.least)} and {_plain(rule.most)}"
        if rule.least is not None:
            return f"at least {_plain(rule.least)}"
        return "" if rule.most is None else f"at most {_plain(rule.most)}"


class Settings:
    """Base of the classes of settings, which are frozen dataclasses.

    `path` is the full name of the settings, as in sweep files; messages name a setting by it.
    A class whose common values have names returns them from `named`; a name is then taken for the
    value wherever the class is a setting of another one.
    """

    path: ClassVar[str] = ""

    def __init_subclass__(cls, path: str = "", **more: Any) -> None:
        super().__init_subclass__(**more)
        cls.path = path or cls.path

    def __post_init__(self) -> None:
        self.check()

    @classmethod
    def named(cls) -> Mapping[str, Any]:
        """The values of this class that have names."""
        return {}

    def check(self) -> None:
        """Take each value as one of its kind.

        Raises:
            AntsError: A value is not allowed, or would change nothing.
        """
        for one in declared(type(self)):
            object.__setattr__(self, one.name, one.checked(getattr(self, one.name)))
        for one in declared(type(self)):
            if one.rule.only is not None:
                self._settle(one)

    def _settle(self, one: Setting) -> None:
        """Refuse a setting that would change nothing; give it its usual value where it counts."""
        assert one.rule.only is not None
        other, *values = one.rule.only
        value = getattr(self, one.name)
        if getattr(self, other) in values:
            if value is None and one.rule.usual is not None:
                object.__setattr__(self, one.name, one.rule.usual)
        elif value != one.default:
            raise AntsError(
                f"`{one.path}` is {shown(value)}; leave it out unless `{other}` is "
                f"{' or '.join(map(repr, values))}."
            )

    def but(self: Self, **changes: Any) -> Self:
        """The same with some changes; settings that mean nothing any more have their defaults.

        Raises:
            AntsError: As for the class.
        """
        after = {one.name: getattr(self, one.name) for one in declared(type(self))} | changes
        for one in declared(type(self)):
            if one.rule.only and one.name not in changes:
                other, *values = one.rule.only
                if after[other] not in values:
                    changes[one.name] = one.default
        return replace(self, **changes)  # type: ignore[type-var]

    @classmethod
    def from_dict(cls: type[Self], facts: Any) -> Self:
        """The settings of a mapping of names to values, with groups as mappings or names.

        Raises:
            AntsError: A value is not allowed, or there is no such setting.
        """
        if not isinstance(facts, Mapping):
            raise AntsError(f"`{cls.path}` is {shown(facts)}; it must be a table of settings.")
        known = {one.name: one for one in declared(cls)}
        given = {}
        for name, value in facts.items():
            if name not in known:
                raise AntsError(
                    f"`{_below(cls.path, name)}` is not a setting; {rather(name, known)}."
                )
            one = known[name]
            if one.is_group and isinstance(value, Mapping):
                value = one.kind.from_dict(value)  # type: ignore[attr-defined]
            given[name] = value
        return cls(**given)


_DECLARED: dict[type, tuple[Setting, ...]] = {}


def declared(cls: type) -> tuple[Setting, ...]:
    """The settings of a class, in the order of its fields; other fields are left out."""
    if cls not in _DECLARED:
        _DECLARED[cls] = tuple(_read(cls))
    return _DECLARED[cls]


def _read(cls: type) -> Iterator[Setting]:
    hints = get_type_hints(cls, include_extras=True)
    path = getattr(cls, "path", "")
    for one in fields(cls):
        hint = hints[one.name]
        if get_origin(hint) is not Annotated:
            continue
        kind, *rules = get_args(hint)
        rule = Is()
        for more in rules:
            rule = rule.but(more)
        default = one.default if one.default_factory is MISSING else one.default_factory()
        kind, words, optional = _kind_of(kind)
        yield Setting(one.name, _below(path, one.name), kind, words, optional, default, rule)


def setting(cls: type, name: str) -> Setting:
    """One setting of a class, for arguments of functions that are the same."""
    return next(one for one in declared(cls) if one.name == name)


def all_of(cls: type) -> Iterator[Setting]:
    """The settings of a class and of its groups, those of a group behind it."""
    for one in declared(cls):
        yield one
        if one.is_group:
            yield from all_of(one.kind)


def table(cls: type) -> str:
    """The settings of a class as a table in Markdown, for the documentation."""
    rows = ["| Setting | Values | Default | Meaning |", "|---|---|---|---|"]
    for one in all_of(cls):
        if not one.is_group:
            unit = f" {one.rule.unit}" if one.rule.unit else ""
            rows.append(
                f"| `{one.path}` | {one.allowed}{unit} | {_default(one)} | {_meaning(one)} |"
            )
    return "\n".join(rows)


def _default(one: Setting) -> str:
    if one.default is MISSING:
        return "none"
    if one.rule.usual is not None:
        return f"`{one.rule.usual!r}`"
    return f"`{one.default!r}`"


def _meaning(one: Setting) -> str:
    if one.rule.only is None:
        return one.rule.help
    other, *values = one.rule.only
    return f"{one.rule.help}; only with `{other}` {' or '.join(map(repr, values))}"


def rather(name: object, known: Any) -> str:
    """What to write instead of a name that does not exist."""
    near = difflib.get_close_matches(str(name), list(known), 3) or list(known)
    return (
        f"choose {' or '.join(near[-2:])}" if len(near) <= 2 else f"choose among {', '.join(near)}"
    )


def _kind_of(hint: Any) -> tuple[type, tuple[str, ...], bool]:
    """The kind, its words, and whether it may be None."""
    optional = False
    if get_origin(hint) in (Union, UnionType):
        (hint,) = [one for one in get_args(hint) if one is not NoneType]
        optional = True
    if get_origin(hint) is Literal:
        return str, get_args(hint), optional
    return hint, (), optional


def _below(path: str, name: object) -> str:
    return f"{path}.{name}" if path else str(name)


def _plain(bound: float) -> str:
    """A bound as people write it: 1 000 000."""
    if isinstance(bound, int) and abs(bound) >= 10_000:
        return f"{bound:_}".replace("_", " ")
    return f"{bound:g}"
