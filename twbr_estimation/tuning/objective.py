"""What tuning makes small: the mean square error, with or without a price on lag and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..batch import CorrectedTrack, correct
from ..errors import RecordingError
from ..evaluation import Association, Options
from ..pairing import SampleTrack, pair
from ..recording import FloatArray, Recording
from ..robot import Robot, Setup


@dataclass(frozen=True, slots=True)
class Objective:
    """The figure of merit; MSE alone as in Laddach 2022 where both weights are zero."""

    delay_weight: float = 0.0
    """Price of lag [deg^2/ms^2]: 0.01 makes 10 ms as bad as 1 deg^2 of MSE."""
    roughness_weight: float = 0.0
    """Price of noise [s^2]: the mean square slope of the error [(deg/s)^2] times this."""

    def value(self, error: FloatArray, slope: FloatArray, dt: float) -> float:
        """Return the figure for one recording [deg^2].

        Args:
            error: estimate minus reference [rad], (n,).
            slope: the reference's rate [rad/s], (n,).
            dt: sampling period [s].
        """
        # No dot products: the linear algebra library's threads cost more than they save here.
        figure = float(np.mean(np.square(error)))
        if self.roughness_weight > 0.0:
            rough = np.diff(error) / dt
            figure += self.roughness_weight * float(np.mean(np.square(rough)))
        figure *= np.degrees(1.0) ** 2
        if self.delay_weight > 0.0:
            power = float(np.sum(np.square(slope)))
            delay_ms = -1e3 * float(np.sum(error * slope)) / power if power > 0.0 else 0.0
            figure += self.delay_weight * delay_ms**2
        return float(figure)


@dataclass(frozen=True, slots=True)
class TuningSet:
    """One recording, made ready for running filters on it many times."""

    source: str
    dt: float
    """Median sampling period [s]."""
    robot: Robot
    samples: SampleTrack
    corrected: CorrectedTrack
    reference: FloatArray
    """Reference at the stamps of the samples [rad], (n,); 0 where there is none."""
    known: NDArray[np.bool_]
    """Where there is a reference, (n,)."""
    slope: FloatArray
    """The reference's rate where it is known [rad/s], (k,)."""
    saturated: float
    """Share of samples with a saturated gyro or accelerometer."""

    def errors(self, tilt: FloatArray) -> FloatArray:
        """Return estimate minus reference where it is known [rad], (k,)."""
        error = (tilt - self.reference)[self.known]
        turn = 2.0 * np.pi
        return np.asarray(error - turn * np.round(error / turn), dtype=np.float64)


def prepare(recording: Recording, setup: Setup, options: Options | None = None) -> TuningSet:
    """Pair, correct and associate a recording once.

    Args:
        recording: it needs a reference.
        setup: robot, calibration and correction settings.
        options: delay and offset of the reference, time to skip at the start.

    Raises:
        RecordingError: there is no reference, or it does not overlap with the samples.
    """
    if recording.reference is None:
        raise RecordingError(f"{recording.source}: there is no reference to tune against")
    options = options or Options()
    samples = pair(recording.imu, recording.wheels)
    corrected = correct(samples, setup)
    reference, covered = Association(recording.reference, options).at(samples.stamps)
    begin = samples.stamps[:1] + round(options.skip * 1e9)
    known = covered & (samples.stamps >= begin)
    if int(known.sum()) < 2:
        raise RecordingError(f"{recording.source}: fewer than 2 samples have a reference")
    seconds = (samples.stamps - samples.stamps[0]) * 1e-9
    ordinary = setup.calibration.gyro_noise**2, setup.calibration.accel_noise**2
    return TuningSet(
        source=recording.source,
        dt=recording.dt,
        robot=setup.robot,
        samples=samples,
        corrected=corrected,
        reference=np.where(known, reference, 0.0),
        known=known,
        slope=np.gradient(reference, seconds)[known],
        saturated=_saturated(corrected, *ordinary),
    )


def _saturated(corrected: CorrectedTrack, gyro_variance: float, accel_variance: float) -> float:
    """Return the share of samples whose variance is inflated in the plane of the tilt."""
    gyro = corrected.field("gyro_variance_y") > 2.0 * gyro_variance
    accel = corrected.field("accel_variance_x") > 2.0 * accel_variance
    accel |= corrected.field("accel_variance_z") > 2.0 * accel_variance
    return float(np.mean(gyro | accel))
