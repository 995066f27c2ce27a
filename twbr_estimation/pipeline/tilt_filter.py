"""One filter on a live stream: its parameters, its state, and where it starts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..filters.base import Filter, estimate_of
from ..robot import Robot
from ..samples import RESTART_GAP, CorrectedSample, TiltEstimate


class TiltFilter:
    """One filter with its parameters and its state."""

    def __init__(
        self,
        entry: Filter,
        values: Mapping[str, float] | None = None,
        robot: Robot | None = None,
        state: Any | None = None,
    ) -> None:
        """Prepare `entry` with the given parameter values.

        Args:
            entry: the filter.
            values: parameter values; defaults for the others.
            robot: geometry, for filters that need it.
            state: where an earlier run ended; None starts at the first sample.

        Raises:
            ConfigurationError: a parameter is unknown or out of bounds.
        """
        self.entry = entry
        self._robot = robot or Robot()
        self.parameters = entry.configure(values)
        self._coefficients = entry.derive(self.parameters, self._robot)
        self.state = state
        """State of the filter; None before the first sample."""

    @property
    def estimate(self) -> TiltEstimate | None:
        """The latest estimate; None before the first sample."""
        return None if self.state is None else estimate_of(self.state)

    @property
    def name(self) -> str:
        """Name of the filter."""
        return self.entry.name

    def step(self, sample: CorrectedSample) -> TiltEstimate:
        """Take one sample; return the estimate at its stamp.

        The first sample, or one after a gap above `RESTART_GAP`, starts the filter afresh.
        """
        state = self.state
        if state is None:
            self.reset(TiltEstimate(sample.angle, sample.gyro_y), sample)
        elif sample.dt > RESTART_GAP:
            bias = getattr(state, "gyro_bias", 0.0)
            self.reset(TiltEstimate(sample.angle, sample.gyro_y - bias, bias), sample)
        else:
            self.state = self.entry.step(state, sample, self._coefficients)
        return estimate_of(self.state)

    def reset(self, estimate: TiltEstimate, sample: CorrectedSample) -> TiltEstimate:
        """Go on from `estimate`, which holds at the stamp of `sample`."""
        self.state = self.entry.reset(estimate, sample, self._coefficients)
        return estimate_of(self.state)

    def configure(self, values: Mapping[str, float]) -> None:
        """Use other parameters from the next sample on; the state stays.

        Raises:
            ConfigurationError: a parameter is unknown or out of bounds; nothing changed.
        """
        self.use_parameters(self.entry.configure(values))

    def use_parameters(self, parameters: Any) -> None:
        """Use other parameters, which `entry.configure` has made, from the next sample on."""
        self.parameters = parameters
        self._coefficients = self.entry.derive(parameters, self._robot)

    def use_robot(self, robot: Robot) -> None:
        """Use another geometry from the next sample on; the state stays."""
        self._robot = robot
        self._coefficients = self.entry.derive(self.parameters, robot)

    def forget(self) -> None:
        """Start afresh at the next sample."""
        self.state = None
