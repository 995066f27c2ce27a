"""A student's log becomes the recording that its description says."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.bags import read_recording
from twbr_estimation.configuration.files import read_setup
from twbr_estimation.errors import TwbrError
from twbr_estimation.imports import ImportedLog, ImportOptions, load, write_import
from twbr_estimation.imports.csv_log import unwrapped

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "arduino_log"
MINIMAL = """
columns: {time: t, gyro: [gx, gy, gz], accel: [ax, ay, az]}
"""


def imported(folder: Path, log: str, description: str) -> ImportedLog:
    (folder / "log.csv").write_text(log)
    (folder / "columns.yaml").write_text(description)
    return load(folder / "log.csv", "csv", ImportOptions(folder / "columns.yaml"))


def test_the_example_gives_the_swing_it_was_made_of() -> None:
    log = load(EXAMPLE / "log.csv", "csv", ImportOptions(EXAMPLE / "columns.yaml"))
    recording = log.recording
    time = (recording.imu.stamps - recording.imu.stamps[0]) * 1e-9
    tilt = 0.05 * np.sin(4.0 * math.pi * time)
    np.testing.assert_allclose(np.diff(time), 0.005)
    assert recording.reference is not None and recording.wheels is not None
    half_count = math.pi / 2000
    np.testing.assert_allclose(recording.reference.tilt, tilt, atol=1.01 * half_count)
    accel = recording.imu.accel
    np.testing.assert_allclose(np.arctan2(-accel[:, 0], accel[:, 2]), tilt, atol=1e-4)
    rate = np.gradient(tilt, time)
    gyro = recording.imu.gyro[:, 1] - math.radians(12 / 131)
    np.testing.assert_allclose(gyro[1:-1], rate[1:-1], atol=2e-3)
    np.testing.assert_array_equal(recording.wheels.angle[:, 0], recording.wheels.angle[:, 1])
    assert recording.repairs == {"rows that are not numbers dropped": 1}
    assert recording.temperature is not None and recording.temperature.stamps.size == 4


def test_what_is_written_reads_back_with_its_robot(tmp_path: Path) -> None:
    log = load(EXAMPLE / "log.csv", "csv", ImportOptions(EXAMPLE / "columns.yaml"))
    write_import(tmp_path / "bag", log)
    recording = read_recording(tmp_path / "bag", required=("reference", "joint_states"))
    np.testing.assert_array_equal(recording.imu.gyro, log.recording.imu.gyro)
    assert read_setup(tmp_path / "bag" / "config").robot == log.robot
    assert log.robot.wheel_radius == 0.034


def test_units_are_si_where_none_are_given(tmp_path: Path) -> None:
    log = imported(tmp_path, "t,gx,gy,gz,ax,ay,az\n0,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n", MINIMAL)
    np.testing.assert_array_equal(log.recording.imu.gyro[0], [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(log.recording.imu.accel[1], [4.0, 5.0, 6.0])
    assert np.diff(log.recording.imu.stamps).tolist() == [10_000_000]


def test_columns_may_be_numbers_and_axes_may_be_missing(tmp_path: Path) -> None:
    description = """
columns: {time: 0, gyro: [null, 1, null], accel: [2, null, 3], reference: 4}
units: {time: ms, gyro: deg/s, accel: g, reference: deg}
header: false
delimiter: ";"
reference: {offset_deg: 10, delay: 0.002}
signs: {reference: -1, accel: [1, 1, -1]}
"""
    log = imported(tmp_path, "0;180;0.5;-1;30\n10;0;0;-1;30\n", description)
    recording = log.recording
    np.testing.assert_allclose(recording.imu.gyro[0], [0.0, math.pi, 0.0])
    np.testing.assert_allclose(recording.imu.accel[0], [0.5 * 9.80665, 0.0, 9.80665])
    assert recording.reference is not None
    np.testing.assert_allclose(np.degrees(recording.reference.tilt), -20.0)
    assert recording.reference.stamps[0] - recording.imu.stamps[0] == 2_000_000


def test_a_spreadsheet_s_decimal_commas_and_byte_order_mark_are_read(tmp_path: Path) -> None:
    description = MINIMAL + 'delimiter: ";"\ndecimal: ","\n'
    text = "\ufefft;gx;gy;gz;ax;ay;az\n0,5;1,5;2;3;4;5;6\n0,51;1,5;2;3;4;5;6,25\n"
    recording = imported(tmp_path, text, description).recording
    assert np.diff(recording.imu.stamps).tolist() == [10_000_000]
    np.testing.assert_array_equal(recording.imu.gyro[0], [1.5, 2.0, 3.0])
    assert recording.imu.accel[1, 2] == 6.25


def test_a_counter_that_starts_again_goes_on() -> None:
    counter = np.array([250.0, 254.0, 2.0, 1.0, 6.0, 250.0, 3.0])
    expected = [250.0, 254.0, 258.0, 257.0, 262.0, 506.0, 515.0]
    np.testing.assert_array_equal(unwrapped(counter, 256.0), expected)


@pytest.mark.parametrize(
    ("description", "message"),
    [
        ("columns: {time: t}", "columns.gyro"),
        (MINIMAL + "colour: red", "colour"),
        (MINIMAL + "units: {gyro: rpm}", "rpm"),
        (MINIMAL + "units: {gyro: LSB}", "lsb_per.gyro"),
        (MINIMAL + "axes: [y, x, z]", "right-handed"),
        (MINIMAL + "axes: [x, y]", "axes"),
        (MINIMAL + "signs: {gyro: [1, 2, 1]}", "signs.gyro"),
        (MINIMAL + "robot: {wheel_radius: -1}", "wheel_radius"),
        (MINIMAL + "robot: {wheels: 2}", "wheels"),
        (MINIMAL.replace("gx", "missing"), "missing"),
        (MINIMAL + 'delimiter: "; "', "not one character"),
        ("columns: {time: 0, gyro: [1, 2, -3], accel: [3, 4, 5]}", "-3 is below 0"),
        ("columns: [", "not valid YAML"),
        ("nothing", "columns"),
    ],
)
def test_a_wrong_description_says_what_is_wrong(
    tmp_path: Path, description: str, message: str
) -> None:
    with pytest.raises(TwbrError, match=message):
        imported(tmp_path, "t,gx,gy,gz,ax,ay,az\n0,1,2,3,4,5,6\n", description)


@pytest.mark.parametrize("log", ["", "t,gx,gy,gz,ax,ay,az\n", "t,gx,gy,gz,ax,ay,az\na,b\n"])
def test_a_log_without_numbers_is_refused(tmp_path: Path, log: str) -> None:
    with pytest.raises(TwbrError, match=r"log\.csv"):
        imported(tmp_path, log, MINIMAL)


def test_a_missing_file_and_format_are_named(tmp_path: Path) -> None:
    with pytest.raises(TwbrError, match="no such file"):
        load(tmp_path / "none.csv", "csv")
    with pytest.raises(TwbrError, match="broad, csv, mpu6050-static, uiuc"):
        load(tmp_path / "none.csv", "xml")


ROWS = [f"{10 * each},1.5,2,3,4,5,9.75" for each in range(5)]
LOG = "\n".join(["t,gx,gy,gz,ax,ay,az", *ROWS])
IN_MS = MINIMAL + "units: {time: ms}\n"


@pytest.mark.parametrize(
    "log",
    [
        LOG.replace(",", ";").replace(".", ","),
        LOG.replace(",", "\t").replace(".", ","),
        "sep=,\n" + LOG,
        "sep=|\n" + LOG.replace(",", "|"),
        "# logger 1.2, ready\n# 500 Hz\n" + LOG,
        "# " + LOG,
        "%" + LOG.replace("\n20,", "\n% pause\n20,"),
        LOG.replace("\n20,", "\n// pause\n20,"),
        LOG.replace("\n20,", "\n\ufeff20,"),
    ],
)
def test_spreadsheets_and_comments_change_no_number(tmp_path: Path, log: str) -> None:
    recording = imported(tmp_path, log, IN_MS).recording
    assert recording.imu.stamps.size == 5 and recording.repairs == {}
    np.testing.assert_array_equal(recording.imu.gyro[:, 0], 1.5)
    np.testing.assert_array_equal(recording.imu.accel[:, 2], 9.75)
    assert np.diff(recording.imu.stamps).tolist() == [10_000_000] * 4


@pytest.mark.parametrize("day", ["2024-05-01", "1.5.2024", "01.05.2024"])
def test_date_and_time_may_be_two_columns(tmp_path: Path, day: str) -> None:
    rows = [f"{day},23:59:59.{each:03d},1,2,3,4,5,6" for each in (980, 990)]
    rows += ["2024-05-02,00:00:00.000,1,2,3,4,5,6"]
    log = "\n".join(["day,clock,gx,gy,gz,ax,ay,az", *rows])
    description = MINIMAL.replace("time: t", "time: [day, clock]")
    recording = imported(tmp_path, log, description).recording
    assert np.diff(recording.imu.stamps) == pytest.approx([10_000_000] * 2, abs=1000)
    assert recording.imu.stamps[0] == pytest.approx(1_714_607_999_980_000_000, abs=1000)
