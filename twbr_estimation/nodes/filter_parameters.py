"""The parameters of all filters, the choice among them and the robot, as one whole."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from rclpy.node import Node

from ..filters.base import Filter, listed_filters
from ..robot import Setup
from ..streams.filter_configuration import FilterConfiguration, FilterSettings
from .declarations import (
    declarations_of,
    declared_values_from,
    named_declarations_of,
    settings_from,
    with_choices,
)
from .parameters import NodeParameters


class FilterNodeConfiguration(NamedTuple):
    """Values of the parameters of a filter node."""

    filters: FilterConfiguration
    setup: Setup
    """For an input that is not corrected yet."""


def declare_filter_parameters(
    node: Node, apply: Callable[[FilterNodeConfiguration], None]
) -> NodeParameters[FilterNodeConfiguration]:
    """Declare them; `apply` takes over each accepted change.

    Raises:
        ConfigurationError: an initial value that is refused.
    """
    settings = with_choices(declarations_of(FilterSettings()), "filter", listed_filters())
    declared = [*settings, *declarations_of(Setup())]
    for entry in listed_filters().values():
        declared.extend(named_declarations_of(entry))
    return NodeParameters(node, declared, _Builder(), apply)


class _Builder:
    """Turns values into a configuration; what has not changed since the last is not built again."""

    def __init__(self) -> None:
        self._names = {
            name: [f"{name}.{each.name}" for each in entry.declared()]
            for name, entry in listed_filters().items()
        }
        self._given: dict[str, list[Any]] = {}
        self._built: dict[str, Mapping[str, float]] = {}

    def __call__(self, values: Mapping[str, Any]) -> FilterNodeConfiguration:
        setup = settings_from(Setup(), values)
        parameters = {name: self._of(entry, values) for name, entry in listed_filters().items()}
        settings = settings_from(FilterSettings(), values)
        return FilterNodeConfiguration(
            FilterConfiguration(settings, parameters, setup.robot), setup
        )

    def _of(self, entry: Filter, values: Mapping[str, Any]) -> Mapping[str, float]:
        given = [values.get(name) for name in self._names[entry.name]]
        if given != self._given.get(entry.name):
            self._built[entry.name] = declared_values_from(entry, values)._asdict()
            self._given[entry.name] = given
        return self._built[entry.name]
