"""From corrected samples to the published tilt: settings, the filters, sign and offset."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated

from ..configuration.filter_settings import DEFAULT_FILTER, DT_TOLERANCE
from ..errors import ConfigurationError
from ..estimator import FilterBank
from ..filters.base import Filter, filter_named, filters
from ..parameters.bounds import Bounds, require_bounds
from ..robot import Robot
from ..samples import RESTART_GAP, CorrectedSample, TiltEstimate

ALL = "all"
"""In `compare`: every filter there is."""


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """What a user chooses about the published tilt.

    Raises:
        ConfigurationError: an unknown filter, or a number out of bounds.
    """

    filter: str = DEFAULT_FILTER
    """Name of the filter whose estimate is published; can change between two samples."""
    compare: tuple[str, ...] = ()
    """Names of filters to run beside it on `tilt/compare`; `all` for every one."""
    tilt_sign: Annotated[
        float, Bounds(-1.0, 1.0, "", "1, or -1 for a controller that leans backward at plus")
    ] = 1.0
    tilt_offset: Annotated[
        float,
        Bounds(-math.pi, math.pi, "rad", "Tilt at the balance point, subtracted before the sign"),
    ] = 0.0
    predict: bool = False
    """Whether `tilt` is carried forward by the rate to the instant of publication."""
    prediction_limit: Annotated[
        float, Bounds(0.0, 1.0, "s", "Longest time `tilt` is carried forward")
    ] = 0.05
    tilt_stddev: Annotated[
        float,
        Bounds(1e-6, math.pi, "rad", "Standard deviation published for filters that estimate none"),
    ] = 0.03
    valid_stddev: Annotated[
        float,
        Bounds(1e-6, math.pi, "rad", "Above this standard deviation the tilt is not valid"),
    ] = 0.2
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
            return tuple(filters())
        return tuple(dict.fromkeys(name for name in self.compare if name))


@dataclass(frozen=True, slots=True)
class FilterConfiguration:
    """Everything the filters of one stream are made of."""

    settings: FilterSettings = field(default_factory=FilterSettings)
    parameters: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Parameter values by filter name; defaults for the others."""
    robot: Robot = field(default_factory=Robot)


class FilterStream:
    """The filters of a live stream, changed between two samples without losing one."""

    def __init__(self, configuration: FilterConfiguration) -> None:
        """Prepare the filters; they start at the first sample."""
        self._configuration = configuration
        self._elapsed, self._steps = 0.0, 0
        settings = configuration.settings
        self._bank = FilterBank(
            settings.filter, settings.compared(), configuration.parameters, configuration.robot
        )

    @property
    def settings(self) -> FilterSettings:
        """The settings in force."""
        return self._configuration.settings

    @property
    def uses_wheels(self) -> bool:
        """Whether a running filter reads the wheels itself."""
        return any(entry.uses_wheels for entry in self._running())

    @property
    def uses_motors(self) -> bool:
        """Whether a running filter reads the motors' voltage."""
        return any(entry.uses_motors for entry in self._running())

    def _running(self) -> Iterator[Filter]:
        return map(filter_named, (self._bank.active, *self._bank.compare))

    def configure(self, configuration: FilterConfiguration) -> None:
        """Go over to another configuration; the estimate goes on without a jump.

        Raises:
            ConfigurationError: a value out of bounds; nothing changed.
        """
        before, bank = self._configuration, self._bank
        settings = configuration.settings
        for name, values in configuration.parameters.items():
            if values != before.parameters.get(name):
                bank.configure(name, values)
        if configuration.robot != before.robot:
            bank.use_robot(configuration.robot)
        bank.switch(settings.filter)
        if settings.compared() != bank.compare:
            bank.run_beside(settings.compared())
        self._configuration = configuration

    def step(self, sample: CorrectedSample) -> TiltEstimate:
        """Feed the chosen filter and return its estimate; `compare` comes after."""
        if 0.0 < sample.dt <= RESTART_GAP:
            self._elapsed += sample.dt
            self._steps += 1
        return self._bank.step_active(sample)

    def compare(self, sample: CorrectedSample) -> dict[str, TiltEstimate]:
        """Feed the filters that run beside and return their estimates by name."""
        self._bank.step_beside(sample)
        return self._bank.compared()

    def reset(self) -> None:
        """Let every filter start afresh at the next sample, without its gyro bias."""
        self._bank.reset()

    def published_tilt(self, estimate: TiltEstimate, age: float = 0.0) -> float:
        """Return the tilt for a controller [rad]: predicted, from the balance point, signed.

        Args:
            estimate: The chosen filter's.
            age: Time since the stamp of its sample [s]; used only where `predict` is on.
        """
        settings = self._configuration.settings
        tilt = estimate.tilt
        if settings.predict:
            tilt += estimate.rate * min(max(age, 0.0), settings.prediction_limit)
        return settings.tilt_sign * (tilt - settings.tilt_offset)

    def variance(self, estimate: TiltEstimate) -> float:
        """Return the variance of the tilt to publish [rad^2]; never zero."""
        return estimate.tilt_variance or self._configuration.settings.tilt_stddev**2

    def trusted(self, estimate: TiltEstimate) -> bool:
        """Return whether the filter's own variance lets the estimate count as valid."""
        return estimate.tilt_variance <= self._configuration.settings.valid_stddev**2

    def period(self) -> float:
        """Return the mean sampling period since the last call [s]; 0 without samples."""
        mean = self._elapsed / self._steps if self._steps else 0.0
        self._elapsed, self._steps = 0.0, 0
        return mean

    def warnings(self, dt: float) -> tuple[str, ...]:
        """Return what a user should know about the settings at this sampling period [s]."""
        if dt <= 0.0:
            return ()
        found = self._bank.warnings(dt)
        tuned = self._configuration.settings.settings_dt
        if tuned > 0.0 and abs(dt - tuned) > DT_TOLERANCE * tuned:
            found += (f"the settings were tuned at dt {tuned:g} s, the samples come at {dt:.4g} s",)
        return found
