"""`twbr check`: table, JSON and exit status."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from twbr_estimation.bags import write_recording
from twbr_estimation.cli.main import main
from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.simulation import simulate


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sound drive, and the same with its wheels counted backward."""
    folder = tmp_path_factory.mktemp("bags")
    simulated = simulate("W1", 0.005, 25.0, 12)
    write_simulated(folder / "sound", simulated)
    recording = simulated.recording
    assert recording.wheels is not None
    backward = replace(recording.wheels, angle=-recording.wheels.angle)
    changed = replace(recording, wheels=backward)
    write_simulated(folder / "backward", replace(simulated, recording=changed))
    write_recording(folder / "bare", recording)
    return folder


def test_a_sound_drive_passes(bags: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(bags / "sound")]) == 0
    printed = capsys.readouterr().out
    assert "FAIL" not in printed and "gyro, accelerometer and wheels agree" in printed
    assert max(map(len, printed.splitlines())) <= 80


def test_a_fault_fails_with_the_lines_to_change(
    bags: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(bags / "sound"), str(bags / "backward"), "--json", "-"]) == 1
    captured = capsys.readouterr()
    sound, backward = json.loads(captured.out)["recordings"]
    assert sound["worst"] in ("PASS", "SKIP", "WARN") and backward["worst"] == "FAIL"
    (failed,) = [each for each in backward["findings"] if each["severity"] == "FAIL"]
    assert failed["subject"] == "wheels" and failed["ratio"] == pytest.approx(-1.0, rel=0.2)
    assert "signs: [-1, -1]" in captured.err


def test_a_recording_without_a_robot_is_named(
    bags: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", str(bags / "bare")])
    assert "no robot" in capsys.readouterr().out
