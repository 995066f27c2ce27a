"""The data of a recording on even time grids, calibrated and in body axes, part by part.

A part is a stretch without a long gap. Readings are integrated before they are resampled, so
a grid point holds all readings since the last one and nothing is aliased.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..pipeline.saturation import SATURATION_MARGIN
from ..recording import FloatArray, ImuTrack, Recording, StampArray
from ..robot import Calibration, Setup
from ..samples import RESTART_GAP

STEP = 0.02
"""Period of the grid [s]; slower recordings keep their own."""
SHORTEST = 6.0
"""Shortest part that is used [s]."""
BRIEF = 2.0
"""Shortest part that shows gravity, where there is no longer one [s]."""
LONGEST = 600.0
"""Readings beyond this time of a part are not looked at [s]."""
LONGEST_HOLE = 0.5
"""Missing readings of wheels or reference are bridged up to this time [s]."""
MOST_PARTS = 20
"""Parts that are looked at, the longest first."""

BEYOND = 1.02
"""Readings beyond this many times full scale are impossible."""

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Part:
    """A stretch of data on an even grid of n points."""

    time: FloatArray
    """Time since the recording's first IMU reading [s], (n,)."""
    step: float
    """Period of the grid [s]."""
    turn: FloatArray
    """Integral of the calibrated rate about the body's axes [rad], (n, 3)."""
    push: FloatArray
    """Integral of the calibrated specific force along the body's axes [m/s], (n, 3)."""
    wheels: FloatArray | None
    """Encoder angles [rad], (n, w); not a number where readings are missing."""
    reference: FloatArray | None
    """Reference tilt [rad], (n,); not a number where readings are missing."""
    usable: BoolArray
    """Where neither gyro nor accelerometer is at full scale, (n,)."""

    def force(self) -> FloatArray:
        """Return the mean specific force of each step [m/s^2], (n - 1, 3)."""
        return np.diff(self.push, axis=0) / self.step


def calibrated(imu: ImuTrack, setup: Setup) -> tuple[FloatArray, FloatArray]:
    """Return rate [rad/s] and specific force [m/s^2] in body axes, (n, 3) each."""
    calibration, rotation = setup.calibration, setup.robot.rotation()
    rate = (imu.gyro - calibration.gyro_bias) * calibration.gyro_scale
    force = imu.accel - calibration.accel_bias
    for column, axis in enumerate("xyz"):
        force[:, column] -= _scale_error(force[:, column], calibration, axis)
    return rate @ rotation.T, force @ rotation.T


def _scale_error(force: FloatArray, calibration: Calibration, axis: str) -> FloatArray:
    coefficients = getattr(calibration, f"accel_scale_{axis}")
    argument = np.clip(force, *getattr(calibration, f"accel_valid_{axis}"))
    error: FloatArray = np.zeros_like(argument)
    for coefficient in reversed(coefficients):
        error = (coefficient + error) * argument
    return error


def parts_of(recording: Recording, setup: Setup, shortest: float = SHORTEST) -> tuple[Part, ...]:
    """Return the longest stretches of a recording without gap, in the order of time.

    Args:
        recording: the data.
        setup: robot and calibration as configured.
        shortest: stretches of less time [s] are left out.
    """
    stamps = recording.imu.stamps
    if stamps.size < 2:
        return ()
    found = _stretches(stamps, shortest)
    longest = sorted(found, key=lambda part: stamps[part[0]] - stamps[part[1] - 1])
    rate, force = calibrated(recording.imu, setup)
    kept = sorted(longest[:MOST_PARTS])
    return tuple(_part(recording, setup, rate, force, *bounds) for bounds in kept)


def _stretches(stamps: StampArray, shortest: float) -> Iterator[tuple[int, int]]:
    """Yield begin and end of every stretch that is long enough, at most `LONGEST` of it."""
    cuts = np.flatnonzero(np.diff(stamps) > round(RESTART_GAP * 1e9)) + 1
    for begin, end in zip([0, *cuts], [*cuts, stamps.size], strict=True):
        last = int(np.searchsorted(stamps[begin:end], stamps[begin] + round(LONGEST * 1e9)))
        if last > 1 and stamps[begin + last - 1] - stamps[begin] >= round(shortest * 1e9):
            yield int(begin), int(begin + last)


def _part(
    recording: Recording, setup: Setup, rate: FloatArray, force: FloatArray, begin: int, end: int
) -> Part:
    stamps, inside = recording.imu.stamps, slice(begin, end)
    start = int(stamps[begin])
    times = np.asarray((stamps[inside] - start) * 1e-9, dtype=np.float64)
    step = max(STEP, recording.dt)
    grid = np.arange(0.0, float(times[-1]), step, dtype=np.float64)
    full = saturated(recording.imu, setup)[inside].astype(np.float64)
    wheels, reference = recording.wheels, recording.reference
    tilt = None if reference is None else np.unwrap(reference.tilt)[:, None]
    return Part(
        time=grid + float(start - stamps[0]) * 1e-9,
        step=step,
        turn=_integral(times, rate[inside], grid),
        push=_integral(times, force[inside], grid),
        wheels=None if wheels is None else _at(grid, start, wheels.stamps, wheels.angle),
        reference=None
        if reference is None or tilt is None
        else _at(grid, start, reference.stamps, tilt)[:, 0],
        usable=np.interp(grid, times, full) == 0.0,
    )


def saturated(imu: ImuTrack, setup: Setup) -> BoolArray:
    """Return where a reading is at full scale, (n,); a sensor beyond it has another range."""
    robot = setup.robot
    return _full(imu.gyro, robot.gyro_range) | _full(imu.accel, robot.accel_range)


def _full(values: FloatArray, limit: float) -> BoolArray:
    size = np.abs(values).max(axis=1)
    if size.max(initial=0.0) > BEYOND * limit:
        return np.zeros(size.size, dtype=np.bool_)
    return np.asarray(size >= SATURATION_MARGIN * limit, dtype=np.bool_)


def _integral(times: FloatArray, values: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the integral of (n, k) values at the points of a grid, by trapezoids."""
    areas = 0.5 * (values[1:] + values[:-1]) * np.diff(times)[:, None]
    total = np.vstack([np.zeros((1, values.shape[1])), np.cumsum(areas, axis=0)])
    return np.column_stack([np.interp(grid, times, column) for column in total.T])


def _at(grid: FloatArray, start: int, stamps: StampArray, values: FloatArray) -> FloatArray:
    """Return (m, k) values at the points of a grid that begins at `start` [ns]."""
    times = (stamps - start) * 1e-9
    result = np.column_stack([np.interp(grid, times, column) for column in values.T])
    after = np.clip(np.searchsorted(times, grid), 1, max(times.size - 1, 1))
    if times.size > 1:
        result[times[after] - times[after - 1] > LONGEST_HOLE] = np.nan
    result[(grid < times[0]) | (grid > times[-1])] = np.nan
    return result
