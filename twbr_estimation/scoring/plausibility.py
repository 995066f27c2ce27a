"""What in a recording makes figures doubtful though every number in it can be used.

Units, signs and axes that are wrong, wheels that are missing or too slow, a reference too slow
to interpolate: nothing that a reader could repair, and nothing that a figure would show.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..pipeline.pairing import pair
from ..recording import Recording, TiltTrack
from ..robot import Setup
from ..samples import STANDARD_GRAVITY

GRAVITY_TOLERANCE = 0.3
"""Share by which the median specific force may differ from gravity."""
GAIN_LIMITS = (0.5, 2.0)
"""How far the gyro's turn may plausibly be from the reference's, as a ratio."""
WITHOUT_WHEEL = 0.01
"""A larger share of samples without a wheel reading is worth a warning."""
SLOW = 1.5
"""Wheels or reference this many times slower than the IMU are interpolated for real."""
INTERPOLATION_COST_DEG2 = 0.01
"""A larger error from interpolating the reference is worth a warning [deg^2]."""
_PROBES = 20_000  # samples looked at for their wheel reading
_TURN_TIME = 50_000_000  # [ns]; turns of gyro and reference are compared over it
_LEAST_TURN = 0.005  # rms turn [rad] below which there is nothing to compare


def doubts(recording: Recording, setup: Setup) -> Iterator[str]:
    """Yield what a user should know about a recording before trusting its figures."""
    force = float(np.median(np.linalg.norm(recording.imu.accel, axis=1)))
    if abs(force / STANDARD_GRAVITY - 1.0) > GRAVITY_TOLERANCE:
        yield (
            f"accelerometer: the median reading is {force:.3g} m/s^2 where gravity is "
            f"{STANDARD_GRAVITY:.3g}; it must be in m/s^2 and hold the axis that points up"
        )
    if setup.correction.wheel:
        yield from _wheel_doubts(recording)
    if recording.reference is not None and recording.reference.stamps.size > 2:
        yield from _turn_doubts(recording, recording.reference, setup)
        yield from _interpolation_doubts(recording.dt, recording.reference)


def _wheel_doubts(recording: Recording) -> Iterator[str]:
    if recording.wheels is None:
        yield "no wheel encoder in the recording: the wheels' acceleration is not removed"
        return
    imu, thinned = recording.imu, slice(None, None, 1 + recording.imu.stamps.size // _PROBES)
    probes = replace(
        imu, stamps=imu.stamps[thinned], gyro=imu.gyro[thinned], accel=imu.accel[thinned]
    )
    without = float(np.mean(pair(probes, recording.wheels).field("wheel_count") == 0.0))
    if without > WITHOUT_WHEEL:
        yield (
            f"{100.0 * without:.3g} % of the samples have no wheel reading: the wheels' "
            "acceleration is not removed there"
        )
    period = _period(recording.wheels.stamps)
    if period > SLOW * recording.dt > 0.0:
        yield (
            f"wheel readings every {1e3 * period:.3g} ms, IMU samples every "
            f"{1e3 * recording.dt:.3g} ms: the wheels' acceleration comes in jerks; "
            "`terms` without wheel leave it out"
        )


def _turn_doubts(recording: Recording, reference: TiltTrack, setup: Setup) -> Iterator[str]:
    """Compare how far gyro and reference turn in equal times; a small delay matters little."""
    stamps, calibration = recording.imu.stamps, setup.calibration
    rate = (recording.imu.gyro - calibration.gyro_bias) * calibration.gyro_scale
    pitch = rate @ setup.robot.rotation()[1]
    angle = np.concatenate([[0.0], np.cumsum(pitch[1:] * np.diff(stamps) * 1e-9)])
    first = max(stamps[0], reference.stamps[0])
    last = min(stamps[-1], reference.stamps[-1])
    step = max(_TURN_TIME, round(2e9 * _period(reference.stamps)))
    grid = np.arange(first, last, step)
    if grid.size < 3:
        return
    turn = np.diff(np.interp(grid, stamps, angle))
    wanted = np.diff(np.interp(grid, reference.stamps, np.unwrap(reference.tilt)))
    power = float(np.mean(np.square(wanted)))
    if power < _LEAST_TURN**2:
        return
    gain = float(np.mean(turn * wanted)) / power
    if not GAIN_LIMITS[0] < gain < GAIN_LIMITS[1]:
        yield (
            f"the gyro turns {gain:.2g} times as far as the reference: check units and signs of "
            "both (rad/s, rad, positive leaning forward), `robot.mounting` and the topics"
        )


def _interpolation_doubts(dt: float, reference: TiltTrack) -> Iterator[str]:
    """Judge linear interpolation by predicting each reference sample from its neighbours.

    At the middle of two periods it errs four times as much as in the middle of one, and the
    mean square over a period is 8/15 of that in the middle.
    """
    period, tilt = _period(reference.stamps), np.unwrap(reference.tilt)
    if period <= SLOW * dt:
        return
    whole = np.diff(reference.stamps) < 1.5e9 * period  # gaps are not interpolated
    residual = (tilt[1:-1] - 0.5 * (tilt[:-2] + tilt[2:]))[whole[1:] & whole[:-1]]
    if not residual.size:
        return
    cost = float(np.mean(np.square(np.degrees(residual)))) / 16.0 * 8.0 / 15.0
    if cost > INTERPOLATION_COST_DEG2:
        yield (
            f"the reference comes every {1e3 * period:.3g} ms: interpolating it adds about "
            f"{cost:.2g} deg^2 to every MSE, or more where it misses whole swings"
        )


def _period(stamps: np.ndarray) -> float:
    return float(np.median(np.diff(stamps))) * 1e-9 if stamps.size > 1 else 0.0
