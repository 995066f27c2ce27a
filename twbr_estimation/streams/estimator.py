"""The whole live path for people without ROS: readings in, tilt out, sample by sample."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ..checks.finding import Finding
from ..checks.quick import QuickChecks
from ..errors import ConfigurationError
from ..filters.base import Filter, filter_named
from ..live_code.providing import compiled_correction, compiled_filter
from ..parameters.argument_checks import as_number, elements_of, number_within, require_kind, shown
from ..pipeline.correction import Corrector
from ..pipeline.pairing import Pairer, motor_command, wheel_reading
from ..pipeline.physical import FARTHEST, FASTEST, LARGEST_VOLTAGE, STRONGEST
from ..pipeline.watched_filter import WatchedFilter
from ..robot import Robot, Setup
from ..samples import NANOSECONDS_PER_SECOND, SECONDS_PER_NANOSECOND, Sample, TiltEstimate

_UNKNOWN = (0.0, 0.0, 0.0)
_LONGEST = 1e9  # [s]; a time between two samples beyond it is an error


class Estimator:
    """Corrects and filters the readings of one robot: the numbers are those of the ROS nodes."""

    def __init__(
        self,
        filter: str | Filter = "ins_odometer",  # noqa: A002 - the word of the parameters
        robot: Robot | Setup | None = None,
        values: Mapping[str, float] | None = None,
        machine_code: bool = True,
    ) -> None:
        """Prepare a filter; it starts at the first sample.

        Args:
            filter: its name, or a `Filter` of your own.
            robot: geometry and ranges; a `Setup`, such as `read_setup` returns, adds the
                calibration and the settings of the correction.
            values: parameter values of the filter; defaults for the others.
            machine_code: whether correction and filter run as machine code where
                `python -m twbr_estimation.live_code.precompile` has prepared it; it is loaded
                here, and the numbers are the same.

        Raises:
            ConfigurationError: an unknown filter or parameter, or a value out of bounds.
        """
        require_kind("filter", filter, (str, Filter), "the name of a filter or a Filter")
        entry = filter_named(filter) if isinstance(filter, str) else filter
        setup = Setup() if robot is None else robot
        require_kind("robot", setup, (Robot, Setup), "a Robot or a Setup")
        if isinstance(setup, Robot):
            setup = Setup(setup)
        self._corrector = Corrector(setup)
        self._filter = WatchedFilter(entry, values, setup.robot)
        if machine_code:
            self._corrector.use(compiled_correction())
            self._filter.use(compiled_filter(entry))
        self._checks = QuickChecks()
        self._wheels, self._time = Pairer(wait=0.0), 0
        self._started = False

    @property
    def estimate(self) -> TiltEstimate | None:
        """The latest estimate; None before the first sample."""
        return self._filter.estimate

    @property
    def trusted(self) -> bool:
        """Whether neither the samples nor its own variance leave doubt about the latest estimate.

        What gaps, saturated and frozen sensors hide is small, the accelerometer agrees, and the
        sensors do not contradict each other.
        """
        return self._filter.trusted and not self._checks.untrusted

    @property
    def contradictions(self) -> tuple[Finding, ...]:
        """What gyro, accelerometer and wheels show to be wrong with each other."""
        return self._checks.untrusted

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
            dt: time since the sample before [s], at least 1 ns; of the first sample it does not
                count and may be 0. A gap above `RESTART_GAP` starts the filter afresh.
            gyro: rates about the sensor's axes x, y, z [rad/s], as the device reports them.
            accel: specific forces along them [m/s^2]; +g on the axis that points up.
            wheels: encoder angle at this instant [rad], rolling forward positive: one, or left
                and right; None where there is no new reading: between those of a slower encoder
                the angle is extrapolated for `WHEEL_TIMEOUT` at most, as the nodes do. Readings
                that are repeated instead are found out after some steps (`pipeline.repeats`).
            motors: voltage since the sample before [V]: one for both motors, or left and
                right; None where it is not known.

        Raises:
            ConfigurationError: a value that is no number or beyond what is physical (limits in
                `pipeline.physical`), or too many or too few.
        """
        first = not self._started
        elapsed = number_within("dt", dt, 0.0 if first else SECONDS_PER_NANOSECOND, _LONGEST, "s")
        readings = (
            *_numbers("gyro", gyro, (3,), FASTEST, "rad/s"),
            *_numbers("accel", accel, (3,), STRONGEST, "m/s^2"),
        )
        angles = () if wheels is None else _numbers("wheels", wheels, (1, 2), FARTHEST, "rad")
        driven = _UNKNOWN
        if motors is not None:
            driven = motor_command(0, _numbers("motors", motors, (1, 2), LARGEST_VOLTAGE, "V"))[1:]
        if first:  # also where an own filter could not start with the one before
            self._corrector.reset()
            self._wheels.reset()
        time = self._time + (0 if first else max(round(elapsed * NANOSECONDS_PER_SECOND), 1))
        if angles:
            self._wheels.add_wheels(wheel_reading(time, angles))
        turned, self._time = self._wheels.wheels_at(time), time
        sample = Sample._make((0.0 if first else elapsed, *readings, *turned, *driven))
        corrected = self._corrector.step(sample)
        self._checks.add(corrected)
        estimate = self._filter.step(corrected)
        self._started = True
        return estimate

    def reset(self) -> None:
        """Forget everything; the next sample is a first one."""
        self._started = False
        self._corrector.reset()
        self._filter.forget()
        self._checks.restart()


def _numbers(
    argument: str, values: object, counts: tuple[int, ...], limit: float, unit: str
) -> tuple[float, ...]:
    """Return one number or a sequence of them as floats, as many as one of `counts` says."""
    given = elements_of(values)
    numbers = tuple(map(as_number, (values,) if given is None else given))
    if len(numbers) not in counts or any(map(math.isnan, numbers)):
        wanted = " or ".join(map(str, counts))
        raise ConfigurationError(
            f"`{argument}`: {shown(values)}: {wanted} finite numbers are needed"
        )
    if max(map(abs, numbers)) > limit:
        raise ConfigurationError(
            f"`{argument}`: {shown(values)} is beyond any sensor: the limit is {limit:g} {unit}"
        )
    return numbers
