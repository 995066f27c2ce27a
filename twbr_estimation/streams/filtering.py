"""Filters on a live stream: the active one, others beside it, changed without a jump."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from ..checks.finding import sentences
from ..checks.quick import QuickChecks
from ..configuration.filter_settings import Settings
from ..filters.base import Filter, filter_named
from ..pipeline.step_code import StepCode
from ..pipeline.watched_filter import WatchedFilter
from ..samples import RESTART_GAP, CorrectedSample, TiltEstimate
from .filter_configuration import FilterConfiguration, FilterSettings

Values = Mapping[str, Mapping[str, float]]
"""Parameters of filters by name."""


class FilterStream:
    """The filters of a live stream, changed between two samples without losing one."""

    def __init__(self, configuration: FilterConfiguration) -> None:
        """Prepare the filters; they start at the first sample."""
        self._configuration = configuration
        self._tuned: Settings | None = None
        """The configuration as a settings file has it, once somebody has asked."""
        self.checks = QuickChecks()
        """What the samples show to be wrong with the sensors."""
        self.input_valid = True
        """Whether who corrects the samples in another process finds no contradiction in them."""
        self._elapsed, self._steps = 0.0, 0
        self._provide: Callable[[Filter], StepCode | None] = _interpreted
        self._sample: CorrectedSample | None = None
        self._estimate = TiltEstimate(0.0, 0.0)
        self._active = self._prepared(configuration.settings.filter)
        # One that is compared from the start takes the same steps as the active one, once for both.
        self._beside = {
            name: self._active if name == self._active.name else self._prepared(name)
            for name in configuration.settings.compared()
        }

    def _prepared(self, name: str) -> WatchedFilter:
        parameters = self._configuration.parameters.get(name)
        configuration = self._configuration
        limit = configuration.settings.valid_stddev
        prepared = WatchedFilter(filter_named(name), parameters, configuration.robot, limit)
        prepared.use(self._provide(prepared.entry))
        return prepared

    def use(self, provide: Callable[[Filter], StepCode | None]) -> None:
        """Step by machine code from the next sample on, where `provide` has some for a filter."""
        self._provide = provide
        for running in self._running():
            running.use(provide(running.entry))

    def _running(self) -> Iterator[WatchedFilter]:
        yield self._active
        yield from (each for each in self._beside.values() if each is not self._active)

    @property
    def settings(self) -> FilterSettings:
        """The settings in force."""
        return self._configuration.settings

    @property
    def uses_wheels(self) -> bool:
        """Whether a running filter reads the wheels itself."""
        return any(running.entry.uses_wheels for running in self._running())

    @property
    def uses_motors(self) -> bool:
        """Whether a running filter reads the motors' voltage."""
        return any(running.entry.uses_motors for running in self._running())

    def configure(self, configuration: FilterConfiguration) -> None:
        """Use another configuration from the next sample on; the estimate goes on without a jump.

        A filter that becomes the active one continues the estimate of the one before. One that
        runs beside it keeps its own state, so that switching does not disturb a comparison.

        Raises:
            ConfigurationError: a value out of bounds; nothing changed.
        """
        before, settings = self._configuration, configuration.settings
        checked = _changed(before.parameters, configuration.parameters)
        self._configuration, self._tuned = configuration, None
        other_robot = configuration.robot != before.robot
        for running in self._running():
            if running.name in checked:
                running.use_parameters(checked[running.name])
            if running.valid_stddev != settings.valid_stddev:
                running.valid_stddev = settings.valid_stddev
            if other_robot:
                running.use_robot(configuration.robot)
        if other_robot:
            self.checks.restart()
        if settings == before.settings:
            return
        self._switch(settings.filter)
        self._beside = {
            name: self._beside.get(name) or self._prepared(name) for name in settings.compared()
        }

    def _switch(self, name: str) -> None:
        if name == self._active.name:
            return
        successor = self._prepared(name)
        if self._sample is not None:
            successor.succeed(self._active, self._sample)
        self._active = successor

    def step(self, sample: CorrectedSample) -> TiltEstimate:
        """Feed the active filter and return its estimate; `compare` comes after."""
        self.checks.add(sample)
        if 0.0 < sample.dt <= RESTART_GAP:
            self._elapsed += sample.dt
            self._steps += 1
        self._sample = sample
        self._estimate = self._active.step(sample)
        return self._estimate

    def compare(self, sample: CorrectedSample) -> dict[str, TiltEstimate]:
        """Feed the filters that run beside and return their estimates by name.

        One whose equations fail is left out and starts afresh.
        """
        found = {}
        for name, running in self._beside.items():
            try:
                shared = running is self._active
                found[name] = self._estimate if shared else running.step(sample)
            except (ArithmeticError, ValueError):
                running.forget()
        return found

    def reset(self) -> None:
        """Let every filter start afresh at the next sample, without its gyro bias."""
        self._sample = None
        for running in self._running():
            running.forget()

    def published_tilt(self, estimate: TiltEstimate, age: float = 0.0) -> float:
        """Return the tilt for a controller [rad]: predicted, from the balance point, signed.

        Args:
            estimate: The active filter's.
            age: Time since the stamp of its sample [s]; used only where `predict` is on.
        """
        settings = self._configuration.settings
        tilt = estimate.tilt
        if settings.predict:
            tilt += estimate.rate * min(max(age, 0.0), settings.prediction_limit)
        return settings.tilt_sign * (tilt - settings.tilt_offset)

    def variance(self, estimate: TiltEstimate) -> float:
        """Return the variance of the tilt to publish [rad^2]; never zero."""
        own = estimate.tilt_variance or self._configuration.settings.tilt_stddev**2
        return own if self._active.trusted else max(own, self._active.doubt)

    @property
    def trusted(self) -> bool:
        """Whether the filter's own variance and the samples let the latest tilt count as valid."""
        return self._active.trusted and self.input_valid and not self.checks.untrusted

    def contradictions(self) -> str:
        """Return how the sensors contradict each other; empty where they do not."""
        if self.input_valid or self.checks.untrusted:
            return sentences(self.checks.untrusted)
        return "gyro, accelerometer and wheels contradict each other: correction_node says how"

    def distrust(self) -> str:
        """Return why the tilt is not valid where the sensors do not contradict each other."""
        if not self._active.doubted:
            return "the filter does not trust its own estimate"
        return (
            "gaps, saturated or frozen readings, or disagreement with gravity leave the tilt in "
            f"doubt by {math.degrees(math.sqrt(self._active.doubt)):.0f} deg"
        )

    def counts(self) -> dict[str, int]:
        """Return how many samples gaps had room for, and how often a filter was put right."""
        return {
            "lost_samples": self._active.lost,
            "filter_restarts": self._active.restarts,
        }

    def remarks(self) -> tuple[str, ...]:
        """Return what is probably wrong with the inputs of the active filter."""
        state = self._active.state
        return () if state is None else self._active.entry.remarks(state)

    def wheels_ignored(self) -> float:
        """Return for how long the active filter has ignored its wheels [s]."""
        state, ignored = self._active.state, self._active.entry.wheels_ignored
        return 0.0 if state is None or ignored is None else ignored(state)

    def period(self) -> float:
        """Return the mean sampling period since the last call [s]; 0 without samples."""
        mean = self._elapsed / self._steps if self._steps else 0.0
        self._elapsed, self._steps = 0.0, 0
        return mean

    def warnings(self, dt: float) -> tuple[str, ...]:
        """Return warnings about the settings at this sampling period [s]."""
        if dt <= 0.0:
            return ()
        running = {each.name: each for each in self._running()}
        if self._tuned is None:
            self._tuned = self._configuration.tuned()
        found = list(self._tuned.warnings(dt, [each.entry for each in running.values()]))
        for each in running.values():
            found += each.entry.warnings(each.parameters, dt)
        return tuple(found)


def _changed(former: Values, wanted: Values) -> dict[str, Any]:
    """Return the checked parameters of the filters for which other values are wanted.

    Raises:
        ConfigurationError: a value out of bounds.
    """
    if wanted is former:
        return {}
    names = [name for name in {**former, **wanted} if former.get(name, {}) != wanted.get(name, {})]
    return {name: filter_named(name).configure(wanted.get(name)) for name in names}


def _interpreted(entry: Filter) -> StepCode | None:
    """Provide no machine code."""
    del entry
    return None
