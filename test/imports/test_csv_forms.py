"""Numbers, dates and headers in the forms that spreadsheets and loggers give them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.imports import ImportedLog, ImportOptions, load

COLUMNS = "columns: {time: t, gyro: [gx, gy, gz], accel: [ax, ay, az]}\n"
NAMES = "t,gx,gy,gz,ax,ay,az"
NOON = 1_715_601_600
"""2024-05-13 12:00:00 UTC [s]."""


def imported(folder: Path, log: str | bytes, description: str = COLUMNS) -> ImportedLog:
    (folder / "log.csv").write_bytes(log if isinstance(log, bytes) else log.encode())
    (folder / "columns.yaml").write_text(description)
    return load(folder / "log.csv", "csv", ImportOptions(folder / "columns.yaml"))


def log_of(times: list[str], rest: str = "1,2,3,4,5,6", head: str = NAMES) -> str:
    return "\n".join([head, *(f'"{time}",{rest}' for time in times)]) + "\n"


@pytest.mark.parametrize(
    "form",
    [
        "05/13/2024 12:00:00.{}",
        "13/05/2024 12:00:00.{}",
        "13-05-2024 12:00:00.{}",
        "13.05.2024 12:00:00.{}",
        "13.5.24, 12:00:00,{}",
        "5/13/24 12:00:00.{} PM",
        "13 May 2024 12:00:00.{}",
        "May 13, 2024 12:00:00.{}",
        "20240513T120000.{}",
        "2024-05-13 14:00:00.{} +0200",
        "2024-05-13_12:00:00:{}",
    ],
)
def test_dates_of_all_countries_are_read(tmp_path: Path, form: str) -> None:
    log = imported(tmp_path, log_of([form.format("004"), form.format("014")]))
    expected = NOON * 1000 + np.array([4, 14])
    np.testing.assert_allclose(log.recording.imu.stamps / 1e6, expected, atol=0.01)


def test_a_date_that_can_be_read_both_ways_begins_with_the_month(tmp_path: Path) -> None:
    log = imported(tmp_path, log_of(["05/06/2024 00:00:00.00", "05/06/2024 00:00:00.01"]))
    assert log.recording.imu.stamps[0] == 1_714_953_600_000_000_000


@pytest.mark.parametrize(
    "times",
    [
        ["11:59:59.996 AM", "12:00:00.006 PM"],
        ["11:59:59.996 PM", "12:00:00.006 AM"],
        ["23:59:59:996", "00:00:00:006"],
        ["59:59.996", "00:00.006"],
    ],
)
def test_times_of_day_go_on(tmp_path: Path, times: list[str]) -> None:
    log = imported(tmp_path, log_of(times))
    assert np.diff(log.recording.imu.stamps).tolist() == [10_000_000]


@pytest.mark.parametrize("unit", ["", "units: {time: d}\n"])
def test_the_days_of_a_spreadsheet_are_times(tmp_path: Path, unit: str) -> None:
    days = [f"{45425.5 + seconds / 86400.0:.10f}" for seconds in (0.0, 0.01, 0.02)]
    log = imported(tmp_path, log_of(days), COLUMNS + unit)
    np.testing.assert_allclose(np.diff(log.recording.imu.stamps), 1e7, atol=2e4)


@pytest.mark.parametrize(
    "times",
    [
        ["5,000,000", "5,010,000"],
        ["5'000'000", "5'010'000"],
        ["5 000 000", "5 010 000"],
        ["5\u202f000\u202f000", "5\u202f010\u202f000"],
        ["0x4C4B40", "0x4c7250"],
        ["004C4B40", "004C7250"],
        ["5.00D+06", "5.01D+06"],
        ["\u22125000000", "\u22124990000"],
    ],
)
def test_numbers_in_unusual_forms(tmp_path: Path, times: list[str]) -> None:
    log = imported(tmp_path, log_of(times), COLUMNS + "units: {time: us}\n")
    assert np.diff(log.recording.imu.stamps).tolist() == [10_000_000]


@pytest.mark.parametrize(
    "times", [["5.000,000", "5.010,000"], ["5000,000", "5010,000"], ["5.000", "5.010"]]
)
def test_decimal_commas_with_points_between_thousands(tmp_path: Path, times: list[str]) -> None:
    rows = [f"{time};0,1;0,2;-0,3;4,0;5,0;1.006,5" for time in times]
    text = "\n".join([NAMES.replace(",", ";"), *rows])
    imu = imported(tmp_path, text, COLUMNS + "units: {time: ms}\n").recording.imu
    assert np.diff(imu.stamps).tolist() == [10_000_000]
    assert imu.gyro[0].tolist() == [0.1, 0.2, -0.3]
    assert imu.accel[0].tolist() == [4.0, 5.0, 1006.5]


def test_a_comma_in_every_number_is_no_delimiter(tmp_path: Path) -> None:
    """Nine commas and six semicolons a line, none of the commas in the header."""
    text = "0,00;0,1;0,2;-0,3;4,0;5,0;6,0\n0,01;0,1;0,2;-0,3;4,0;5,0;6,0\n"
    for delimiter in (";", "\t", "|"):
        log = f"{NAMES.replace(',', delimiter)}\n{text.replace(';', delimiter)}"
        imu = imported(tmp_path, log).recording.imu
        assert np.diff(imu.stamps).tolist() == [10_000_000]


@pytest.mark.parametrize(
    "head",
    [
        "Robot 7\nfirmware 2.1, built 2024\n\n" + NAMES,
        NAMES.upper(),
        "t [s], gx [rad/s], gy [rad/s], gz [rad/s], ax (m/s^2), ay (m/s^2), az (m/s^2)",
    ],
)
def test_a_header_is_found_by_its_names(tmp_path: Path, head: str) -> None:
    imu = imported(tmp_path, log_of(["0", "0.01"], head=head)).recording.imu
    assert imu.gyro.tolist() == [[1.0, 2.0, 3.0]] * 2


def test_numbered_columns_without_a_header_lose_no_row(tmp_path: Path) -> None:
    description = "columns: {time: 0, gyro: [1, 2, 3], accel: [4, 5, 6]}\n"
    text = "0,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n"
    assert imported(tmp_path, text, description).recording.imu.stamps.size == 2
    assert imported(tmp_path, f"{NAMES}\n{text}", description).recording.imu.stamps.size == 2


@pytest.mark.parametrize(
    ("log", "message"),
    [
        (b"\x1f\x8b\x08\x00", "gzip; unpack"),
        (b"PK\x03\x04\x14\x00", "workbook"),
        (b"t,g,g,gz,ax,ay,az\n0,1,2,3,4,5,6\n", "columns 1, 2 are all named 'g'"),
    ],
)
def test_what_cannot_be_decided_is_refused(tmp_path: Path, log: bytes, message: str) -> None:
    columns = COLUMNS.replace("gx, gy", "g, g") if b"g,g" in log else COLUMNS
    with pytest.raises(RecordingError, match=message):
        imported(tmp_path, log, columns)


@pytest.mark.parametrize(
    "row",
    [
        "t:{},gx:1,gy:2,gz:3,ax:4,ay:5,az:6",
        "t={}, gx=1, gy=2, gz=3, ax=4, ay=5, az=6",
        '{{"t": {}, "gx": 1, "gy": 2, "gz": 3, "ax": 4, "ay": 5, "az": 6}}',
    ],
)
def test_names_may_stand_before_each_number(tmp_path: Path, row: str) -> None:
    text = "\n".join(["boot ok", row.format("0"), row.format("0.01"), row.format("0.02")])
    imu = imported(tmp_path, text).recording.imu
    assert np.diff(imu.stamps).tolist() == [10_000_000] * 2
    assert imu.gyro[0].tolist() == [1.0, 2.0, 3.0]
    assert imu.accel[0].tolist() == [4.0, 5.0, 6.0]


def test_values_stand_where_their_name_does_and_torn_rows_are_dropped(tmp_path: Path) -> None:
    row = "t:{},gx:1,gy:2,gz:3,ax:4,ay:5,az:6"
    turned = "az:6,ay:5,ax:4,gz:3,gy:2,gx:1,t:0.02"
    torn = ["t:0.03,g:1,gy:2,gz:3,ax:4,ay:5,az:6", "t:0.04,gx:1,gy"]
    whole = [row.format(0.01 * k) for k in (0, 1)], [row.format(0.01 * k) for k in (5, 6, 7)]
    imu = imported(
        tmp_path, "\n".join([*whole[0], turned, torn[0], *whole[1], torn[1]])
    ).recording.imu
    assert (np.diff(imu.stamps) / 1e7).tolist() == [1.0, 1.0, 3.0, 1.0, 1.0]
    assert np.unique(imu.gyro, axis=0).tolist() == [[1.0, 2.0, 3.0]]
    assert np.unique(imu.accel, axis=0).tolist() == [[4.0, 5.0, 6.0]]


def test_labelled_rows_keep_the_times_of_a_serial_monitor(tmp_path: Path) -> None:
    rows = [f"10:00:0{k}.000 -> gx:{k},gy:2,gz:3,ax:4,ay:5,az:6" for k in range(1, 6)]
    rows.insert(2, "10:00:02.500 -> calibration done")
    columns = COLUMNS.replace("time: t, ", "") + "stamps: arrival\n"
    imu = imported(tmp_path, "\n".join(rows), columns).recording.imu
    assert imu.gyro[:, 0].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert (np.diff(imu.stamps) / 1e9).tolist() == [1.0, 1.0, 1.0, 1.0]


def test_rows_written_twice_are_no_samples_of_their_own(tmp_path: Path) -> None:
    rows = [f"{0.01 * k:.2f},{k},2,3,4,5,6" for k in range(20) for _ in range(2)]
    imu = imported(tmp_path, "\n".join([NAMES, *rows])).recording.imu
    assert imu.gyro[:, 0].tolist() == list(range(20))
    assert np.unique(np.diff(imu.stamps)).tolist() == [10_000_000]


def test_an_arrival_is_not_needed_in_every_row(tmp_path: Path) -> None:
    columns = COLUMNS.replace("time: t", "time: t, arrival: pc") + "stamps: device\n"
    rows = [f"{0.01 * k:.2f},1,2,3,4,5,6,{100 + 0.01 * k if k % 5 == 0 else ''}" for k in range(50)]
    imu = imported(tmp_path, "\n".join([f"{NAMES},pc", *rows]), columns).recording.imu
    assert imu.stamps.size == 50
    assert np.ptp(np.diff(imu.stamps)) < 100_000
    without = "\n".join([f"{NAMES},pc", *(row.rsplit(",", 1)[0] + ",x" for row in rows)])
    with pytest.raises(RecordingError, match="'pc' of the arrival holds no number, but 'x'"):
        imported(tmp_path, without, columns)


def test_quoted_numbers_have_decimal_commas_between_commas(tmp_path: Path) -> None:
    text = log_of(["0,00", "0,01"], rest='"0,12","0,2","0,3","1,250",5,6')
    imu = imported(tmp_path, text).recording.imu
    assert np.diff(imu.stamps).tolist() == [10_000_000]
    assert (imu.gyro[0, 0], imu.accel[0, 0]) == (0.12, 1.25)


def test_a_header_that_names_too_few_columns_is_refused(tmp_path: Path) -> None:
    """Commas both between and in the numbers would put the readings into other columns."""
    text = log_of(["0,00", "0,01"], rest="0,1,0,2,0,3,4,0,5,0,6,0").replace('"', "")
    with pytest.raises(RecordingError, match=r"names 7 columns, and its rows have 14.*delimiter"):
        imported(tmp_path, text)


def test_a_log_without_header_asks_for_numbers(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"no header with the name 't'.*by number, from 0"):
        imported(tmp_path, "0,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n")


@pytest.mark.parametrize(
    "key", ["rate: 500Hz\n", "units: {gyro: LSB}\nlsb_per: {gyro: high}\n", "wheel_wrap: [1]\n"]
)
def test_a_value_that_is_no_number_is_named_with_its_key(tmp_path: Path, key: str) -> None:
    name = "lsb_per.gyro" if "lsb" in key else key.split(":")[0]
    with pytest.raises(ConfigurationError, match=f"{name}: .* is no number"):
        imported(tmp_path, log_of(["0", "1"]), COLUMNS + key)
