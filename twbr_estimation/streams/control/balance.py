"""From tilt, wheels and a speed command to the motors' voltages; and when to cut them.

No clock and no ROS: the caller passes the time, in the clock of its stamps.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Any

from ...controllers.base import ControlInput, MotorVoltages, controller_named
from ...controllers.odometry import Odometry, begin, follow, geometry_of
from ...controllers.steering import clamped
from ...errors import ConfigurationError
from ...parameters.bounds import Bounds, Meaning, require_bounds
from ...pipeline.pairing import WheelReading
from ...robot import Robot
from ...samples import SECONDS_PER_NANOSECOND

DEFAULT_CONTROLLER = "pid"
NO_VOLTAGE = MotorVoltages(0.0, 0.0)
_LONGEST_STEP = 0.5
"""After a longer pause between two steps [s] the controller starts afresh."""


class Standing(str, Enum):
    """Why the motors run, or do not."""

    BALANCING = "balancing"
    WAITING = "waiting for tilt and wheels"
    FALLEN = "fallen"
    TILT_LATE = "tilt is late"
    TILT_INVALID = "tilt is not valid"
    WHEELS_LATE = "wheels are late"
    TILT_STALE = "tilt is stale: its stamp is too old"
    OTHER_CLOCK = "tilt is stamped by another clock than this node's"
    FROZEN = "tilt is frozen: it does not change although the motors run"
    NO_CLOCK = "use_sim_time is true and there is no /clock"


@dataclass(frozen=True, slots=True)
class BalanceSettings:
    """User settings of balancing, apart from the controllers' own parameters.

    Raises:
        ConfigurationError: an unknown controller, or a number out of bounds.
    """

    controller: Annotated[
        str, Meaning("Name of the controller; can change while the robot balances.")
    ] = DEFAULT_CONTROLLER
    period: Annotated[float, Bounds(0.0005, 0.1, "s", "Period of the controller")] = 0.005
    fall_tilt: Annotated[
        float, Bounds(0.05, 1.5, "rad", "Beyond this tilt the robot has fallen: motors off")
    ] = 0.6
    recovery_tilt: Annotated[
        float, Bounds(0.01, 0.5, "rad", "Within this tilt a fallen robot is upright again")
    ] = 0.1
    recovery_time: Annotated[
        float, Bounds(0.0, 10.0, "s", "How long it must be upright before the motors run again")
    ] = 0.1
    tilt_timeout: Annotated[
        float,
        Bounds(
            0.005,
            1.0,
            "s",
            "Without a tilt for this long, or with one stamped this long ago, the motors are cut",
        ),
    ] = 0.05
    wheel_timeout: Annotated[
        float, Bounds(0.005, 1.0, "s", "Without wheel angles for this long the motors are cut")
    ] = 0.1
    command_timeout: Annotated[
        float, Bounds(0.05, 10.0, "s", "Without a speed command for this long the robot stops")
    ] = 0.5
    velocity_time_constant: Annotated[
        float, Bounds(0.0, 1.0, "s", "Low-pass of the speeds that the wheels give")
    ] = 0.005
    largest_velocity: Annotated[
        float, Bounds(0.0, 10.0, "m/s", "Fastest speed a command may ask for")
    ] = 0.5
    largest_acceleration: Annotated[
        float, Bounds(0.01, 50.0, "m/s^2", "How fast the commanded speed may change")
    ] = 1.0
    largest_yaw_rate: Annotated[
        float, Bounds(0.0, 20.0, "rad/s", "Fastest turn a command may ask for")
    ] = 3.0
    largest_yaw_acceleration: Annotated[
        float, Bounds(0.01, 200.0, "rad/s^2", "How fast the commanded yaw rate may change")
    ] = 10.0

    def __post_init__(self) -> None:
        require_bounds(self)
        controller_named(self.controller)
        if self.recovery_tilt >= self.fall_tilt:
            raise ConfigurationError(
                f"recovery_tilt: {self.recovery_tilt:g} rad is not below "
                f"fall_tilt {self.fall_tilt:g} rad"
            )


@dataclass(frozen=True, slots=True)
class BalanceConfiguration:
    """Everything a balancing stream is made of."""

    settings: BalanceSettings = field(default_factory=BalanceSettings)
    parameters: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Parameter values by controller name; defaults for the others."""
    robot: Robot = field(default_factory=Robot)


class BalanceStream:
    """A controller on a live stream, its motors cut whenever the robot's state is unknown."""

    def __init__(self, configuration: BalanceConfiguration) -> None:
        """Prepare the controller; it starts at the first step with tilt and wheels.

        Raises:
            ConfigurationError: an unknown parameter, or a value out of bounds.
        """
        self._tilt: tuple[int, float, float] | None = None
        self._valid = True
        self._fault: Standing | None = None
        self._wheels: WheelReading | None = None
        self._command: tuple[int, float, float] | None = None
        self._odometry: Odometry | None = None
        self._state: Any | None = None
        self._last_step: int | None = None
        self._followed = 0
        self._upright_since: int | None = None
        self._fallen = False
        self._target = (0.0, 0.0)
        self.standing = Standing.WAITING
        """Whether the motors run, and why not."""
        self.configure(configuration)

    @property
    def settings(self) -> BalanceSettings:
        """The settings in force."""
        return self._configuration.settings

    @property
    def odometry(self) -> Odometry | None:
        """Travel and speeds at the last step; None before the first."""
        return self._odometry

    @property
    def target(self) -> tuple[float, float]:
        """Speed [m/s] and yaw rate [rad/s] that are followed now."""
        return self._target

    def configure(self, configuration: BalanceConfiguration) -> None:
        """Go over to another configuration; another controller starts where the robot stands.

        Raises:
            ConfigurationError: an unknown parameter, or a value out of bounds; nothing changed.
        """
        settings, robot = configuration.settings, configuration.robot
        entry = controller_named(settings.controller)
        parameters = entry.configure(configuration.parameters.get(entry.name))
        self._coefficients = entry.coefficients(parameters, robot, settings.period)
        self._geometry = geometry_of(robot, settings.velocity_time_constant)
        if self._state is not None and not isinstance(self._state, entry.state):
            self._state = None
        self._entry, self._configuration = entry, configuration

    def add_tilt(self, stamp: int, tilt: float, rate: float | None = None) -> None:
        """Take a tilt [rad], and its rate [rad/s] where the source has it; `stamp` in [ns].

        What is not finite, or not newer than the last, is ignored.
        """
        last = self._tilt
        if not math.isfinite(tilt) or (last is not None and stamp <= last[0]):
            return
        if rate is None or not math.isfinite(rate):
            rate = (
                0.0
                if last is None
                else (tilt - last[1]) / ((stamp - last[0]) * SECONDS_PER_NANOSECOND)
            )
        self._tilt = (stamp, tilt, rate)

    def set_valid(self, valid: bool) -> None:
        """Set whether the tilt is valid, until the next call."""
        self._valid = valid

    def set_fault(self, fault: Standing | None) -> None:
        """Take what is wrong with the latest tilt; None where nothing is."""
        self._fault = fault

    def add_wheels(self, reading: WheelReading) -> None:
        """Take wheel angles; what is not finite, or not newer than the last, is ignored."""
        known = self._wheels
        if math.isfinite(reading.angle + reading.difference) and (
            known is None or reading.stamp > known.stamp
        ):
            self._wheels = reading

    def command(self, stamp: int, velocity: float, yaw_rate: float) -> None:
        """Take a commanded speed [m/s] and yaw rate [rad/s]; what is not finite is ignored."""
        if math.isfinite(velocity + yaw_rate):
            self._command = (stamp, velocity, yaw_rate)

    def lay_down(self) -> None:
        """Take the robot as fallen: the motors stay cut until it has been upright for a while."""
        self._fallen, self._upright_since, self._state = True, None, None

    def stand_up(self) -> None:
        """Take the robot as upright, however it leans; the next step may run the motors."""
        self._fallen, self._upright_since = False, None

    def reset(self) -> None:
        """Forget all readings and the fall, because time was set back."""
        self._tilt = self._wheels = self._command = None
        self._odometry = self._state = self._last_step = self._upright_since = None
        self._followed = 0
        self._fallen, self._target = False, (0.0, 0.0)
        self.standing = Standing.WAITING

    def step(self, now: int) -> MotorVoltages:
        """Return what the motors get from `now` [ns] on until the next step."""
        dt = 0.0 if self._last_step is None else (now - self._last_step) * SECONDS_PER_NANOSECOND
        if not 0.0 < dt <= _LONGEST_STEP:
            self._odometry = self._state = None
        self._last_step = now
        self.standing = self._judged(now)
        if self.standing is Standing.WAITING:
            return NO_VOLTAGE
        where = self._where()
        if self.standing is not Standing.BALANCING:
            self._state, self._target = None, (0.0, 0.0)
            return NO_VOLTAGE
        assert self._tilt is not None  # or it would still wait
        self._target = self._commanded(now, dt)
        known = ControlInput(dt, *self._tilt[1:], *where[:4], *self._target)
        if self._state is None:
            self._state = self._entry.reset(known, self._coefficients)
        if dt > 0.0:
            self._state = self._entry.step(self._state, known, self._coefficients)
        return MotorVoltages(self._state.left, self._state.right)

    def _judged(self, now: int) -> Standing:
        """Return whether the robot can be balanced now."""
        settings, tilt, wheels = self.settings, self._tilt, self._wheels
        if tilt is None or wheels is None:
            return Standing.WAITING
        if (now - tilt[0]) * SECONDS_PER_NANOSECOND > settings.tilt_timeout:
            return Standing.TILT_LATE
        if self._fault is not None:
            return self._fault
        if not self._valid:
            return Standing.TILT_INVALID
        if (now - wheels.stamp) * SECONDS_PER_NANOSECOND > settings.wheel_timeout:
            return Standing.WHEELS_LATE
        return Standing.FALLEN if self._has_fallen(now, tilt[1]) else Standing.BALANCING

    def _has_fallen(self, now: int, tilt: float) -> bool:
        """Return whether the robot is down, or has not been upright for long enough since."""
        settings = self.settings
        if abs(tilt) > settings.fall_tilt:
            self._fallen = True
        if not self._fallen or abs(tilt) > settings.recovery_tilt:
            self._upright_since = None
            return self._fallen
        if self._upright_since is None:
            self._upright_since = now
        upright = (now - self._upright_since) * SECONDS_PER_NANOSECOND
        self._fallen = upright < settings.recovery_time
        return self._fallen

    def _where(self) -> Odometry:
        """Follow the wheels as far as they have been read."""
        assert self._tilt is not None and self._wheels is not None  # or it would still wait
        _, tilt, rate = self._tilt
        stamp, angle, difference, _ = self._wheels
        since = (stamp - self._followed) * SECONDS_PER_NANOSECOND
        if self._odometry is None or since > _LONGEST_STEP:
            self._odometry = begin(angle, difference, tilt, self._geometry)
        elif since > 0.0:
            self._odometry = follow(
                self._odometry, since, angle, difference, tilt, rate, self._geometry
            )
        self._followed = stamp
        return self._odometry

    def _commanded(self, now: int, dt: float) -> tuple[float, float]:
        """Return speed and yaw rate to follow now, within limits and without jumps."""
        assert self._wheels is not None  # or it would still wait
        settings, command = self.settings, self._command
        velocity = yaw_rate = 0.0
        if (
            command is not None
            and (now - command[0]) * SECONDS_PER_NANOSECOND <= settings.command_timeout
        ):
            velocity, yaw_rate = command[1:]
        if self._geometry.heading_per_difference == 0.0 or self._wheels.encoders < 2.0:
            yaw_rate = 0.0  # without a measured heading the robot would never stop turning
        return (
            _ramped(
                self._target[0],
                velocity,
                settings.largest_velocity,
                settings.largest_acceleration * dt,
            ),
            _ramped(
                self._target[1],
                yaw_rate,
                settings.largest_yaw_rate,
                settings.largest_yaw_acceleration * dt,
            ),
        )


def _ramped(last: float, wanted: float, limit: float, change: float) -> float:
    """Return what is wanted, within the limit and no further than `change` from the last."""
    return clamped(clamped(wanted, -limit, limit), last - change, last + change)
