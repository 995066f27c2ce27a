"""The whole live path for people without ROS: readings in, tilt out, sample by sample."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ..errors import ConfigurationError
from ..filters.base import Filter, filter_named
from ..robot import Robot, Setup
from ..samples import Sample, TiltEstimate
from .correction import Corrector
from .pairing import motor_command, wheel_reading
from .watched_filter import WatchedFilter

_UNKNOWN = (0.0, 0.0, 0.0)


class Estimator:
    """Corrects and filters the readings of one robot: the numbers are those of the ROS nodes."""

    def __init__(
        self,
        filter: str | Filter = "ins_odometer",  # noqa: A002 - the word of the parameters
        robot: Robot | Setup | None = None,
        values: Mapping[str, float] | None = None,
    ) -> None:
        """Prepare a filter; it starts at the first sample.

        Args:
            filter: its name, or a `Filter` of your own.
            robot: geometry and ranges; a `Setup`, such as `read_setup` returns, adds the
                calibration and the settings of the correction.
            values: parameter values of the filter; defaults for the others.

        Raises:
            ConfigurationError: an unknown filter or parameter, or a value out of bounds.
        """
        entry = filter_named(filter) if isinstance(filter, str) else filter
        if not isinstance(entry, Filter):
            raise ConfigurationError(f"`filter`: {filter!r} is neither a name nor a Filter")
        setup = Setup() if robot is None else robot
        if isinstance(setup, Robot):
            setup = Setup(setup)
        if not isinstance(setup, Setup):
            raise ConfigurationError(f"`robot`: {robot!r} is neither a Robot nor a Setup")
        self._corrector = Corrector(setup)
        self._filter = WatchedFilter(entry, values, setup.robot)

    @property
    def estimate(self) -> TiltEstimate | None:
        """The latest estimate; None before the first sample."""
        return self._filter.estimate

    @property
    def trusted(self) -> bool:
        """Whether the samples leave no doubt about the latest estimate.

        What gaps, saturated and frozen sensors hide is small, and the accelerometer agrees.
        """
        return self._filter.trusted

    def step(
        self,
        dt: float,
        gyro: Sequence[float],
        accel: Sequence[float],
        wheels: float | Sequence[float] | None = None,
        motors: float | Sequence[float] | None = None,
    ) -> TiltEstimate:
        """Take one sample and return the tilt at its instant.

        Args:
            dt: time since the sample before [s]; of the first sample it does not count. A gap
                above `RESTART_GAP` starts the filter afresh.
            gyro: rates about the sensor's axes x, y, z [rad/s], as the device reports them.
            accel: specific forces along them [m/s^2]; +g on the axis that points up.
            wheels: encoder angle at this instant [rad], rolling forward positive: one, or left
                and right; None where it is not known.
            motors: voltage since the sample before [V]: one for both motors, or left and
                right; None where it is not known.

        Raises:
            ConfigurationError: a value that is no finite number, or too many or too few.
        """
        first = self._filter.state is None
        elapsed = 0.0 if first else _positive("dt", dt)
        readings = *_numbers("gyro", gyro, (3,)), *_numbers("accel", accel, (3,))
        turned, driven = _UNKNOWN, _UNKNOWN
        if wheels is not None:
            turned = wheel_reading(0, _one_or_two("wheels", wheels))[1:]
        if motors is not None:
            driven = motor_command(0, _one_or_two("motors", motors))[1:]
        sample = Sample._make((elapsed, *readings, *turned, *driven))
        return self._filter.step(self._corrector.step(sample))

    def reset(self) -> None:
        """Forget everything; the next sample is a first one."""
        self._corrector.reset()
        self._filter.forget()


def _positive(argument: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not 0.0 < number < math.inf:
        raise ConfigurationError(f"`{argument}`: {value!r} is no time above 0 s")
    return number


def _one_or_two(argument: str, values: float | Sequence[float]) -> tuple[float, ...]:
    given = (values,) if isinstance(values, (int, float)) else values
    return _numbers(argument, given, (1, 2))


def _numbers(argument: str, values: Sequence[float], counts: tuple[int, ...]) -> tuple[float, ...]:
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        numbers = ()
    wanted = " or ".join(map(str, counts))
    if len(numbers) not in counts or not math.isfinite(sum(numbers)):
        raise ConfigurationError(f"`{argument}`: {values!r}: {wanted} finite numbers are needed")
    return numbers
