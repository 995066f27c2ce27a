"""The parameters of all filters, the choice among them and the robot, as one whole."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from rclpy.node import Node

from ..filters.base import listed_filters
from ..robot import Setup
from ..streams.filter_configuration import FilterConfiguration, FilterSettings
from .declarations import (
    declarations_of,
    named_declarations_of,
    parameters_from,
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
    start = FilterNodeConfiguration(FilterConfiguration(), Setup())
    return NodeParameters(node, declared, start, _configuration, apply)


def _configuration(
    former: FilterNodeConfiguration, values: Mapping[str, Any]
) -> FilterNodeConfiguration:
    filters, setup = former.filters, settings_from(former.setup, values)
    return FilterNodeConfiguration(
        FilterConfiguration(
            settings_from(filters.settings, values),
            parameters_from(listed_filters(), filters.parameters, values),
            setup.robot,
        ),
        setup,
    )
