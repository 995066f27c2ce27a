"""Settings of the published tilt and everything the filters of one stream are made of."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Annotated

from ..configuration.filter_settings import DEFAULT_FILTER, Settings
from ..errors import ConfigurationError
from ..filters.base import filter_named, listed_filters
from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..pipeline.validity import VALID_STDDEV
from ..robot import Robot

ALL = "all"
"""In `compare`: every filter there is."""


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """User settings of the published tilt.

    Raises:
        ConfigurationError: an unknown filter, or a number out of bounds.
    """

    filter: Annotated[
        str,
        Meaning("Name of the filter whose estimate is published; can change between two samples."),
    ] = DEFAULT_FILTER
    compare: Annotated[
        tuple[str, ...],
        Meaning("Names of filters to run beside it on `tilt/compare`; `all` for every one."),
    ] = ()
    tilt_sign: Annotated[
        float, Bounds(-1.0, 1.0, "", "1, or -1 for a controller that leans backward at plus")
    ] = 1.0
    tilt_offset: Annotated[
        float,
        Bounds(-math.pi, math.pi, "rad", "Tilt at the balance point, subtracted before the sign"),
    ] = 0.0
    predict: Annotated[
        bool,
        Meaning("Whether `tilt` is carried forward by the rate to the instant of publication."),
    ] = False
    prediction_limit: Annotated[
        float, Bounds(0.0, 1.0, "s", "Longest time `tilt` is carried forward")
    ] = 0.05
    tilt_stddev: Annotated[
        float,
        Bounds(1e-6, math.pi, "rad", "Standard deviation published for filters that estimate none"),
    ] = 0.03
    valid_stddev: Annotated[
        float,
        Bounds(
            1e-6,
            math.pi,
            "rad",
            "Above this standard deviation the tilt is not valid, nor for more than 1 s above "
            "0.3 of it (0.06 rad at least); a new or lost tilt, or one far from upright, needs a "
            "smaller one",
        ),
    ] = VALID_STDDEV
    settings_dt: Annotated[
        float, Bounds(0.0, 10.0, "s", "Sampling period the filters were tuned at; 0 if unknown")
    ] = 0.0

    def __post_init__(self) -> None:
        require_bounds(self)
        if abs(self.tilt_sign) != 1.0:
            raise ConfigurationError(f"tilt_sign: {self.tilt_sign} is neither 1 nor -1")
        filter_named(self.filter)
        for name in self.compared():
            filter_named(name)

    def compared(self) -> tuple[str, ...]:
        """Return the names of the filters to run beside, without repetition."""
        if ALL in self.compare:
            return tuple(listed_filters())
        return tuple(dict.fromkeys(name for name in self.compare if name))


@cache
def _defaults(name: str) -> dict[str, float]:
    """Return the default parameters of a filter by name."""
    found: dict[str, float] = filter_named(name).configure()._asdict()
    return found


@dataclass(frozen=True, slots=True)
class FilterConfiguration:
    """Everything the filters of one stream are made of."""

    settings: FilterSettings = field(default_factory=FilterSettings)
    parameters: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Parameter values by filter name; defaults for the others."""
    robot: Robot = field(default_factory=Robot)

    def tuned(self) -> Settings:
        """Return the values that are not the filters' defaults, as a settings file has them."""
        values = {
            name: given
            for name, given in self.parameters.items()
            if {**_defaults(name), **given} != _defaults(name)
        }
        return Settings(values, dt=self.settings.settings_dt, source="the parameters")
