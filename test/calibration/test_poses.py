"""Scale polynomials from held poses, against the sensor the rig hides."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from twbr_estimation.calibration.held_poses import held_poses
from twbr_estimation.calibration.poses import calibrate_poses
from twbr_estimation.calibration.scale import fit_scale
from twbr_estimation.calibration.still import StillOptions, calibrate_still
from twbr_estimation.errors import CalibrationError, RecordingError
from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.recording import ImuTrack, TiltTrack
from twbr_estimation.robot import Setup
from twbr_estimation.samples import Sample
from twbr_estimation.sensors.error_model import accel_reading
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.planar_sensing import imu_errors


@cache
def calibrated(world: str, seed: int):
    """Return the result for a robot of which nothing was known, and the robot."""
    still = simulate(world, 0.01, 30.0, seed, "still")
    biases = calibrate_still(still.recording, Setup(), StillOptions()).calibration
    poses = simulate(world, 0.01, 100.0, seed, "poses")
    return calibrate_poses(poses.recording, Setup(calibration=biases)), poses


@pytest.mark.parametrize(("world", "seed"), [("paper", 31), ("W2", 31), ("W2", 32)])
def test_hidden_scale_errors_are_undone(world, seed):
    found, simulated = calibrated(world, seed)
    true = simulated.true_setup.calibration
    errors = imu_errors(simulated.world, true, seed)
    for axis, scale in (("x", errors.scale_x), ("z", errors.scale_z)):
        fit, column = found.axes[axis].fit, "xyz".index(axis)
        bias = found.setup.calibration.accel_bias[column]
        force = np.linspace(fit.valid[0] + 0.2, fit.valid[1] - 0.2, 200)
        reading = [accel_reading(f, true.accel_bias[column], 0.0, scale, 0.0) for f in force]
        residual = fit.corrected(np.array(reading) - bias) - force
        assert np.sqrt(np.mean(residual**2)) < 0.05
        assert found.axes[axis].mse_after < 0.5 * found.axes[axis].mse_before


@pytest.mark.parametrize(("world", "seed"), [("paper", 31), ("W2", 31), ("W2", 32)])
def test_mounting_and_bias_are_separated(world, seed):
    found, simulated = calibrated(world, seed)
    true = simulated.true_setup
    pitch = found.setup.robot.mounting[1] - true.robot.mounting[1]
    assert found.pitch_used and abs(pitch) < max(3.0 * found.pitch_error, math.radians(0.01))
    forward = found.axes["x"]
    assert abs(forward.bias - true.calibration.accel_bias[0]) < 3.0 * forward.bias_error
    assert found.axes["z"].bias_error is None


def test_the_correction_does_what_the_fit_promised():
    found, _ = calibrated("paper", 31)
    corrector = Corrector(found.setup)
    values = (0.0, 0.0, 0.0, -20.0, 0.0, 8.0)
    corrected = corrector.step(Sample(0.0, *values))
    bias, axes = found.setup.calibration.accel_bias, found.axes
    x = axes["x"].fit.corrected(np.array([-20.0 - bias[0]]))[0]  # far outside: clamped
    z = axes["z"].fit.corrected(np.array([8.0 - bias[2]]))[0]
    turned = found.setup.robot.rotation() @ np.array([x, -bias[1], z])
    assert corrected.accel_x == pytest.approx(turned[0], abs=1e-9)
    assert corrected.accel_z == pytest.approx(turned[2], abs=1e-9)


def test_the_degree_that_made_the_data_is_chosen():
    generator = np.random.default_rng(8)
    p = np.linspace(-9.0, 9.0, 31)
    scale_error = 0.03 * p + 0.004 * p**2 - 0.0008 * p**3
    fit = fit_scale(p, p - scale_error + generator.normal(0.0, 0.002, p.size))
    assert len(fit.polynomial) == 3 and [each.degree for each in fit.degrees] == [*range(1, 11)]
    np.testing.assert_allclose(fit.polynomial, (0.03, 0.004, -0.0008), rtol=0.05)
    assert fit.valid == (-9.0, 9.0)
    assert fit.corrected(np.zeros(1))[0] == 0.0


def test_a_high_degree_is_well_conditioned():
    p = np.linspace(1.5, 9.9, 40)
    wanted = p - 0.05 * p * np.cos(1.1 * p)
    fit = fit_scale(p, wanted)
    assert len(fit.polynomial) == 10
    np.testing.assert_allclose(fit.corrected(p), wanted, atol=2e-3)


def test_poses_are_found_where_they_were_held():
    simulated = simulate("paper", 0.01, 40.1, 3, "poses")
    found = held_poses(simulated.recording)
    assert found.tilt.size == 10
    expected = np.concatenate([[0.0], np.linspace(-80.0, 80.0, 9)])
    np.testing.assert_allclose(np.degrees(found.tilt), expected, atol=0.1)
    # The first is held for four seconds, the others for three; the ends are left out.
    lengths = np.bincount(found.pose)
    assert 340 < lengths[0] < 400 and 240 < lengths[1:].min() and lengths.max() == lengths[0]


def test_recordings_without_poses_are_refused():
    simulated = simulate("paper", 0.01, 12.1, 3, "poses")
    recording = simulated.recording
    with pytest.raises(RecordingError, match="held at 3 angles, at least 5"):
        held_poses(recording)
    with pytest.raises(RecordingError, match="need a reference encoder"):
        held_poses(replace(recording, reference=None))
    long = simulate("paper", 0.01, 40.1, 3, "poses").recording
    small = TiltTrack(long.reference.stamps, 0.1 * long.reference.tilt)
    with pytest.raises(RecordingError, match=r"cover 16\.\d deg, at least 30"):
        held_poses(replace(long, reference=small))
    shaken = ImuTrack(
        long.imu.stamps,
        long.imu.gyro + 0.2 * np.sin(0.5 * np.arange(long.imu.stamps.size) * 0.01)[:, None],
        long.imu.accel,
    )
    with pytest.raises(RecordingError, match="held at"):
        held_poses(replace(long, imu=shaken))


@pytest.mark.parametrize(("unit", "sign"), [(1.0 / 9.80665, 1.0), (-1.0, 1.0), (1.0, -1.0)])
def test_another_unit_or_sign_is_no_scale_error(unit, sign):
    poses = simulate("paper", 0.01, 60.0, 3, "poses")
    imu, reference = poses.recording.imu, poses.recording.reference
    other = replace(
        poses.recording,
        imu=replace(imu, accel=unit * imu.accel),
        reference=replace(reference, tilt=sign * reference.tilt, rate=None),
    )
    calibrate_poses(poses.recording, poses.setup)
    with pytest.raises(CalibrationError, match=r"a scale is within 0\.7 and 1\.4"):
        calibrate_poses(other, poses.setup)
