from __future__ import annotations

import numpy as np
import pytest

from twbr_estimation.bags import read_recording
from twbr_estimation.cli.main import main
from twbr_estimation.configuration.files import read_setup
from twbr_estimation.simulation import simulate


def test_the_bag_holds_what_was_simulated(tmp_path, capsys):
    bag = tmp_path / "drive"
    arguments = ["simulate", "--world", "W2", "--dt", "0.01", "--duration", "3", "--seed", "5"]
    assert main([*arguments, "-o", str(bag)]) == 0
    shown = capsys.readouterr().out
    assert "300" in shown and "falls" in shown and "saturated" in shown
    simulated = simulate("W2", 0.01, 3.0, 5)
    recording = read_recording(bag)
    np.testing.assert_array_equal(recording.imu.gyro, simulated.recording.imu.gyro)
    np.testing.assert_array_equal(recording.imu.accel, simulated.recording.imu.accel)
    np.testing.assert_array_equal(recording.truth.tilt, simulated.recording.truth.tilt)
    np.testing.assert_array_equal(recording.reference.tilt, simulated.recording.reference.tilt)
    assert read_setup(bag / "config").robot == simulated.setup.robot
    assert read_setup(bag / "config").calibration == simulated.setup.calibration


def test_the_truth_can_be_left_out(tmp_path):
    bag = tmp_path / "drive"
    assert main(["simulate", "--duration", "1", "--no-truth", "-o", str(bag)]) == 0
    assert read_recording(bag).truth is None


def test_an_existing_recording_stays_without_overwrite(tmp_path, capsys, monkeypatch):
    bag = str(tmp_path / "drive")
    once = ["simulate", "--duration", "1", "--scene", "still", "-o", bag]
    assert main(once) == 0
    with monkeypatch.context() as patched:  # refused before anything is simulated
        patched.setattr("twbr_estimation.cli.simulate.simulated_by", None)
        assert main(once) == 1
    assert "exists already; --overwrite" in capsys.readouterr().err
    assert main([*once, "--overwrite"]) == 0


def test_a_period_that_cannot_be_simulated(tmp_path, capsys):
    assert main(["simulate", "--dt", "0.0007", "-o", str(tmp_path / "bag")]) == 1
    assert "multiple of the step" in capsys.readouterr().err
    assert not (tmp_path / "bag").exists()


def test_an_unknown_world_is_a_usage_error(tmp_path):
    with pytest.raises(SystemExit) as stop:
        main(["simulate", "--world", "mars", "-o", str(tmp_path / "bag")])
    assert stop.value.code == 2
