"""Three recordings, three commands, and a configuration that serves."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from twbr_estimation.bags import write_recording
from twbr_estimation.cli.main import main
from twbr_estimation.configuration.files import read_settings, read_setup, write_section
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.worlds import PAPER

WORLD = replace(
    PAPER,
    lever_arm_error=0.02,
    wheel_radius_error=0.05,
    mounting_error_deg=1.0,
    slips_per_second=0.2,
)
"""A robot whose geometry nobody measured; the signs of the errors vary by seed."""
SEED = 51


def robot_of(seed):
    return simulate(WORLD, 0.01, 0.05, seed).true_setup.robot


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    """Recordings of one robot without any description: a rest, poses and a drive."""
    folder = tmp_path_factory.mktemp("bags")
    scenes = {"still": (0.01, 30.0), "poses": (0.01, 80.0), "drive": (0.004, 40.0)}
    for scene, (dt, seconds) in scenes.items():
        write_recording(folder / scene, simulate(WORLD, dt, seconds, SEED, scene).recording)
    return folder


@pytest.fixture(scope="module")
def calibrated(bags):
    """The folder that the three commands make."""
    output = bags / "robot"
    for kind, bag in (("still", "still"), ("poses", "poses"), ("geometry", "drive")):
        arguments = ["calibrate", kind, str(bags / bag), "-o", str(output), "--overwrite"]
        assert main(arguments) == 0
    return output


def mse(bag, *config):
    target = bag.parent / "scores.json"
    arguments = ["evaluate", str(bag), "--filter", "complementary", *map(str, config)]
    assert main([*arguments, "--json", str(target)]) == 0
    scores = json.loads(target.read_text())
    return scores["mean"]["complementary"]["mse_deg2"]


def test_a_fresh_drive_is_estimated_better(bags, calibrated):
    # Other seeds are other drives; those with the same signs are drives of the same robot.
    seeds = [seed for seed in range(60, 90) if robot_of(seed) == robot_of(SEED)]
    before, after = [], []
    for seed in seeds[:2]:
        fresh = bags / f"fresh{seed}"
        write_recording(fresh, simulate(WORLD, 0.004, 40.0, seed).recording)
        before.append(mse(fresh))
        after.append(mse(fresh, "--config", calibrated))
    assert len(seeds) >= 2
    assert all(new < old for new, old in zip(after, before, strict=True)), (before, after)


def test_the_files_say_where_each_value_comes_from(bags, calibrated):
    text = (calibrated / "calibration.yaml").read_text()
    for kind, bag in (("still", "still"), ("poses", "poses"), ("geometry", "drive")):
        assert f"{kind}:" in text and str(bags / bag) in text
    robot = read_setup(calibrated).robot
    true = robot_of(SEED)
    assert robot.wheel_radius == pytest.approx(true.wheel_radius, rel=0.01)
    assert robot.lever_arm[2] == pytest.approx(true.lever_arm[2], abs=0.003)


def test_nothing_is_overwritten_without_saying_so(bags, calibrated, capsys):
    before = (calibrated / "calibration.yaml").read_text()
    arguments = ["calibrate", "still", str(bags / "still"), "-o", str(calibrated)]
    assert main(arguments) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert (calibrated / "calibration.yaml").read_text() == before


def test_without_an_output_nothing_is_written(bags, capsys):
    assert main(["calibrate", "still", str(bags / "still"), "--json", "-"]) == 0
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    bias = document["estimates"]["gyro bias y"]
    assert bias["unit"] == "rad/s" and bias["standard_error"] > 0.0
    assert len(document["gyro_windows"]) == 50
    assert "nothing written" in captured.err


def test_what_is_not_estimated_is_kept(bags, tmp_path, capsys):
    start, output = tmp_path / "start", tmp_path / "output"
    told = simulate(WORLD, 0.01, 0.05, SEED).setup
    write_section(start / "robot.yaml", told.robot)
    quality = {"ins_odometer": {"accel_residual": 0.02}}
    write_section(
        start / "calibration.yaml", told.calibration, {"source": "by hand"}, False, quality
    )
    (start / "filters.yaml").write_text("/**:\n  ros__parameters:\n    filter: gyro\n")
    still = ["calibrate", "still", str(bags / "still"), "-o", str(output)]
    assert main([*still, "--config", str(start)]) == 0
    assert "filters.yaml" in capsys.readouterr().out
    setup = read_setup(output)
    assert setup.robot == told.robot
    assert setup.calibration.accel_scale_x == told.calibration.accel_scale_x
    assert setup.calibration.gyro_bias != told.calibration.gyro_bias
    assert "by hand" in (output / "calibration.yaml").read_text()
    assert read_settings(output).values == quality
    (output / "calibration.yaml").write_text(
        "/**:\n  ros__parameters:\n    calibration: {gyro_noise: 0.1}\n    filter: gyro\n"
    )
    assert main([*still, "--overwrite"]) == 1
    assert "would lose" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("kind", "bag", "said"),
    [
        ("still", "poses", "the robot moved"),
        ("poses", "still", "held at 1 angle, at least"),
    ],
)
def test_the_wrong_recording_is_refused(bags, kind, bag, said, capsys):
    assert main(["calibrate", kind, str(bags / bag)]) == 1
    assert said in capsys.readouterr().err
