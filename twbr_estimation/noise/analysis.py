"""The noise of one recording: angle errors while it moves, sensors where it rests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..drives import Drive
from ..errors import RecordingError
from ..recording import FloatArray, ImuTrack, Recording
from ..scoring.score import errors_of
from .allan import AllanCurve, allan_curve
from .rest import Drift, drift, longest_rest
from .spectra import AngleNoise, Spectrum, angle_noise, band_of, spectrum
from .uniform import UniformSpan, uniform_stretch

SHORTEST_REST = 10.0
"""Rest that serves for an Allan deviation [s]."""
SHORTEST_MOTION = 5.0
"""Recording with a reference that serves for spectra of the angle [s]."""
WINDOWS = 20
"""Windows for the drift of the bias where no length is given."""
GYRO_UNIT, ACCEL_UNIT = "deg/s", "m/s^2"
_NOTEWORTHY_JITTER = 0.05


@dataclass(frozen=True, slots=True)
class MotionSpectra:
    """Spectra of the angle's error, before and after the correction."""

    stretch: UniformSpan
    tilt: Spectrum
    """Of the reference [deg^2/Hz]."""
    band_hz: float
    """The motion's band ends here."""
    raw: AngleNoise
    """Of atan2 of the readings as they are."""
    corrected: AngleNoise
    """Of the corrected angle, Laddach 2022 (13)."""


@dataclass(frozen=True, slots=True)
class Rest:
    """The sensors where the robot stands still."""

    stretch: UniformSpan
    gyro_spectra: Mapping[str, Spectrum]
    """By axis [(deg/s)^2/Hz]."""
    allan: tuple[AllanCurve, ...]
    """Gyro and accelerometer, x to z."""
    gyro_drift: Drift
    """Means over windows [deg/s]."""
    gyro_bias: FloatArray
    """Mean over the whole rest [deg/s], (3,)."""


@dataclass(frozen=True, slots=True)
class RecordingNoise:
    """Noise analysis of one recording."""

    source: str
    motion: MotionSpectra | None
    """None without a reference."""
    rest: Rest | None
    """None where the robot does not stand still for long enough."""
    notes: tuple[str, ...] = field(default=())
    """Assumptions, and figures that could not be determined."""
    warnings: tuple[str, ...] = field(default=())
    """What the data show to be wrong with themselves, as a unit."""


def analyse(drive: Drive, window: float | None = None) -> RecordingNoise:
    """Return the noise of a recording.

    Args:
        drive: IMU, and a reference or a stretch at rest, or both.
        window: for the drift of the bias [s]; by default a twentieth of the rest.

    Raises:
        RecordingError: there is neither a reference nor enough rest.
    """
    recording = drive.recording
    if recording.imu.stamps.size < 2:
        raise RecordingError(
            f"{recording.source}: {recording.imu.stamps.size} IMU sample is too short a recording; "
            f"{SHORTEST_REST:g} s at rest or {SHORTEST_MOTION:g} s with a reference are needed"
        )
    notes: list[str] = []
    motion = _motion(drive, notes)
    rest = _rest(recording, window, notes)
    if motion is None and rest is None:
        raise RecordingError(f"{recording.source}: nothing to analyse: {'; '.join(notes)}")
    unique = tuple(dict.fromkeys(notes))
    return RecordingNoise(recording.source, motion, rest, unique, drive.doubts)


def motion_of(drive: Drive) -> MotionSpectra:
    """Return the spectra of the angle's error.

    Raises:
        RecordingError: no reference, or no stretch of it that is long enough.
    """
    association, stamps = drive.association, drive.recording.imu.stamps
    if association is None:
        raise RecordingError("no reference, so no error of the angle")
    first = int(stamps[0]) + round(drive.options.skip * 1e9)
    corrected = drive.corrected_samples.field("angle")
    raw = drive.uncorrected.corrected_samples.field("angle")
    there = association.at(stamps)
    error, known, _ = errors_of(stamps, corrected, there, first)
    raw_error, _, _ = errors_of(stamps, raw, there, first)
    stretch = uniform_stretch(stamps[known], "samples with a reference", SHORTEST_MOTION)
    inside = stretch.samples
    reference = np.degrees(there.tilt[known][inside])
    moved = spectrum(reference, stretch.period)
    return MotionSpectra(
        stretch,
        moved,
        band_of(moved),
        angle_noise(np.degrees(raw_error[inside]), reference, stretch.period),
        angle_noise(np.degrees(error[inside]), reference, stretch.period),
    )


def _motion(drive: Drive, notes: list[str]) -> MotionSpectra | None:
    try:
        motion = motion_of(drive)
    except RecordingError as error:
        notes.append(str(error))
        return None
    notes += _assumptions("spectra of the angle", motion.stretch)
    return motion


def _rest(recording: Recording, window: float | None, notes: list[str]) -> Rest | None:
    imu = recording.imu
    still = longest_rest(imu, recording.dt)
    lasted = (still.stop - still.start) * recording.dt
    if lasted < SHORTEST_REST:
        notes.append(
            f"the longest rest lasts {lasted:.3g} s; Allan deviation and bias need "
            f"{SHORTEST_REST:g} s"
        )
        return None
    try:
        stretch = uniform_stretch(imu.stamps[still], "samples at rest", SHORTEST_REST)
    except RecordingError as error:
        notes.append(str(error))
        return None
    notes += _assumptions("figures at rest", stretch)
    inside = slice(still.start + stretch.first, still.start + stretch.last)
    return rest_of(imu, inside, stretch, window or stretch.duration / WINDOWS)


def rest_of(imu: ImuTrack, inside: slice, stretch: UniformSpan, window: float) -> Rest:
    """Return the figures of equidistant samples at rest, averaged over windows [s]."""
    gyro, accel, period = np.degrees(imu.gyro[inside]), imu.accel[inside], stretch.period
    curves = [
        allan_curve(values[:, index], period, f"{sensor} {axis}", unit)
        for sensor, values, unit in (("gyro", gyro, GYRO_UNIT), ("accel", accel, ACCEL_UNIT))
        for index, axis in enumerate("xyz")
    ]
    return Rest(
        stretch,
        {axis: spectrum(gyro[:, index], period) for index, axis in enumerate("xyz")},
        tuple(curves),
        drift(gyro, period, window),
        gyro.mean(axis=0),
    )


def _assumptions(what: str, stretch: UniformSpan) -> list[str]:
    found = []
    if stretch.left_out:
        found.append(
            f"{what}: the longest stretch without a gap was used, "
            f"{stretch.duration:.3g} s; {stretch.left_out} samples left out"
        )
    if stretch.jitter > _NOTEWORTHY_JITTER * stretch.period:
        found.append(
            f"{what}: samples taken as equidistant at {1e3 * stretch.period:.4g} ms; their stamps "
            f"jitter by {1e3 * stretch.jitter:.3g} ms"
        )
    return found


def as_json(noise: RecordingNoise) -> dict[str, Any]:
    """Return the figures as plain data, spectra by their areas."""
    result: dict[str, Any] = {
        "source": noise.source,
        "notes": list(noise.notes),
        "warnings": list(noise.warnings),
    }
    if noise.motion is not None:
        result["motion"] = {
            **_stretch(noise.motion.stretch),
            "tilt_area_deg2": noise.motion.tilt.area(),
            "band_hz": noise.motion.band_hz,
            "raw": _angle(noise.motion.raw),
            "corrected": _angle(noise.motion.corrected),
        }
    if noise.rest is not None:
        result["rest"] = _rest_json(noise.rest)
    return result


def _rest_json(rest: Rest) -> dict[str, Any]:
    return {
        **_stretch(rest.stretch),
        "gyro_bias_deg_s": rest.gyro_bias.tolist(),
        "gyro_area_deg2_s2": {axis: entry.area() for axis, entry in rest.gyro_spectra.items()},
        "allan": {
            curve.axis: {
                "unit": curve.unit,
                "deviation": curve.marked(),
                "random_walk": curve.random_walk,
                "bias_instability": curve.bias_instability,
                "rate_random_walk": curve.rate_random_walk,
            }
            for curve in rest.allan
        },
        "drift": {
            "window_s": rest.gyro_drift.window,
            "means_deg_s": rest.gyro_drift.means.tolist(),
            "spread_deg_s": rest.gyro_drift.spread.tolist(),
        },
    }


def _stretch(stretch: UniformSpan) -> dict[str, float]:
    return {
        "duration_s": stretch.duration,
        "period_s": stretch.period,
        "jitter_s": stretch.jitter,
        "left_out": stretch.left_out,
    }


def _angle(noise: AngleNoise) -> dict[str, float | None]:
    return {
        "area_deg2": noise.area_deg2,
        "snr_db": noise.snr_db,
        "in_band_deg2": noise.in_band_deg2,
        "coherent_share": noise.coherent_share,
    }
