"""`twbr simulate --physics mujoco`."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest

from twbr_estimation.bags import read_recording
from twbr_estimation.bags.events import write_events
from twbr_estimation.cli.main import main
from twbr_estimation.configuration.files import read_setup, write_section
from twbr_estimation.physics import simulate
from twbr_estimation.recording import Event
from twbr_estimation.robot import Robot

ONCE = ["simulate", "--physics", "mujoco", "--scene", "lifted", "--dt", "0.01", "--duration", "8"]


def test_the_bag_holds_the_scene_with_truth_events_and_robot(tmp_path, capsys):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed: extra `physics`")
    bag, folder = tmp_path / "bag", tmp_path / "robot"
    folder.mkdir()
    robot = Robot(gyro_range=math.radians(500.0), wheel_radius=0.04, track_width=0.2)
    write_section(folder / "robot.yaml", robot, {}, replace=True)
    assert main([*ONCE, "--seed", "2", "--config", str(folder), "-o", str(bag)]) == 0
    assert "MuJoCo, scene lifted" in " ".join(capsys.readouterr().out.split())
    simulated, recording = simulate("lifted", 0.01, 8.0, 2, robot=robot), read_recording(bag)
    np.testing.assert_array_equal(recording.imu.accel, simulated.recording.imu.accel)
    np.testing.assert_array_equal(recording.wheels.angle, simulated.recording.wheels.angle)
    np.testing.assert_array_equal(recording.truth.tilt, simulated.recording.truth.tilt)
    header, *rows = csv.reader((bag / "events.csv").read_text().splitlines())
    assert header == ["event", "begin_ns", "end_ns"]
    assert [Event(name, int(begin), int(end)) for name, begin, end in rows] == [*simulated.events]
    assert simulated.events
    told = read_setup(bag / "config").robot
    assert (told.wheel_radius, told.track_width, told.gyro_range) == (
        0.04,
        0.2,
        pytest.approx(math.radians(500.0)),
    )
    assert main(["evaluate", str(bag), "--filter", "complementary"]) == 0


def test_without_mujoco_the_extra_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    assert main([*ONCE, "-o", str(tmp_path / "bag")]) == 1
    assert "pip install 'twbr_estimation[physics]'" in capsys.readouterr().err
    assert not (tmp_path / "bag").exists()


def test_scenes_of_one_physics_are_not_those_of_the_other(tmp_path, capsys):
    bag = ["-o", str(tmp_path / "bag")]
    assert main(["simulate", "--physics", "mujoco", "--scene", "poses", *bag]) == 1
    assert "there is no scene 'poses' of the physics engine" in capsys.readouterr().err
    assert main(["simulate", "--scene", "carried", *bag]) == 1
    assert "there is no scene 'carried'" in capsys.readouterr().err
    assert main(["simulate", "--clip-first", *bag]) == 1
    assert "need --physics mujoco" in capsys.readouterr().err


def test_where_nothing_happens_there_is_no_table_of_events(tmp_path):
    write_events(tmp_path, ())
    assert not list(tmp_path.iterdir())
