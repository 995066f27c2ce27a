"""Readings of IMU, encoders and reference from the engine's states.

The IMU is that of `sensors.error_model`: bandwidth, scale, bias, noise, saturation, counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..recording import FloatArray
from ..robot import EncoderPlacement, Robot
from ..samples import STANDARD_GRAVITY
from ..simulation.disturbances import STEP, stream, vibration
from ..simulation.planar_sensing import gyro_cross
from ..simulation.rig import VIBRATION_LEVEL
from ..simulation.spatial_sensing import ImuInput, in_sensor_axes
from ..simulation.worlds import World
from .state import RATE, VELOCITY, WHEELS, rotations, tilts


@dataclass(frozen=True, slots=True)
class PhysicsSenses:
    """The sensing elements on one robot."""

    robot: Robot
    """The true one, not the one that the estimator gets."""
    cross: FloatArray
    """Cross-axis sensitivity of the gyro, (3, 3)."""
    world: World
    clipped_first: bool = False
    """Whether the chip clips before its low-pass, so that no reading stands at the limit."""

    def imu_input(self, rows: FloatArray, step: float, shake: FloatArray | float = 0.0) -> ImuInput:
        """Return what acts on the elements in sensor axes, at each row but the first.

        The specific force is the mean over a step, from the change of the sensor's velocity.

        Args:
            rows: n + 1 states of the engine.
            step: between them [s].
            shake: acceleration of the frame by vibration, body axes [m/s^2], (n, 3).
        """
        attitude, rate = rotations(rows), rows[:, RATE]
        lever = np.cross(rate, self.robot.lever_arm)
        velocity = rows[:, VELOCITY] + np.einsum("nij,nj->ni", attitude, lever)
        change = np.diff(velocity, axis=0) / step
        change[:, 2] += STANDARD_GRAVITY
        middle = 0.5 * (attitude[1:] + attitude[:-1])
        force = np.einsum("nij,ni->nj", middle, change) + shake
        elements = in_sensor_axes(ImuInput(rate[1:], force), self.robot.rotation(), self.cross)
        return self._clipped(elements) if self.clipped_first else elements

    def _clipped(self, unlimited: ImuInput) -> ImuInput:
        gyro, accel = self.robot.gyro_range, self.robot.accel_range
        rate, force = unlimited
        return ImuInput(np.clip(rate, -gyro, gyro), np.clip(force, -accel, accel))

    def wheels(self, rows: FloatArray) -> FloatArray:
        """Return the angles of the left and the right encoder [rad], (n, 2)."""
        angle = rows[:, WHEELS]
        if self.robot.encoder_placement is EncoderPlacement.GROUND:
            return np.asarray(angle + tilts(rows)[0][:, None])
        return angle


def senses_of(
    robot: Robot, world: World, seed: int, *, clipped_first: bool = False
) -> PhysicsSenses:
    """Return the sensing elements of a robot in a world."""
    return PhysicsSenses(robot, gyro_cross(world, seed), world, clipped_first)


def shaking(world: World, speed: FloatArray, voltage: FloatArray, seed: int) -> FloatArray:
    """Return the frame's vibration in body axes [m/s^2], (n, 3), as that of the rig.

    Args:
        world: gives its strength.
        speed: of the axle at each `STEP` [m/s], (n,).
        voltage: mean of the motors [V], (n,).
        seed: of the draw.
    """
    level = VIBRATION_LEVEL * (0.05 + np.abs(speed) / 0.5 + 0.6 * np.abs(voltage) / 12.0)
    waves = vibration(stream(seed, "vibration"), speed.size)
    return np.asarray(world.vibration * level[:, None] * waves)


def repeated(imu_input: ImuInput, step: float) -> ImuInput:
    """Return the IMU's input once for each `STEP`, from steps of a multiple of it."""
    times = round(step / STEP)
    if times == 1:
        return imu_input
    return ImuInput(*(np.repeat(rows, times, axis=0) for rows in imu_input))
