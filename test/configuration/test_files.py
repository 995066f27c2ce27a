from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from twbr_estimation.configuration.files import (
    read_correction,
    read_settings,
    read_setup,
    write_section,
    write_settings,
)
from twbr_estimation.configuration.filter_settings import DEFAULT_FILTER, Settings
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.robot import Calibration, CorrectionSettings, EncoderPlacement, Robot, Setup
from twbr_estimation.sensors.mpu6050 import Mpu6050Settings

SHIPPED = Path(__file__).resolve().parents[2] / "config"
GRAVITY = 9.80665

ROBOT = Robot(
    wheel_radius=0.04,
    track_width=0.2,
    encoder_placement=EncoderPlacement.GROUND,
    lever_arm=(0.01, -0.02, -0.03),
    mounting=(0.1, 1e-7, -3.0),
)
CALIBRATION = Calibration(
    gyro_bias=(0.1, 1 / 3, -1e-9), accel_scale_x=(0.1, -1e-5), accel_valid_y=(-3.0, 4.0)
)


def parameter_file(path: Path, text: str, node: str = "/**") -> Path:
    indented = "".join(f"    {line}\n" for line in text.splitlines())
    path.write_text(f"{node}:\n  ros__parameters:\n{indented}")
    return path


def polynomial(coefficients: tuple[float, ...], argument: float) -> float:
    return sum(c * argument ** (power + 1) for power, c in enumerate(coefficients))


def test_the_shipped_example_is_the_robot_of_the_paper_with_the_drivers_ranges() -> None:
    setup = read_setup(SHIPPED)
    chip = Mpu6050Settings()
    ranges = {"gyro_range": chip.gyro_range, "accel_range": chip.accel_range}
    assert setup.robot == replace(Robot(), **ranges)
    assert math.degrees(setup.calibration.gyro_bias[1]) == pytest.approx(-1.91195)
    # (52) in the paper's axis x' = -x: a corrected x' must be minus a corrected x.
    printed = (0.04537, -0.00576, -0.00143, 0.00005, 0.00001)
    for argument in (-9.0, -1.0, 0.5, 8.0):
        assert polynomial(setup.calibration.accel_scale_x, -argument) == pytest.approx(
            -polynomial(printed, argument)
        )
    assert polynomial(setup.calibration.accel_scale_z, GRAVITY) == pytest.approx(-0.0565, abs=5e-5)
    assert setup.correction == CorrectionSettings(dt=0.002)


def test_the_shipped_filters_name_their_sampling_period() -> None:
    settings = read_settings(SHIPPED)
    assert settings.dt == 0.002
    assert settings.values and settings.filter == DEFAULT_FILTER
    assert settings.warnings(0.002) == ()
    assert "0.01 s" in settings.warnings(0.01)[0]


def test_a_folder_comes_back_as_it_was_written(tmp_path: Path) -> None:
    correction = CorrectionSettings(-0.00065, 0.1, euler=False, dt=0.02)
    settings = Settings({"complementary": {"time_constant": 1 / 7}}, "alpha_beta_wb", 0.02, "x")
    write_section(tmp_path / "robot.yaml", ROBOT)
    write_section(tmp_path / "calibration.yaml", CALIBRATION, {"source": "a test", "mse": 0.5})
    write_settings(tmp_path / "filters.yaml", settings, correction, {"source": "a test"})
    assert read_setup(tmp_path) == Setup(ROBOT, CALIBRATION, correction)
    assert read_settings(tmp_path) == replace(settings, source=str(tmp_path))


def test_the_shipped_example_comes_back_as_it_was_written(tmp_path: Path) -> None:
    setup, settings = read_setup(SHIPPED), read_settings(SHIPPED)
    write_section(tmp_path / "robot.yaml", setup.robot)
    write_section(tmp_path / "calibration.yaml", setup.calibration)
    write_settings(tmp_path / "filters.yaml", settings, setup.correction)
    assert read_setup(tmp_path) == setup
    assert read_settings(tmp_path).values == settings.values


def test_what_is_written_has_only_types_that_ros_parameters_have(tmp_path: Path) -> None:
    path = tmp_path / "calibration.yaml"
    write_section(path, CALIBRATION, {"source": "a test"})
    written = yaml.safe_load(path.read_text())["/**"]["ros__parameters"]["calibration"]
    for value in written.values():
        numbers = value if isinstance(value, list) else [value]
        assert numbers, "ROS has no type for an empty list"
        assert all(isinstance(number, float) for number in numbers)


def test_an_existing_file_is_kept_unless_replacing_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    write_section(path, Robot())
    with pytest.raises(ConfigurationError, match=r"robot\.yaml: exists"):
        write_section(path, ROBOT)
    assert read_setup(path).robot == Robot()
    write_section(path, ROBOT, replace=True)
    assert read_setup(path).robot == ROBOT
    assert [entry.name for entry in tmp_path.iterdir()] == ["robot.yaml"]


def test_what_is_left_out_keeps_its_default(tmp_path: Path) -> None:
    path = parameter_file(tmp_path / "a.yaml", "robot: {wheel_radius: 0.05}")
    assert read_setup(path) == Setup(Robot(wheel_radius=0.05))
    assert read_correction(path) is None
    assert read_settings(path) == Settings(source=str(path))
    assert read_settings(path).filter == DEFAULT_FILTER


def test_of_several_files_the_later_one_rules(tmp_path: Path) -> None:
    first = parameter_file(
        tmp_path / "a.yaml",
        "robot: {wheel_radius: 0.05, track_width: 0.3}\ncomplementary:\n  time_constant: 2",
    )
    second = parameter_file(tmp_path / "b.yaml", "robot: {wheel_radius: 0.06}")
    assert read_setup(first, second).robot == Robot(wheel_radius=0.06, track_width=0.3)
    assert read_settings(first, second).values == {"complementary": {"time_constant": 2.0}}


def test_dotted_names_and_numbers_as_ros_reads_them(tmp_path: Path) -> None:
    path = parameter_file(
        tmp_path / "a.yaml", "robot.wheel_radius: 4e-2\ncomplementary.time_constant: 5E-1"
    )
    assert read_setup(path).robot.wheel_radius == 0.04
    assert read_settings(path).values == {"complementary": {"time_constant": 0.5}}


def test_a_nodes_own_parameters_are_left_to_it(tmp_path: Path) -> None:
    text = "robot: {wheel_radius: 0.05}\npublish_tf: true\nimu: {topic: x}"
    path = parameter_file(tmp_path / "a.yaml", text, node="/front/filter_node")
    assert read_setup(path).robot.wheel_radius == 0.05
    with pytest.raises(ConfigurationError, match="publish_tf is unknown"):
        read_setup(parameter_file(tmp_path / "b.yaml", text))


def test_correction_settings_take_the_files_sampling_period_unless_they_name_one(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.yaml"
    parameter_file(path, "settings_dt: 0.02\ncorrection: {velocity_time_constant: -0.00065}")
    assert read_setup(path).correction.dt == 0.02
    parameter_file(path, "settings_dt: 0.02\ncorrection: {dt: 0.005}")
    assert read_setup(path).correction.dt == 0.005


REFUSED = {
    "unknown section": ("robbot: {wheel_radius: 1.0}", r"robbot\.wheel_radius is unknown"),
    "unknown key": ("robot: {wheel_radios: 1.0}", r"robot\.wheel_radios .*robot has: wheel_radius"),
    "unknown filter": ("kalmann: {q1: 1.0}", r"kalmann\.q1 is unknown; .*complementary"),
    "unknown parameter": ("complementary: {tau: 1.0}", "no parameter 'tau'.*time_constant"),
    "section without keys": ("robot: 3", "robot: 3 is not a mapping"),
    "text for a number": ("robot: {wheel_radius: wide}", r"robot\.wheel_radius: 'wide' is not a"),
    "bool for a number": ("robot: {wheel_radius: true}", "True is not a number"),
    "number for a bool": ("correction: {euler: 1}", r"correction\.euler: 1 is no bool"),
    "list for a number": ("robot: {wheel_radius: [1.0]}", r"\[1.0\] is not a number"),
    "number for a list": ("robot: {lever_arm: 0.1}", "0.1 is not a list of 3 numbers"),
    "short list": ("robot: {lever_arm: [0.1, 0.2]}", r"\[0.1, 0.2\] is not a list of 3"),
    "text in a list": ("robot: {lever_arm: [0.1, 0.2, x]}", "'x' is not a number"),
    "not finite": ("robot: {wheel_radius: .nan}", r"robot\.wheel_radius: nan is not finite"),
    "infinite in a list": ("calibration: {gyro_bias: [0.0, .inf, 0.0]}", "inf is not finite"),
    "out of range": (
        "robot: {wheel_radius: -0.1}",
        r"robot\.wheel_radius: -0.1 is outside \[0.001, 1\] m",
    ),
    "a factor out of range": (
        "robot: {gear_ratio: 0.0}",
        r"robot\.gear_ratio: 0.0 is outside \[0.01, 1000\]$",
    ),
    "no such placement": ("robot: {encoder_placement: roof}", "'roof' is not one of body, ground"),
    "unstable low-pass": (
        "correction: {rate_time_constant: -0.01, dt: 0.02}",
        r"correction\.rate_time_constant: -0.01 s is not above -0.01 s",
    ),
    "filter out of range": (
        "complementary: {time_constant: -1.0}",
        r"complementary\.time_constant: -1.0 is outside \[0.001, 1000\] s",
    ),
    "filter value as text": ("complementary: {time_constant: '1'}", "'1' is not a number"),
    "no such filter": ("filter: median", "there is no filter 'median'; there are: .*comple"),
    "filter is a list": ("filter: [complementary]", "filter: "),
    "period of zero": ("settings_dt: 0.0", r"settings_dt: 0.0 s is not above 0"),
    "key twice": ("filter: gyro\nfilter: kalman", "key 'filter' twice"),
}


@pytest.mark.parametrize(("text", "reason"), REFUSED.values(), ids=list(REFUSED))
def test_mistakes_are_refused_with_file_key_and_value(
    tmp_path: Path, text: str, reason: str
) -> None:
    path = parameter_file(tmp_path / "mine.yaml", text)
    with pytest.raises(ConfigurationError, match=rf"mine\.yaml: .*{reason}"):
        read_setup(path), read_settings(path)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "must be a mapping"),
        ("robot: {wheel_radius: 1.0}", "'robot' must hold 'ros__parameters'"),
        ("/**: {ros__parameters: [1]}", "must be a mapping"),
        ("/**: {ros__parameters: {1: 2}}", "must be a mapping"),
        ("/**: {", "not valid YAML: .*line \\d"),
        ("/**: !!python/object/apply:os.getcwd []", "not valid YAML"),
    ],
)
def test_files_that_are_no_parameter_files_are_refused(
    tmp_path: Path, content: str, reason: str
) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(content)
    with pytest.raises(ConfigurationError, match=rf"mine\.yaml: .*{reason}"):
        read_setup(path)


def test_missing_files_and_empty_folders_are_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"absent\.yaml: cannot be read"):
        read_setup(tmp_path / "absent.yaml")
    with pytest.raises(ConfigurationError, match=r"holds none of robot\.yaml, calibration"):
        read_setup(tmp_path)


@pytest.mark.parametrize("kind", [Robot, Calibration, CorrectionSettings])
def test_every_field_can_be_read(tmp_path: Path, kind: type[Any]) -> None:
    owner = {Robot: "robot", Calibration: "calibration", CorrectionSettings: "correction"}[kind]
    for entry in fields(kind):
        value = getattr(kind(), entry.name)
        value = getattr(value, "value", value)
        listed = list(value) if isinstance(value, tuple) else value
        path = parameter_file(tmp_path / "a.yaml", f"{owner}.{entry.name}: {listed}".lower())
        assert getattr(read_setup(path), owner) == kind()


def test_the_calibration_says_how_good_it_is_to_the_filter_that_asks(tmp_path: Path) -> None:
    quality = {"ins_odometer": {"accel_residual": 0.02, "slip": 0.004}}
    write_section(tmp_path / "calibration.yaml", CALIBRATION, values=quality)
    assert read_settings(tmp_path).values == quality
    assert read_setup(tmp_path).calibration == CALIBRATION
    parameter_file(tmp_path / "filters.yaml", "ins_odometer.slip: 0.01")
    assert read_settings(tmp_path).values["ins_odometer"] == {"accel_residual": 0.02, "slip": 0.01}
