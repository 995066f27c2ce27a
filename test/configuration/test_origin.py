"""Configuration that comes from two folders, file by file."""

from __future__ import annotations

from pathlib import Path

import pytest

from twbr_estimation.configuration.files import write_section
from twbr_estimation.configuration.of_recording import configuration, origin_of
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.robot import Calibration, Robot

FILTERS = "/**:\n  ros__parameters:\n    filter: gyro\n"


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """Return a recording that describes its robot, and a folder with tuned filters only."""
    bag, tuned = tmp_path / "bag", tmp_path / "tuned"
    tuned.mkdir()
    write_section(bag / "config" / "robot.yaml", Robot(wheel_radius=0.05))
    write_section(bag / "config" / "calibration.yaml", Calibration(gyro_bias=(0.1, 0.2, 0.3)))
    (bag / "config" / "filters.yaml").write_text(FILTERS)
    (tuned / "filters.yaml").write_text(FILTERS.replace("gyro", "kalman"))
    return bag, tuned


def test_absent_files_come_from_the_recording(folders: tuple[Path, Path]) -> None:
    bag, tuned = folders
    setup, settings = configuration(bag, 0.01, tuned)
    assert settings.filter == "kalman"
    assert setup.robot.wheel_radius == 0.05
    assert setup.calibration.gyro_bias == (0.1, 0.2, 0.3)
    said = origin_of(bag, tuned)
    assert said == f"robot.yaml, calibration.yaml from {bag / 'config'}; filters.yaml from {tuned}"
    assert origin_of(bag) == ""


def test_a_file_of_the_folder_rules_over_that_of_the_recording(
    folders: tuple[Path, Path],
) -> None:
    bag, tuned = folders
    write_section(tuned / "robot.yaml", Robot(wheel_radius=0.07))
    assert configuration(bag, 0.01, tuned)[0].robot.wheel_radius == 0.07


def test_a_folder_without_any_file_is_refused(folders: tuple[Path, Path], tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"holds none of robot\.yaml"):
        configuration(folders[0], 0.01, tmp_path)
