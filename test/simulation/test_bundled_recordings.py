"""The recordings in `bags/`: small, readable, described, and those the README names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.bags import read_recording
from twbr_estimation.configuration.files import read_setup

BAGS = Path(__file__).resolve().parents[2] / "bags"
NAMES = ("training", "verification")


def test_together_they_stay_small():
    assert sum(path.stat().st_size for path in BAGS.rglob("*") if path.is_file()) < 5_000_000


@pytest.mark.parametrize("name", NAMES)
def test_they_are_whole_and_described(name):
    recording = read_recording(BAGS / name)
    assert recording.dt == pytest.approx(0.002)
    assert recording.duration == pytest.approx(39.998)
    assert recording.wheels is not None and recording.reference is not None
    assert not recording.repairs
    assert read_setup(BAGS / name / "config").robot.lever_arm[2] == pytest.approx(0.135)
    commands = (BAGS / "README.md").read_text()
    source = (BAGS / name / "config" / "robot.yaml").read_text()
    seed = source.partition("seed ")[2].split("'")[0].strip()
    assert f"--seed {seed} --no-truth -o bags/{name}" in commands


def test_tuning_and_judging_use_different_drives():
    one, other = (read_recording(BAGS / name).imu.gyro for name in NAMES)
    assert not np.array_equal(one, other)
