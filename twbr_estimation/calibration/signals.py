"""One drive on an even time grid, and the smoothing both sides of every equation share.

Encoders are differentiated by convolution with derivatives of a Gaussian, and what they are
compared with is convolved with the Gaussian itself. So both sides see the same low-pass, and
no time constant enters the estimates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..drives import Drive
from ..errors import RecordingError
from ..recording import FloatArray, Recording, StampArray, TiltTrack, WheelTrack

LONGEST_GAP = 0.05
"""Longest time between readings that is bridged [s]."""
SHORTEST_DRIVE = 10.0
"""Shortest drive that is accepted [s]."""
_LONGEST_STEP = 10_000_000_000
"""Longer gaps between readings are shortened to this [ns]."""
REACH = 5.0
"""Reach of the smoothing, in its standard deviations; cut at 4, the second derivative of a
parabola would be a per cent wrong."""

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Signals:
    """Calibrated readings in body axes at even times; n of them."""

    time: FloatArray
    """Time since the first reading [s], (n,)."""
    dt: float
    gyro: FloatArray
    """Rate about y [rad/s], (n,)."""
    accel_x: FloatArray
    """Specific force [m/s^2], (n,)."""
    accel_z: FloatArray
    gyro_usable: BoolArray
    """Where the gyro is not saturated and readings are not missing, (n,)."""
    accel_usable: BoolArray
    reference: tuple[FloatArray, FloatArray]
    """Times [s] and tilts [rad] of the reference."""
    wheel: tuple[FloatArray, FloatArray] | None
    """Times [s] and angles [rad] of the wheel encoder, mean of the wheels."""

    def tilt(self, delay: float) -> FloatArray:
        """Return the reference as it read `delay` before each time [rad], (n,)."""
        tilt: FloatArray = np.interp(self.time - delay, *self.reference)
        return tilt

    def turned(self, delay: float) -> FloatArray:
        """Return the wheel encoder as it read `delay` before each time [rad], (n,)."""
        if self.wheel is None:
            raise RecordingError("there is no wheel encoder")
        turned: FloatArray = np.interp(self.time - delay, *self.wheel)
        return turned

    def smooth(self, values: FloatArray, width: float, order: int = 0) -> FloatArray:
        """Return a derivative of `values` under a Gaussian of standard deviation `width` [s]."""
        from scipy.ndimage import gaussian_filter1d

        steps = width / self.dt
        smoothed: FloatArray = gaussian_filter1d(
            values, steps, order=order, mode="nearest", truncate=REACH
        )
        return smoothed / self.dt**order

    def rows(self, usable: BoolArray, width: float) -> NDArray[np.int64]:
        """Return the indices to compare at: every half width, away from ends and bad readings."""
        from scipy.ndimage import minimum_filter1d

        reach = math.ceil(REACH * width / self.dt)
        clear = minimum_filter1d(usable.astype(np.uint8), 2 * reach + 1) > 0
        clear[: reach + 1] = clear[-reach - 1 :] = False
        every = max(int(0.5 * width / self.dt), 1)
        chosen = np.flatnonzero(clear)
        return np.asarray(chosen[chosen % every == 0], dtype=np.int64)


def signals_of(drive: Drive) -> Signals:
    """Return a recording's signals, calibrated and turned into body axes.

    Raises:
        RecordingError: no reference, or too short.
    """
    recording, wheels = drive.recording, drive.recording.wheels
    reference = _required_reference(recording)
    corrected = drive.with_terms().corrected_samples
    shortened = _without_long_gaps(recording.imu.stamps)
    stamps = shortened(recording.imu.stamps)
    time = np.arange(0.0, stamps[-1], recording.dt)
    rate, forward, up = (
        np.interp(time, stamps, corrected.field(name)) for name in ("gyro_y", "accel_x", "accel_z")
    )

    def usable(*flags: str) -> BoolArray:
        """Return where no reading is missing and none saturated."""
        flagged = np.max([corrected.field(name) for name in flags], axis=0)
        saturated = np.interp(time, stamps, flagged)
        return np.asarray((saturated == 0.0) & _present(time, stamps), dtype=np.bool_)

    return Signals(
        time=time,
        dt=recording.dt,
        gyro=rate,
        accel_x=forward,
        accel_z=up,
        gyro_usable=usable("gyro_saturated_y"),
        accel_usable=usable("accel_saturated_x", "accel_saturated_z"),
        reference=(shortened(reference.stamps), reference.tilt),
        wheel=None if wheels is None else (shortened(wheels.stamps), _mean_angle(wheels)),
    )


def _required_reference(recording: Recording) -> TiltTrack:
    if recording.reference is None:
        raise RecordingError(
            f"{recording.source}: geometry needs a reference encoder, there is none"
        )
    if recording.duration < SHORTEST_DRIVE:
        raise RecordingError(
            f"{recording.source}: {recording.duration:.2f} s are too short, "
            f"{SHORTEST_DRIVE:g} s of driving are needed"
        )
    return recording.reference


def _without_long_gaps(stamps: StampArray) -> Callable[[StampArray], FloatArray]:
    """Return the function from stamps [ns] to times since the first [s], long gaps shortened.

    A clock that is set in the middle of a recording leaves a gap of years, which an even grid
    must not fill. Shortened, it still separates what lies before and after.
    """
    start = int(stamps[0])
    steps = np.diff(stamps)
    long = np.flatnonzero(steps > _LONGEST_STEP)
    excess = np.concatenate([[0], np.cumsum(steps[long] - _LONGEST_STEP)])
    ends = stamps[long + 1]

    def shortened(others: StampArray) -> FloatArray:
        passed = np.searchsorted(ends, others, side="right")
        times = others - start - excess[passed]
        if ends.size:  # what lies in a gap is squeezed to its beginning
            following = np.append(ends - start - excess[1:], np.iinfo(np.int64).max)[passed]
            times = np.minimum(times, following - 1)
        return np.asarray(times * 1e-9, dtype=np.float64)

    return shortened


def _mean_angle(wheels: WheelTrack) -> FloatArray:
    return np.asarray(wheels.angle.mean(axis=1), dtype=np.float64)


def _present(time: FloatArray, stamps: FloatArray) -> BoolArray:
    """Return where two readings around a time are near enough to interpolate."""
    after = np.clip(np.searchsorted(stamps, time), 1, stamps.size - 1)
    return np.asarray(stamps[after] - stamps[after - 1] <= LONGEST_GAP, dtype=np.bool_)
