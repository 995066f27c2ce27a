"""The drift of the gyro's bias with the chip's temperature, removed before anything else."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..robot import Calibration, Setup

if TYPE_CHECKING:  # a live stream needs no recordings, and a node starts sooner without
    from ..recording import Recording


def at_temperature(calibration: Calibration, temperature: float) -> Calibration:
    """Return the calibration whose gyro biases hold at a temperature [degC]."""
    if not any(calibration.gyro_bias_slope):
        return calibration
    warm = temperature - calibration.gyro_bias_temperature
    x, y, z = (
        bias + slope * warm
        for bias, slope in zip(calibration.gyro_bias, calibration.gyro_bias_slope, strict=True)
    )
    return replace(calibration, gyro_bias=(x, y, z), gyro_bias_temperature=temperature)


def without_temperature_drift(recording: Recording, setup: Setup) -> Recording:
    """Return a recording whose gyro reads as at the temperature at which the biases hold."""
    calibration, track = setup.calibration, recording.temperature
    if track is None or not track.stamps.size or not any(calibration.gyro_bias_slope):
        return recording
    imu = recording.imu
    warm = np.interp(imu.stamps, track.stamps, track.temperature)
    warm -= calibration.gyro_bias_temperature
    gyro = imu.gyro - warm[:, None] * np.array(calibration.gyro_bias_slope)
    return replace(recording, imu=replace(imu, gyro=gyro))
