"""Inputs of IMU and wheel encoders for a motion that is given stretch by stretch.

In a plane, and in three dimensions where the robot turns and rolls. The equations are those of
`sensing` and `spatial`, which whole recordings are made with.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from ..recording import FloatArray
from ..robot import Robot
from ..sensors.error_model import Triple, low_passed
from .disturbances import STEP
from .planar_sensing import Mount, PlanarMotion, SensedMotion, at_rest, sense, sense_stretch
from .spatial_sensing import imu_input, in_sensor_axes, wheel_angles
from .turning import Turning

Rows = Any
"""Lists of floats, or an array: the fields of `PlanarMotion`, one row a step."""


class Senses(Protocol):
    """Sensing elements that follow a motion."""

    heading: float
    """[rad]."""
    yaw_rate: float
    """[rad/s]."""

    def begin(self, row: Any, step: int) -> None:
        """Start from rest at one row of the motion; `step` is its number."""
        ...

    def follow(self, rows: Rows, step: int) -> None:
        """Go on through n rows; `step` is the number of the last row before."""
        ...

    def imu_input(self) -> tuple[Triple, Triple]:
        """Return angular rate [rad/s] and specific force [m/s^2] in sensor axes."""
        ...

    def wheels(self) -> FloatArray:
        """Return the angles of the wheels against the body [rad], (1,) or (2,)."""
        ...


class PlanarSenses:
    """On a robot that drives straight ahead, with one wheel encoder."""

    heading = yaw_rate = 0.0

    def __init__(self, robot: Robot, mount: Mount, *, compiled: bool) -> None:
        """`compiled`: whether rows are arrays, and the loop over them is compiled."""
        self._radius, self._mount = robot.wheel_radius, mount
        self._sense: Any = sense_stretch
        if compiled:
            from .kernels import sense_kernel

            self._sense = sense_kernel()
        self._sensed: SensedMotion

    def begin(self, row: Any, step: int) -> None:
        """As `Senses`."""
        del step
        motion = PlanarMotion(*map(float, row))
        self._sensed = sense(at_rest(motion, self._mount), motion, self._mount)

    def follow(self, rows: Rows, step: int) -> None:
        """As `Senses`."""
        del step
        self._sensed = self._sense(self._sensed, rows, self._mount)

    def imu_input(self) -> tuple[Triple, Triple]:
        """As `Senses`."""
        return self._sensed.rate, self._sensed.force

    def wheels(self) -> FloatArray:
        """As `Senses`."""
        motion = self._sensed.motion
        return np.array([motion.wheel_travel / self._radius - motion.tilt])


class SpatialSenses:
    """On a robot that turns and rolls, with two wheel encoders."""

    def __init__(self, robot: Robot, mount: Mount, turning: Turning, cross: FloatArray) -> None:
        """Take the true robot, what is added to its planar motion, and the gyro's cross axes."""
        self._robot, self._turning, self._cross = robot, turning, cross
        self._rotation = robot.rotation()
        self._lags = (mount.gyro_lag,) * 3 + (mount.accel_lag,) * 3
        self._columns = np.column_stack(
            [turning.yaw_rate, turning.roll, turning.roll_rate, turning.lift_speed, turning.slip]
        )
        self._count = turning.yaw_rate.size
        self._last: FloatArray
        self._sensed: list[float]
        self._rolled = np.zeros(2)
        self._wheels = np.zeros(2)
        self.heading = self.yaw_rate = 0.0

    def begin(self, row: Any, step: int) -> None:
        """As `Senses`."""
        self._last = np.array([row], dtype=np.float64)
        self._sensed = self._elements(self._last, self._turns(step, 1))[0].tolist()
        self._wheels = self._without_turns(self._last) + self._rolled
        self._low_passed([self._sensed])

    def follow(self, rows: Rows, step: int) -> None:
        """As `Senses`."""
        planar = np.vstack([self._last, rows])
        turns = self._turns(step, planar.shape[0])
        self._low_passed(self._elements(planar, turns)[1:].tolist())
        angles = wheel_angles(planar, turns, self._robot)
        self._wheels = angles[-1] + self._rolled
        self._last = planar[-1:]
        self._rolled = self._wheels - self._without_turns(self._last)
        yaw = turns.yaw_rate
        self.heading += STEP * float(np.sum(0.5 * (yaw[1:] + yaw[:-1])))
        self.yaw_rate = float(yaw[-1])

    def imu_input(self) -> tuple[Triple, Triple]:
        """As `Senses`."""
        x, y, z, forward, left, up = self._sensed
        return (x, y, z), (forward, left, up)

    def wheels(self) -> FloatArray:
        """As `Senses`."""
        return self._wheels

    def _turns(self, step: int, count: int) -> Turning:
        """Return what is added at `count` steps from `step` on."""
        rows = self._columns[np.arange(step, step + count) % self._count]
        return Turning(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3], rows[:, 4:])

    def _elements(self, planar: FloatArray, turns: Turning) -> FloatArray:
        """Return what acts on the sensing elements, (n, 6)."""
        sensor = in_sensor_axes(
            imu_input(planar, turns, self._robot.lever_arm), self._rotation, self._cross
        )
        return np.column_stack([sensor.rate, sensor.force])

    def _low_passed(self, rows: list[list[float]]) -> None:
        for row in rows:
            self._sensed = [
                low_passed(last, value, STEP, lag)
                for last, value, lag in zip(self._sensed, row, self._lags, strict=True)
            ]

    def _without_turns(self, planar: FloatArray) -> FloatArray:
        """Return the wheels' angle of the planar motion alone [rad]."""
        motion = PlanarMotion(*planar[0])
        return np.full(2, motion.wheel_travel / self._robot.wheel_radius - motion.tilt)
