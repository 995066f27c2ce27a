"""The loops over a whole simulation, compiled from the single steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ..plants.laddach2022 import PlantParameters
from ..recording import FloatArray
from ..sensors.error_model import ImuErrors, low_passed, read
from .disturbances import STEP, Disturbances
from .planar_sensing import Mount, PlanarMotion, at_rest, sense, sense_stretch
from .rig import Inputs, RigState, next_voltage, stretch
from .rig_controller import BalanceGains
from .spatial_sensing import ImuInput

_SOURCES = ("samples.py", "plants/*.py", "sensors/error_model.py", "simulation/*.py")


def drive(
    disturbances: Disturbances, plant: PlantParameters, gains: BalanceGains, period: float
) -> tuple[FloatArray, int]:
    """Let the robot balance through all disturbances.

    Args:
        disturbances: n steps of them.
        plant: the robot.
        gains: its balance controller.
        period: of the controller [s].

    Returns:
        The motion, (n, 8) with the fields of `PlanarMotion`, its first row at rest; and the falls.
    """
    inputs = disturbances.inputs()
    motion = np.zeros((inputs.shape[0], len(PlanarMotion._fields)))
    state = _drive_kernel()(
        inputs, disturbances.vibration, plant, gains, round(period / STEP), RigState(), motion
    )
    return motion, int(state.falls)


def measure(
    motion: FloatArray,
    mount: Mount,
    errors: ImuErrors,
    drift: FloatArray,
    noise: FloatArray,
    every: int,
) -> FloatArray:
    """Read the IMU at every `every`-th step of a motion.

    Args:
        motion: (n, 8) with the fields of `PlanarMotion`.
        mount: how the IMU is fixed.
        errors: what is wrong with it.
        drift: deviation of the gyro biases at each reading [rad/s], (m, 3).
        noise: standard normal numbers, (m, 6).
        every: steps between two readings.

    Returns:
        Gyro [rad/s] and accelerometer [m/s^2] readings, (m, 6).
    """
    readings = np.empty_like(noise)
    _measure_kernel()(motion, mount, errors, drift, noise, every, readings)
    return readings


def measure_input(
    imu_input: ImuInput,
    mount: Mount,
    errors: ImuErrors,
    drift: FloatArray,
    noise: FloatArray,
    every: int,
) -> FloatArray:
    """Read the IMU at every `every`-th of n steps, its input in sensor axes.

    The other arguments and the result are those of `measure`.
    """
    readings = np.empty_like(noise)
    inputs = np.column_stack([imu_input.rate, imu_input.force])
    lags = (mount.gyro_lag, mount.accel_lag)
    _measure_felt_kernel()(inputs, lags, errors, drift, noise, every, readings)
    return readings


def _compiled(run: Callable[..., Any], *called: Callable[..., Any]) -> Any:
    """Compile a loop; only now numba is imported, which single steps do without."""
    from ..compilation import compiled, source_version

    return compiled(run, source_version(_SOURCES), *called)


@lru_cache(maxsize=1)
def _drive_kernel() -> Any:
    def run(
        inputs: Any, vibration: Any, plant: Any, gains: Any, every: int, state: Any, motion: Any
    ) -> Any:
        voltage, pending = 0.0, 0.0
        last = inputs.shape[0] - 1
        for i in range(0, last, every):
            row = inputs[i]
            now = Inputs(row[0], row[1], row[2], row[3], row[4], row[5], row[6])
            voltage = pending
            pending = next_voltage(state, now, pending, gains, plant.supply_voltage)
            end = min(i + every, last)
            state = stretch(
                state,
                inputs[i:end],
                vibration[i + 1 : end + 1],
                voltage,
                plant,
                motion[i + 1 : end + 1],
            )
        return state

    return _compiled(run, next_voltage, stretch)


@lru_cache(maxsize=1)
def stretch_kernel() -> Any:
    """Return `stretch` compiled, for arrays."""

    def run(state: Any, inputs: Any, vibration: Any, voltage: Any, plant: Any, motion: Any) -> Any:
        return stretch(state, inputs, vibration, voltage, plant, motion)

    return _compiled(run, stretch)


@lru_cache(maxsize=1)
def sense_kernel() -> Any:
    """Return `sense_stretch` compiled, for arrays."""

    def run(sensed: Any, motion: Any, mount: Any) -> Any:
        return sense_stretch(sensed, motion, mount)

    return _compiled(run, sense_stretch)


@lru_cache(maxsize=1)
def read_kernel() -> Any:
    """Return `error_model.read` compiled."""

    def run(rate: Any, force: Any, drift: Any, noise: Any, errors: Any) -> Any:
        return read(rate, force, drift, noise, errors)

    return _compiled(run, read)


@lru_cache(maxsize=1)
def _measure_kernel() -> Any:
    def run(
        motion: Any, mount: Any, errors: Any, drift: Any, noise: Any, every: int, readings: Any
    ) -> None:
        row = motion[0]
        sensed = at_rest(
            PlanarMotion(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]), mount
        )
        for i in range(motion.shape[0]):
            row = motion[i]
            now = PlanarMotion(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])
            sensed = sense(sensed, now, mount)
            k = i // every
            if i % every == 0 and k < readings.shape[0]:
                wander = (drift[k, 0], drift[k, 1], drift[k, 2])
                z = noise[k]
                white = (z[0], z[1], z[2], z[3], z[4], z[5])
                reading = read(sensed.rate, sensed.force, wander, white, errors)
                for column in range(6):
                    readings[k, column] = reading[column]

    return _compiled(run, at_rest, sense, read)


@lru_cache(maxsize=1)
def _measure_felt_kernel() -> Any:
    def run(
        inputs: Any, lags: Any, errors: Any, drift: Any, noise: Any, every: int, readings: Any
    ) -> None:
        sensed = inputs[0].copy()
        for i in range(inputs.shape[0]):
            for column in range(6):
                lag = lags[0] if column < 3 else lags[1]
                sensed[column] = low_passed(sensed[column], inputs[i, column], STEP, lag)
            k = i // every
            if i % every == 0 and k < readings.shape[0]:
                rate = (sensed[0], sensed[1], sensed[2])
                force = (sensed[3], sensed[4], sensed[5])
                wander = (drift[k, 0], drift[k, 1], drift[k, 2])
                z = noise[k]
                white = (z[0], z[1], z[2], z[3], z[4], z[5])
                reading = read(rate, force, wander, white, errors)
                for column in range(6):
                    readings[k, column] = reading[column]

    return _compiled(run, low_passed, read)
