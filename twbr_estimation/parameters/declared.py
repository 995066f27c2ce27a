"""Parameters that a filter or a controller declares, and the folders both are found in."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, NamedTuple, TypeVar

from ..errors import ConfigurationError
from .argument_checks import require_kind, shown
from .bounds import Bounds, annotations_of, within


class Parameter(NamedTuple):
    """One declared parameter."""

    name: str
    default: float
    bounds: Bounds


@dataclass(frozen=True, slots=True, eq=False)
class Definition:
    """Common part of filters and controllers."""

    name: str
    """Name in the registry, in `filter` or `controller`, and before parameters (`kalman.q1`)."""
    title: str
    """One sentence for tables."""
    source: str
    """Paper and equations."""
    parameters: type[Any]
    """Named tuple whose fields are `Annotated[float, Bounds(...)]` with defaults."""
    historical: bool = field(default=False, kw_only=True)
    """True for what is there by name, for reproductions, and not listed among the choices."""

    def declared(self) -> tuple[Parameter, ...]:
        """Return the declared parameters in order."""
        kind: Any = self.parameters
        return declared(kind)

    def __post_init__(self) -> None:
        for name in ("name", "title", "source"):
            require_kind(name, getattr(self, name), str, "a text")
        if not self.name.isidentifier():
            raise ConfigurationError(
                f"`name`: {shown(self.name)} is not of letters, digits and _ only"
            )
        require_record("parameters", self.parameters)

    def configure(self, values: Mapping[str, float] | None = None) -> Any:
        """Return validated parameters, the defaults replaced by `values`.

        Raises:
            ConfigurationError: unknown name, not a finite number, or outside its bounds.
        """
        owner = f"{type(self).__name__.lower()} {self.name}"
        return configured(owner, self.parameters, {} if values is None else values)


def require_record(argument: str, value: object, *names: str) -> None:
    """Raise where an argument is no named tuple, or lacks a field.

    Raises:
        ConfigurationError: the message names the argument and the field.
    """
    known = getattr(value, "_fields", None)
    if not isinstance(value, type) or not isinstance(known, tuple):
        raise ConfigurationError(f"`{argument}`: {shown(value)} is no NamedTuple class")
    for name in names:
        if name not in known:
            raise ConfigurationError(f"`{argument}`: {value.__qualname__} has no field {name!r}")


Defined = TypeVar("Defined", bound=Definition)


def listed(entries: Mapping[str, Defined]) -> dict[str, Defined]:
    """Return the entries that are not historical."""
    return {name: entry for name, entry in entries.items() if not entry.historical}


def named(entries: Mapping[str, Defined], name: str, kind: str) -> Defined:
    """Return the entry of that name.

    Raises:
        ConfigurationError: there is none; the message lists those there are.
    """
    if not isinstance(name, str) or name not in entries:
        raise ConfigurationError(
            f"there is no {kind} {shown(name)}; there are: {', '.join(entries)}"
        )
    return entries[name]


@cache
def declared(kind: Any) -> tuple[Parameter, ...]:
    """Return the parameters of a named tuple of `Annotated[float, Bounds(...)]`, in order.

    Raises:
        ConfigurationError: a field without bounds, or without a default within them.
    """
    bounds, defaults = annotations_of(kind), kind._field_defaults
    found = []
    for name in kind._fields:
        limits = bounds.get(name)
        if name not in defaults or not isinstance(limits, Bounds):
            raise ConfigurationError(
                f"`parameters`: {kind.__qualname__}.{name} needs the form "
                "`Annotated[float, Bounds(...)] = default`"
            )
        found.append(Parameter(name, within(name, defaults[name], limits), limits))
    return tuple(found)


def configured(owner: str, kind: Any, values: Mapping[str, float]) -> Any:
    """Return validated parameters, the defaults replaced by `values`.

    Args:
        owner: what they belong to and its name, for messages: `filter kalman`.
        kind: the named tuple that declares them.
        values: by name.

    Raises:
        ConfigurationError: unknown name, not a finite number, or outside its bounds.
    """
    require_kind("values", values, Mapping, f"a mapping of the parameters of {owner} to numbers")
    known = {parameter.name: parameter for parameter in declared(kind)}
    for name in values:
        if name not in known:
            raise ConfigurationError(
                f"{owner} has no parameter {shown(name)}; it has: {', '.join(known) or 'none'}"
            )
    checked = {name: parameter.default for name, parameter in known.items()}
    prefix = owner.rpartition(" ")[2]
    for name, value in values.items():
        checked[name] = within(f"{prefix}.{name}", value, known[name].bounds)
    return kind(**checked)


def alone(package: str, attribute: str, name: str) -> Any | None:
    """Return `attribute` of the file of `package` that has this name, without the other files.

    None where there is no such file, or what it defines has another name.
    """
    if not isinstance(name, str) or not name.isidentifier():
        return None
    module = sys.modules.get(f"{package}.{name}")
    if module is None:
        places = import_module(package).__path__
        if not any(Path(place, f"{name}.py").is_file() for place in places):
            return None
        module = import_module(f"{package}.{name}")
    found = getattr(module, attribute, None)
    return found if getattr(found, "name", None) == name else None


def collected(package: str, attribute: str) -> dict[str, Any]:
    """Return `attribute` of every module of `package` that has it, by its own `name`, sorted."""
    path = import_module(package).__path__
    modules = (import_module(f"{package}.{entry.name}") for entry in iter_modules(path))
    found = (getattr(module, attribute) for module in modules if hasattr(module, attribute))
    return {entry.name: entry for entry in sorted(found, key=lambda entry: str(entry.name))}
