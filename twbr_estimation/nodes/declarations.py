"""Declarations of ROS parameters, derived from settings dataclasses and filter specs.

Nothing is declared twice: names, defaults, limits, units and descriptions come from the
annotations of the dataclass, or from the filter.
"""

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, get_args, get_origin

from ..errors import ConfigurationError
from ..filters.base import Filter
from ..parameters.bounds import Bounds, Meaning, annotations_of, hints_of

if TYPE_CHECKING:  # nodes that filter start without the controllers
    from ..controllers.base import Controller

Settings = TypeVar("Settings")


class Declaration(NamedTuple):
    """One ROS parameter."""

    name: str
    """Full name with dots, as in `kalman.q1`."""
    default: Any
    """bool, int, float, str, or a tuple of float or str."""
    description: str
    """Meaning and unit."""
    bounds: Bounds | None = None
    choices: tuple[str, ...] = ()
    """The strings allowed; any where empty."""
    read_only: bool = False
    strings: bool = False
    """True for an array of strings; an empty default does not show its type."""
    length: int | None = None
    """Number of an array's elements; None where it may be any."""


def declarations_of(
    defaults: Any, prefix: str = "", read_only: bool = False, only: tuple[str, ...] | None = None
) -> tuple[Declaration, ...]:
    """Return the parameters of a settings dataclass, nested ones with dotted names.

    Args:
        defaults: Instance that holds the defaults.
        prefix: Put before each name, such as `"robot."`.
        read_only: Whether the parameters can only be set at the start.
        only: Names of the fields to declare; all by default.
    """
    found: list[Declaration] = []
    kind: Any = type(defaults)
    annotations, hints = annotations_of(kind), hints_of(kind)
    for entry in fields(defaults):
        if only is not None and entry.name not in only:
            continue
        value, name = getattr(defaults, entry.name), prefix + entry.name
        if is_dataclass(value):
            found.extend(declarations_of(value, f"{name}.", read_only))
            continue
        about = annotations[entry.name]
        limits = about if isinstance(about, Bounds) else None
        choices = tuple(str(each.value) for each in type(value)) if isinstance(value, Enum) else ()
        default = value.value if isinstance(value, Enum) else value
        strings = str in get_args(hints[entry.name])
        length = _length_of(hints[entry.name])
        text = _described(about)
        found.append(Declaration(name, default, text, limits, choices, read_only, strings, length))
    return tuple(found)


def _length_of(hint: Any) -> int | None:
    """Return how many elements a field's tuple has; None for any number, or for no tuple."""
    elements = get_args(hint)
    return len(elements) if get_origin(hint) is tuple and Ellipsis not in elements else None


def with_choices(
    declarations: Iterable[Declaration], name: str, choices: Iterable[str]
) -> tuple[Declaration, ...]:
    """Return the declarations, the one of that name with the strings that it may be."""
    allowed = tuple(choices)
    return tuple(
        each._replace(choices=allowed) if each.name == name else each for each in declarations
    )


def named_declarations_of(entry: "Filter | Controller") -> tuple[Declaration, ...]:
    """Return the parameters of a filter or controller, named `NAME.PARAMETER`."""
    return tuple(
        Declaration(f"{entry.name}.{each.name}", each.default, _described(each.bounds), each.bounds)
        for each in entry.declared()
        if not each.bounds.historical
    )


def settings_from(former: Settings, values: Mapping[str, Any], prefix: str = "") -> Settings:
    """Return a settings dataclass with the values given; the inverse of `declarations_of`.

    A nested dataclass of which `values` has nothing stays the same object, unchecked.

    Args:
        former: Instance whose fields are kept where `values` has nothing.
        values: ROS parameter values by full name; names of others are ignored.
        prefix: As given to `declarations_of`.

    Raises:
        ConfigurationError: a value the settings refuse.
    """
    kind: Any = type(former)
    known = _field_names(kind)
    changes: dict[str, Any] = {}
    for full_name, value in values.items():
        if not full_name.startswith(prefix):
            continue
        name, nested, _ = full_name[len(prefix) :].partition(".")
        if name not in known or name in changes:
            continue
        kept = getattr(former, name)
        changes[name] = (
            settings_from(kept, values, f"{prefix}{name}.")
            if nested
            else _converted(full_name, value, kept)
        )
    return replace(former, **changes) if changes else former  # type: ignore[type-var]


@cache
def _field_names(kind: Any) -> frozenset[str]:
    return frozenset(entry.name for entry in fields(kind))


def parameters_from(
    entries: "Mapping[str, Filter] | Mapping[str, Controller]",
    former: Mapping[str, Mapping[str, float]],
    values: Mapping[str, Any],
) -> Mapping[str, Mapping[str, float]]:
    """Return the parameters of filters or controllers with the values given.

    Those of which `values` has nothing stay the same object, unchecked.

    Args:
        entries: Definitions by name.
        former: Parameter values by name of the definition.
        values: ROS parameter values by full name; names of others are ignored.

    Raises:
        ConfigurationError: a value outside its bounds.
    """
    given: dict[str, dict[str, float]] = {}
    for full_name, value in values.items():
        owner, _, name = full_name.partition(".")
        if owner in entries:
            given.setdefault(owner, {})[name] = value
    changed = {
        owner: entries[owner].configure({**former.get(owner, {}), **each})._asdict()
        for owner, each in given.items()
    }
    return {**former, **changed} if changed else former


def _converted(name: str, value: Any, default: Any) -> Any:
    if isinstance(default, Enum):
        choices = [str(each.value) for each in type(default)]
        if value not in choices:
            raise ConfigurationError(f"{name}: {value!r} is not one of {', '.join(choices)}")
        return type(default)(value)
    return tuple(value) if isinstance(default, tuple) else value


def _described(about: Bounds | Meaning) -> str:
    unit = about.unit if isinstance(about, Bounds) else ""
    return f"{about.description} [{unit}]" if unit else about.description
