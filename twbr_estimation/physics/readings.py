"""The sensors of a robot that moves on stretch by stretch."""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray
from ..robot import Robot
from ..sensors.error_model import Sextuple, low_passed, read
from ..simulation.disturbances import STEP, gyro_drift, stream, vibration
from ..simulation.planar_sensing import imu_errors, mount_of, quantised
from ..simulation.rig import VIBRATION_LEVEL
from ..simulation.simulate import WHEEL_COUNTS
from ..simulation.worlds import World
from .sensing import repeated, senses_of
from .state import Moving


class Readings:
    """IMU, encoders and reference; noise and vibration are drawn for a time and then repeat."""

    def __init__(
        self, robot: Robot, world: World, seed: int, step: float, every: int, count: int
    ) -> None:
        """Draw all noise.

        Args:
            robot: as it is.
            world: what is wrong with its sensors.
            seed: of the draw.
            step: of the integration [s].
            every: steps between two readings.
            count: readings until noise repeats.
        """
        self._senses, self._world = senses_of(robot, world, seed), world
        self._step, self._supply = step, robot.supply_voltage
        mount = mount_of(robot, world)
        self._lags = (mount.gyro_lag,) * 3 + (mount.accel_lag,) * 3
        self._errors = imu_errors(world, world.calibration, seed, robot)
        self._noise = stream(seed, "noise").standard_normal((count, 6)).tolist()
        self._drift = gyro_drift(world, count, every * step, seed).tolist()
        self._waves = world.vibration * vibration(stream(seed, "vibration"), count * every)
        self._zeros = stream(seed, "encoders").uniform(0.0, 1.0, 2)
        self._done = 0
        self._sensed: list[float] | None = None

    def follow(self, rows: FloatArray, moving: Moving, voltage: float) -> None:
        """Take a stretch of motion.

        Args:
            rows: its n + 1 states, the one before included.
            moving: how the robot moves at its end.
            voltage: mean of the motors [V].
        """
        count = rows.shape[0] - 1
        level = 0.05 + abs(moving.velocity) / 0.5 + 0.6 * abs(voltage) / self._supply
        turn = np.arange(self._done, self._done + count) % self._waves.shape[0]
        shake = VIBRATION_LEVEL * level * self._waves[turn]
        self._done += count
        imu_input = repeated(self._senses.imu_input(rows, self._step, shake), self._step)
        for row in np.hstack([imu_input.rate, imu_input.force]).tolist():
            last = self._sensed or row
            self._sensed = [
                low_passed(before, now, STEP, lag)
                for before, now, lag in zip(last, row, self._lags, strict=True)
            ]

    def imu(self, index: int) -> Sextuple:
        """Return the reading of that number."""
        assert self._sensed is not None, "no step was taken"
        x, y, z, forward, left, up = self._sensed
        at = index % len(self._noise)
        noise, (dx, dy, dz) = self._noise[at], self._drift[at]
        return read((x, y, z), (forward, left, up), (dx, dy, dz), (*noise,), self._errors)

    def wheels(self, row: FloatArray) -> tuple[float, ...]:
        """Return the encoders' angles in one state [rad]."""
        (angles,) = self._senses.wheels(row[None])
        counted = quantised(angles, WHEEL_COUNTS, self._zeros) if self._world.digital else angles
        return tuple(counted.tolist())

    def reference(self, tilt: float) -> float:
        """Return what the reference encoder reads [rad]."""
        if not self._world.digital:
            return tilt
        return float(quantised(np.array(tilt), self._world.reference_counts, 0.5))
