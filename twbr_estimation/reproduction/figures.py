"""Figs 9 to 12: scale errors, spectra of the noise, and one drive."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..batch import run_filter
from ..calibration.held_poses import held_poses
from ..calibration.poses import AXES, PosesResult, calibrate_poses
from ..calibration.stillness import specific_force
from ..drives import Drive
from ..filters import filter_named
from ..noise import spectrum
from ..noise.analysis import motion_of
from ..recording import FloatArray, Recording
from ..robot import Setup
from ..simulation import World, simulate
from .drives import TRAINING_SEEDS, Plan, drives
from .printed import ANGLE_SNR_DB, FIGURE_12, SCALE_MSE
from .tables import printed_settings

POSES_DT, POSES_DURATION = 0.002, 84.0
"""A pose is held every 4 s: 20 angles."""
SPECTRA_DT = 0.002


def scale_errors(plan: Plan) -> list[dict[str, Any]]:
    """Return Figs 9 and 10: MSE of each axis before and after the scale polynomial.

    The polynomial comes from a training drive's poses; the figures are those of others.
    """
    recording, setup = _poses(plan.world, TRAINING_SEEDS[0])
    found = calibrate_poses(recording, setup)
    seeds = range(1, plan.seeds + 1)
    pairs = [_judged(_poses(plan.world, seed)[0], found) for seed in seeds]
    rows = []
    for axis, (before, after) in SCALE_MSE.items():
        mean = np.mean([each[axis] for each in pairs], axis=0)
        rows.append(
            {
                "axis": axis,
                "printed": {"before": before, "after": after},
                "rig": {
                    "before": float(mean[0]),
                    "after": float(mean[1]),
                    "degree": len(found.axes[axis].fit.polynomial),
                },
            }
        )
    return rows


def _poses(world: World, seed: int) -> tuple[Recording, Setup]:
    """Return held poses, and a setup with the biases but without scale errors."""
    made = simulate(world, POSES_DT, POSES_DURATION, seed, "poses")
    unknown = replace(made.setup.calibration, accel_scale_x=(), accel_scale_z=())
    return made.recording, replace(made.setup, calibration=unknown)


def _judged(recording: Recording, found: PosesResult) -> dict[str, tuple[float, float]]:
    poses = held_poses(recording)
    forces = np.array([specific_force(tilt, found.setup.robot) for tilt in poses.tilt])
    judged = {}
    for axis, result in found.axes.items():
        single = poses.readings[:, AXES[axis]] - result.bias
        wanted = forces[poses.pose, AXES[axis]]
        before, after = (
            float(np.mean(np.square(values - wanted)))
            for values in (single, result.fit.corrected(single))
        )
        judged[axis] = (before, after)
    return judged


def noise_spectra(plan: Plan) -> dict[str, Any]:
    """Return Fig. 11: areas under the spectra, signal to noise, and overlap with the motion."""
    correction, _ = printed_settings(SPECTRA_DT)
    found = []
    for seed in range(1, plan.seeds + 1):
        made = simulate(plan.world, SPECTRA_DT, plan.duration, seed)
        setup = replace(made.setup, correction=correction)
        found.append(motion_of(Drive(made.recording, setup)))
    still = simulate(plan.world, SPECTRA_DT, plan.duration, 1, "still").recording
    rest = spectrum(np.degrees(still.imu.gyro[:, 1]), SPECTRA_DT)
    return {
        "printed": {"corrected_snr_db": ANGLE_SNR_DB},
        "rig": {
            "raw_snr_db": _mean([each.raw.snr_db for each in found]),
            "corrected_snr_db": _mean([each.corrected.snr_db for each in found]),
            "raw_coherent_share": _mean([each.raw.coherent_share for each in found]),
            "corrected_coherent_share": _mean([each.corrected.coherent_share for each in found]),
            "raw_area_deg2": _mean([each.raw.area_deg2 for each in found]),
            "corrected_area_deg2": _mean([each.corrected.area_deg2 for each in found]),
            "gyro_at_rest_area_deg2_s2": rest.area(),
        },
    }


def _mean(values: list[Any]) -> float:
    return float(np.mean(values))


def one_drive(plan: Plan, picture: Path | None = None) -> dict[str, Any]:
    """Return the figures of Fig. 12's filter on the first reported drive, and draw them.

    Args:
        plan: which world.
        picture: file to draw reference, estimate and the readings' arctangent into.

    Raises:
        ConfigurationError: a picture is asked for and matplotlib is missing.
    """
    name, dt = FIGURE_12
    (each,) = drives(plan.world, dt, [1], plan.duration)
    entry = filter_named(name)
    parameters = entry.configure(printed_settings(dt)[1][name])
    tilt = run_filter(entry, parameters, each.corrected, each.setup.robot).tilt
    if picture is not None:
        forward, up = each.samples.field("accel_x"), each.samples.field("accel_z")
        seconds = (each.samples.stamps - each.samples.stamps[0]) * 1e-9
        lines = {
            "arctangent of the readings": np.arctan2(-forward, up),
            "estimate": tilt,
            "reference": each.reference,
        }
        _draw(picture, f"{name}, {1e3 * dt:g} ms, printed parameters", seconds, lines)
    error = np.degrees(each.errors(tilt))
    return {
        "filter": name,
        "dt": dt,
        "rig": {
            "mse_deg2": float(np.mean(np.square(error))),
            "largest_error_deg": float(np.max(np.abs(error))),
        },
    }


def _draw(path: Path, title: str, seconds: FloatArray, lines: dict[str, FloatArray]) -> None:
    from ..report.pictures import canvas, save

    figure, axes = canvas(1, 1, (12.0, 4.5))
    (plot,) = axes[0]
    for (label, tilt), width in zip(lines.items(), (0.3, 1.0, 1.0), strict=True):
        plot.plot(seconds, np.degrees(tilt), label=label, linewidth=width)
    plot.set(title=title, xlabel="time [s]", ylabel="tilt [deg]", ylim=(-60.0, 60.0))
    plot.grid(True, alpha=0.3)
    plot.legend(fontsize="small")
    save(figure, path)
