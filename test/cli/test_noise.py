"""`twbr noise` as a user meets it, on a drive, at rest, and on a real MPU6050 at rest."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.bags import write_recording
from twbr_estimation.cli.main import main
from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.recording import ImuTrack
from twbr_estimation.simulation import simulate

pytest.importorskip("allantools", reason="the extra `noise` is not installed")


def figures(capsys: pytest.CaptureFixture[str], *arguments: object) -> list[dict]:
    assert main(["noise", *map(str, arguments), "--json", "-"]) == 0
    return json.loads(capsys.readouterr().out)["recordings"]


@pytest.fixture(scope="module")
def still(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("noise") / "still"
    write_recording(path, simulate("paper", 0.005, 30.0, 51, "still").recording)
    return path


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("noise") / "drive"
    write_simulated(path, simulate("paper", 0.002, 20.0, 52))
    return path


def test_the_static_mpu6050_has_the_published_figures(shared_data, tmp_path, capsys) -> None:
    pytest.importorskip("h5py", reason="these files are HDF5")
    folder = shared_data / "mpu6050_static" / "unmoved-with-x-pointing-forward-10min"
    bag = tmp_path / "still"
    assert main(["import", str(folder), "--format", "mpu6050-static", "-o", str(bag)]) == 0
    capsys.readouterr()
    rest = figures(capsys, bag)[0]["rest"]
    deviation = rest["allan"]["gyro y"]["deviation"]
    for time, published in (("1 s", 0.0092), ("10 s", 0.0029), ("100 s", 0.0014)):
        assert deviation[time] == pytest.approx(published, rel=0.2)
    assert rest["gyro_bias_deg_s"] == pytest.approx([4.535, 0.047, 1.122], abs=0.001)


def test_a_robot_at_rest_shows_the_simulated_noise(still, capsys) -> None:
    rest = figures(capsys, still, "--window", 5)[0]["rest"]
    walk = rest["allan"]["gyro y"]["random_walk"]
    assert walk == pytest.approx(0.1018 * np.sqrt(0.005), rel=0.15)
    assert rest["gyro_area_deg2_s2"]["y"] == pytest.approx(0.1018**2, rel=0.15)
    assert len(rest["drift"]["means_deg_s"]) == 6


def test_the_correction_takes_the_motion_out_of_the_angle_s_error(driven, capsys) -> None:
    found = figures(capsys, driven)[0]
    raw, corrected = found["motion"]["raw"], found["motion"]["corrected"]
    assert corrected["in_band_deg2"] < 0.3 * raw["in_band_deg2"]
    following = [entry["coherent_share"] * entry["area_deg2"] for entry in (raw, corrected)]
    assert following[1] < following[0]
    assert corrected["snr_db"] > raw["snr_db"]
    assert "rest" not in found
    assert any("longest rest" in note for note in found["notes"])


def test_table_and_picture(still, driven, tmp_path, capsys) -> None:
    picture = tmp_path / "noise.png"
    assert main(["noise", str(still), str(driven), "--plot", str(picture)]) == 0
    printed = capsys.readouterr().out
    assert "Allan deviation" in printed and "error of the angle" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["noise", str(still), "--plot", str(picture)]) == 1
    assert "--overwrite replaces it" in capsys.readouterr().err


def test_a_picture_of_several_remembers_them_and_leaves_out_what_fails(
    still, driven, tmp_path, capsys
) -> None:
    picture, table = tmp_path / "noise.png", tmp_path / "noise.jsonl"
    short = simulate("paper", 0.005, 4.0, 54, "still").recording
    write_recording(tmp_path / "short", replace(short, reference=None, truth=None))
    bags = [str(still), str(driven), str(tmp_path / "short")]
    command = ["noise", *bags, "--results", str(table), "--jobs", "2", "--overwrite"]
    assert main([*command, "--plot", str(picture), "--json", str(tmp_path / "a.json")]) == 1
    assert "nothing to analyse" in capsys.readouterr().err
    rows = table.read_text().splitlines()
    assert len(rows) == 3
    first = picture.read_bytes()
    assert first.startswith(b"\x89PNG")
    document = json.loads((tmp_path / "a.json").read_text())
    assert [each["source"] for each in document["recordings"]] == bags[:2]
    assert not any("curves" in each for each in document["recordings"])
    assert main([*command, "--plot", str(picture)]) == 1
    done = [json.loads(row) for row in table.read_text().splitlines()]
    assert sum(row["result"] is not None for row in done) == 2  # not computed again
    assert picture.read_bytes() == first


def test_gaps_and_jitter_are_reported(still, tmp_path, capsys) -> None:
    recording = simulate("paper", 0.005, 30.0, 53, "still").recording
    imu, generator = recording.imu, np.random.default_rng(5)
    keep = np.r_[0:1500, 1600 : imu.stamps.size]
    jitter = generator.integers(-2_000_000, 2_000_000, keep.size)
    late = ImuTrack(imu.stamps[keep] + jitter, imu.gyro[keep], imu.accel[keep])
    write_recording(tmp_path / "bag", replace(recording, imu=late, reference=None, truth=None))
    found = figures(capsys, tmp_path / "bag")[0]
    notes = " ".join(found["notes"])
    assert "1500 samples left out" in notes
    assert "jitter by" in notes
    assert found["rest"]["duration_s"] == pytest.approx(22.0, abs=0.6)


def test_a_wrong_unit_is_a_warning(tmp_path, capsys) -> None:
    recording = simulate("paper", 0.005, 15.0, 55, "still").recording
    imu = replace(recording.imu, accel=recording.imu.accel / 9.80665)
    write_recording(tmp_path / "bag", replace(recording, imu=imu, reference=None, truth=None))
    assert main(["noise", str(tmp_path / "bag")]) == 0
    assert "warning: accelerometer: its median reading is" in capsys.readouterr().out
    warnings = " ".join(figures(capsys, tmp_path / "bag")[0]["warnings"])
    assert "it is in g; give m/s^2" in warnings


def test_a_recording_without_anything_to_analyse_is_refused(tmp_path, capsys) -> None:
    recording = simulate("paper", 0.005, 4.0, 54, "still").recording
    write_recording(tmp_path / "bag", replace(recording, reference=None, truth=None))
    assert main(["noise", str(tmp_path / "bag")]) == 1
    message = capsys.readouterr().err
    assert "nothing to analyse" in message and "the longest rest lasts 4 s" in message
    assert main(["noise", str(tmp_path / "bag"), "--window", "-1"]) == 1
