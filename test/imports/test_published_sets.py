"""The published recordings come out with the figures that are known of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.bags import read_recording
from twbr_estimation.cli.main import main
from twbr_estimation.errors import RecordingError
from twbr_estimation.imports import ImportedLog, ImportOptions, load
from twbr_estimation.imports.broad import COUNTS_PER_TURN, WHEEL_RADIUS, wheel_angle
from twbr_estimation.recording import FloatArray, TiltTrack


def mse_deg2(stamps: np.ndarray, tilt: FloatArray, reference: TiltTrack) -> float:
    """Return the mean squared difference where the reference has samples nearby [deg^2]."""
    inside = (stamps >= reference.stamps[0]) & (stamps <= reference.stamps[-1])
    error = tilt[inside] - np.interp(stamps[inside], reference.stamps, reference.tilt)
    return float(np.mean(np.degrees(error) ** 2))


def accelerometer_mse(log: ImportedLog) -> float:
    imu, reference = log.recording.imu, log.recording.reference
    assert reference is not None
    return mse_deg2(imu.stamps, np.arctan2(-imu.accel[:, 0], imu.accel[:, 2]), reference)


@pytest.mark.parametrize(
    ("name", "accelerometer", "dmp"), [("slow", 1.14, 0.71), ("medium", 14.6, 0.88)]
)
def test_uiuc(shared_data: Path, name: str, accelerometer: float, dmp: float) -> None:
    log = load(shared_data / "uiuc_mpu6050_encoder" / f"raw_pitch_{name}.mat", "uiuc")
    assert accelerometer_mse(log) == pytest.approx(accelerometer, rel=0.01)
    chip, reference = log.recording.estimators["dmp"], log.recording.reference
    assert reference is not None
    assert mse_deg2(chip.stamps, chip.tilt, reference) == pytest.approx(dmp, rel=0.01)
    rate = np.gradient(reference.tilt, reference.stamps * 1e-9)
    gyro = np.interp(reference.stamps, log.recording.imu.stamps, log.recording.imu.gyro[:, 1])
    assert np.corrcoef(rate, gyro)[0, 1] > 0.7
    assert sum(log.recording.repairs.values()) == {"slow": 18, "medium": 13}[name]


@pytest.mark.parametrize(("file", "expected"), [("12_*.mat", 19.9), ("25_*.mat", 225.0)])
def test_broad_axis_y(shared_data: Path, file: str, expected: float) -> None:
    (path,) = (shared_data / "broad_translation").glob(file)
    log = load(path, "broad", ImportOptions(axis="y"))
    imu, reference = log.recording.imu, log.recording.reference
    assert reference is not None
    scored = np.isin(imu.stamps, reference.stamps)
    tilt = np.arctan2(-imu.accel[:, 0], imu.accel[:, 2])
    error = np.degrees(tilt[scored] - reference.tilt)
    assert np.mean(error**2) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_broad_gyro_wheels_and_reference_agree(shared_data: Path, axis: str) -> None:
    (path,) = (shared_data / "broad_translation").glob("12_*.mat")
    log = load(path, "broad", ImportOptions(axis=axis))
    recording = log.recording
    assert recording.reference is not None and recording.wheels is not None
    stamps = recording.reference.stamps
    rows = np.searchsorted(recording.imu.stamps, stamps)
    kernel = np.hanning(30) / np.hanning(30).sum()
    rate = np.gradient(np.convolve(recording.reference.tilt, kernel, "same"), stamps * 1e-9)
    gyro = np.convolve(recording.imu.gyro[:, 1], kernel, "same")[rows]
    assert np.corrcoef(gyro[30:-30], rate[30:-30])[0, 1] > 0.95
    pulses = recording.wheels.angle[:, 0] * COUNTS_PER_TURN / (2.0 * math.pi)
    np.testing.assert_allclose(pulses, np.rint(pulses), atol=1e-6)
    # Specific force is the acceleration of the path plus g * sin(tilt), here smoothed to 0.1 s.
    wheel = np.interp(recording.imu.stamps, recording.wheels.stamps, recording.wheels.angle[:, 0])
    path_along = WHEEL_RADIUS * wheel
    smooth = np.convolve(path_along, kernel, "same")
    acceleration = np.gradient(np.gradient(smooth)) * (1e9 / 3.5e6) ** 2
    force = np.convolve(recording.imu.accel[:, 0], kernel, "same")[rows]
    lean = -9.80665 * np.sin(recording.reference.tilt)
    assert np.corrcoef(force - lean, acceleration[rows])[0, 1] > 0.95


def test_a_virtual_wheel_counts_whole_pulses_forward() -> None:
    position = np.column_stack([np.linspace(0.0, 1.0, 500), np.zeros(500), np.zeros(500)])
    forward = np.tile(np.eye(3), (500, 1, 1))
    angle = wheel_angle(position, forward)
    pulse = 2.0 * math.pi / COUNTS_PER_TURN
    np.testing.assert_allclose(angle, position[:, 0] / WHEEL_RADIUS, atol=1.001 * pulse)
    assert np.all(np.diff(angle) >= 0.0)
    np.testing.assert_allclose(
        wheel_angle(position[::-1], forward)[-1], -1.0 / WHEEL_RADIUS, atol=pulse
    )
    sideways = position[:, [1, 0, 2]]
    np.testing.assert_array_equal(wheel_angle(sideways, forward), 0.0)


def test_static_sets(shared_data: Path) -> None:
    pytest.importorskip("h5py")
    folder = shared_data / "mpu6050_static"
    log = load(folder / "unmoved-with-x-pointing-forward-10min", "mpu6050-static")
    np.testing.assert_allclose(
        np.degrees(log.calibration.gyro_bias), [4.535, 0.047, 1.122], atol=0.0006
    )
    assert log.recording.dt == pytest.approx(1.0 / 99.4)
    assert np.mean(log.recording.imu.accel[:, 2]) == pytest.approx(9.80665, rel=0.05)
    turning = load(folder / "rotate-ccw-around-y-pointing-left", "mpu6050-static").recording
    assert turning.reference is None
    gyro = turning.imu.gyro[:, 1] - log.calibration.gyro_bias[1]
    accel = np.unwrap(np.arctan2(-turning.imu.accel[:, 0], turning.imu.accel[:, 2]))
    assert np.degrees(np.sum(gyro) / 99.4) == pytest.approx(720.0, abs=10.0)
    assert np.degrees(accel[-1] - accel[0]) == pytest.approx(720.0, abs=10.0)


def test_the_command_writes_a_recording_with_its_configuration(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("h5py")
    folder = shared_data / "mpu6050_static" / "unmoved-with-x-pointing-forward"
    arguments = ["import", str(folder), "--format", "mpu6050-static", "-o", str(tmp_path / "bag")]
    assert main(arguments) == 0
    assert "12243 IMU samples" in capsys.readouterr().out
    assert read_recording(tmp_path / "bag").imu.stamps.size == 12243
    assert (tmp_path / "bag" / "config" / "calibration.yaml").is_file()
    assert main(arguments) == 1
    assert "exists" in capsys.readouterr().err
    assert main([*arguments, "--overwrite"]) == 0


@pytest.mark.parametrize("name", ["uiuc", "broad", "mpu6050-static"])
def test_another_file_is_refused(tmp_path: Path, name: str) -> None:
    pytest.importorskip("h5py")
    path = tmp_path / "log.mat"
    path.write_text("not a MATLAB file")
    with pytest.raises(RecordingError, match="MATLAB"):
        load(path, name)
