"""Filters on a live stream: one that speaks, others beside it, switched without a jump."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from .filters.base import Filter, estimate_of, filter_named
from .robot import Robot
from .samples import RESTART_GAP, CorrectedSample, TiltEstimate


class TiltFilter:
    """One filter with its parameters and its state."""

    def __init__(
        self, entry: Filter, values: Mapping[str, float] | None = None, robot: Robot | None = None
    ) -> None:
        """Prepare `entry` with the given parameter values; it starts at the first sample.

        Raises:
            ConfigurationError: a parameter is unknown or out of bounds.
        """
        self.entry = entry
        self._robot = robot or Robot()
        self.parameters = entry.configure(values)
        self._coefficients = entry.derive(self.parameters, self._robot)
        self._state: Any | None = None

    @property
    def estimate(self) -> TiltEstimate | None:
        """The latest estimate; None before the first sample."""
        return None if self._state is None else estimate_of(self._state)

    def step(self, sample: CorrectedSample) -> TiltEstimate:
        """Take one sample and return the estimate at its stamp."""
        self.advance(sample)
        return estimate_of(self._state)

    def advance(self, sample: CorrectedSample) -> None:
        """Take one sample; the first one, or one after a long gap, starts afresh."""
        state = self._state
        if state is None:
            self.reset(TiltEstimate(sample.angle, sample.gyro_y), sample)
        elif sample.dt > RESTART_GAP:
            bias = getattr(state, "gyro_bias", 0.0)
            self.reset(TiltEstimate(sample.angle, sample.gyro_y - bias, bias), sample)
        else:
            self._state = self.entry.step(state, sample, self._coefficients)

    def reset(self, estimate: TiltEstimate, sample: CorrectedSample) -> TiltEstimate:
        """Go on from `estimate`, which holds at the stamp of `sample`."""
        self._state = self.entry.reset(estimate, sample, self._coefficients)
        return estimate_of(self._state)

    def configure(self, values: Mapping[str, float]) -> None:
        """Use other parameters from the next sample on; the state stays.

        Raises:
            ConfigurationError: a parameter is unknown or out of bounds; nothing changed.
        """
        self.parameters = self.entry.configure(values)
        self._coefficients = self.entry.derive(self.parameters, self._robot)

    def use_robot(self, robot: Robot) -> None:
        """Use another geometry from the next sample on; the state stays."""
        self._robot = robot
        self._coefficients = self.entry.derive(self.parameters, robot)

    def forget(self) -> None:
        """Start afresh at the next sample."""
        self._state = None


class FilterBank:
    """The filter whose estimate counts, and any number of others on the same samples."""

    def __init__(
        self,
        name: str,
        compare: Iterable[str] = (),
        values: Mapping[str, Mapping[str, float]] | None = None,
        robot: Robot | None = None,
    ) -> None:
        """Prepare filter `name`, and those of `compare` beside it.

        Args:
            name: the filter whose estimate `step` returns.
            compare: names of filters to run beside it.
            values: parameter values by filter name; defaults for the others.
            robot: geometry, for filters that need it.

        Raises:
            ConfigurationError: an unknown filter or parameter, or a value out of bounds.
        """
        self._values = {key: dict(value) for key, value in (values or {}).items()}
        self._robot = robot or Robot()
        self._sample: CorrectedSample | None = None
        self._active = self._prepare(name)
        self._beside = {entry: self._prepare(entry) for entry in compare}

    @property
    def active(self) -> str:
        """Name of the filter whose estimate counts."""
        return self._active.entry.name

    @property
    def compare(self) -> tuple[str, ...]:
        """Names of the filters that run beside it."""
        return tuple(self._beside)

    def step(self, sample: CorrectedSample) -> TiltEstimate:
        """Feed every filter; return the estimate of the active one."""
        self.step_beside(sample)
        return self.step_active(sample)

    def step_active(self, sample: CorrectedSample) -> TiltEstimate:
        """Feed the active filter only and return its estimate."""
        self._sample = sample
        return self._active.step(sample)

    def step_beside(self, sample: CorrectedSample) -> None:
        """Feed the filters that run beside it, which may wait until the estimate is out."""
        for entry in self._beside.values():
            entry.advance(sample)

    def compared(self) -> dict[str, TiltEstimate]:
        """Return the latest estimates of the filters that run beside, by name."""
        estimates = ((name, entry.estimate) for name, entry in self._beside.items())
        return {name: estimate for name, estimate in estimates if estimate is not None}

    def switch(self, name: str) -> None:
        """Let another filter speak from the next sample on, going on from the estimate.

        A filter of that name that runs beside keeps its own state, so that comparisons stay
        undisturbed by switching.

        Raises:
            ConfigurationError: there is no such filter; nothing changed.
        """
        if name == self.active:
            return
        successor = self._prepare(name)
        estimate = self._active.estimate
        if estimate is not None and self._sample is not None:
            successor.reset(estimate, self._sample)
        self._active = successor

    def run_beside(self, names: Iterable[str]) -> None:
        """Choose the filters that run beside the active one; known ones keep their state.

        Raises:
            ConfigurationError: there is no such filter; nothing changed.
        """
        self._beside = {name: self._beside.get(name) or self._prepare(name) for name in names}

    def configure(self, name: str, values: Mapping[str, float]) -> None:
        """Give a filter other parameter values, at once and as a whole.

        Raises:
            ConfigurationError: unknown filter or parameter, or out of bounds; nothing changed.
        """
        filter_named(name).configure(values)
        self._values[name] = dict(values)
        for entry in (self._active, *self._beside.values()):
            if entry.entry.name == name:
                entry.configure(values)

    def use_robot(self, robot: Robot) -> None:
        """Use another geometry from the next sample on; the states stay."""
        self._robot = robot
        for entry in (self._active, *self._beside.values()):
            entry.use_robot(robot)

    def reset(self) -> None:
        """Let every filter start afresh at the next sample."""
        self._sample = None
        for entry in (self._active, *self._beside.values()):
            entry.forget()

    def warnings(self, dt: float) -> tuple[str, ...]:
        """Return what the active filter's parameters make a user want to know."""
        return self._active.entry.warnings(self._active.parameters, dt)

    def _prepare(self, name: str) -> TiltFilter:
        return TiltFilter(filter_named(name), self._values.get(name), self._robot)
