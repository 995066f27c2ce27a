"""Logs as loggers, serial monitors and spreadsheets write them."""

from __future__ import annotations

import math
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.bags import read_recording
from twbr_estimation.errors import TwbrError
from twbr_estimation.imports import ImportedLog, ImportOptions, load, write_import

COLUMNS = "columns: {time: t, gyro: [gx, gy, gz], accel: [ax, ay, az]}\n"
NAMES = "t,gx,gy,gz,ax,ay,az"
READINGS = "1,2,3,4,5,6"


def imported(folder: Path, log: str | bytes, description: str = COLUMNS) -> ImportedLog:
    (folder / "log.csv").write_bytes(log if isinstance(log, bytes) else log.encode())
    (folder / "columns.yaml").write_text(description)
    return load(folder / "log.csv", "csv", ImportOptions(folder / "columns.yaml"))


def rows(times: list[str], head: str = NAMES, rest: str = READINGS) -> str:
    return "\n".join([head, *(f"{time},{rest}" for time in times)]) + "\n"


def steps(log: ImportedLog) -> list[int]:
    return np.diff(log.recording.imu.stamps).tolist()


@pytest.mark.parametrize(
    ("encoding", "mark"),
    [
        ("utf-16-le", "\ufeff"), ("utf-16-be", "\ufeff"), ("utf-16-le", ""), ("utf-16-be", ""),
        ("utf-8", "\ufeff"), ("utf-32-le", "\ufeff"), ("cp1252", ""),
    ],
)  # fmt: skip
@pytest.mark.parametrize("delimiter", [",", "\t", ";", "  "])
def test_encoding_and_delimiter_are_found(
    tmp_path: Path, encoding: str, mark: str, delimiter: str
) -> None:
    text = rows(["0", "0.01"], NAMES.replace("t,", "t_µs,")).replace(",", delimiter)
    description = COLUMNS.replace("time: t", "time: t_µs")
    log = imported(tmp_path, (mark + text).encode(encoding), description)
    assert steps(log) == [10_000_000]
    np.testing.assert_array_equal(log.recording.imu.accel[1], [4.0, 5.0, 6.0])


@pytest.mark.parametrize(
    "times",
    [
        ["2024-05-01 12:00:00.000", "2024-05-01 12:00:00.002"],
        ["2024-05-01T12:00:00Z", "2024-05-01T12:00:00.002000Z"],
        ["2024-05-01T14:00:00.000+02:00", "2024-05-01T14:00:00.002+02:00"],
        ["2024/5/1 12:00:00.000", "2024/5/1 12:00:00.002"],
    ],
)
def test_dates_give_stamps_of_the_calendar(tmp_path: Path, times: list[str]) -> None:
    log = imported(tmp_path, rows(times), COLUMNS + "units: {time: us}")
    noon = datetime(2024, 5, 1, 12, tzinfo=timezone.utc).timestamp()
    assert abs(log.recording.imu.stamps[0] - noon * 1e9) < 1000
    np.testing.assert_allclose(steps(log), 2_000_000, atol=1000)
    assert times[0] in str(log.provenance["time"])


def test_a_time_of_day_goes_on_at_midnight(tmp_path: Path) -> None:
    log = imported(
        tmp_path, rows(["23:59:59.990", "0:00:00.000", "00:00:00,010".replace(",", ".")])
    )
    np.testing.assert_allclose(steps(log), 10_000_000, atol=2)


@pytest.mark.parametrize("with_time", [True, False])
@pytest.mark.parametrize("with_header", [True, False])
def test_a_serial_monitor_s_prefix_is_the_time_or_left_out(
    tmp_path: Path, with_time: bool, with_header: bool
) -> None:
    lines = [
        f"12:00:0{i}.500 -> {f'{1000 * i},' if with_time else ''}{READINGS}" for i in range(1, 5)
    ]
    description = COLUMNS + "units: {time: ms}\n"
    if with_header:
        lines.insert(0, f"12:00:00.400 -> {NAMES}")
    else:
        description = "columns: {time: 0, gyro: [1, 2, 3], accel: [4, 5, 6]}\nheader: false\n"
        description += "units: {time: ms}\n"
    log = imported(tmp_path, "\n".join(lines), description)
    np.testing.assert_allclose(steps(log), 1_000_000_000, atol=2)
    np.testing.assert_array_equal(log.recording.imu.accel[0], [4.0, 5.0, 6.0])
    assert "12:00:01.500" in str(log.provenance["monitor"])


def test_a_column_without_numbers_is_named_with_what_it_holds(tmp_path: Path) -> None:
    with pytest.raises(TwbrError, match="column 't' of the time holds no number, but 'noon'"):
        imported(tmp_path, rows(["noon", "noon"]))
    with pytest.raises(TwbrError, match="column 'gy' holds no number, but 'two'"):
        imported(tmp_path, rows(["0", "1"], rest="1,two,3,4,5,6"))


def test_a_rate_stands_in_for_the_time(tmp_path: Path) -> None:
    description = "columns: {gyro: [0, 1, 2], accel: [3, 4, 5]}\nheader: false\nrate: 250\n"
    log = imported(tmp_path, f" {READINGS}\n{READINGS}\n{READINGS}\n", description)
    assert steps(log) == [4_000_000, 4_000_000]
    for wrong, what in (("", "both missing"), ("rate: -1\n", "within 0"), ("rate: .nan\n", "rate")):
        with pytest.raises(TwbrError, match=what):
            imported(tmp_path, READINGS, description.replace("rate: 250\n", wrong))
    with pytest.raises(TwbrError, match="exclude each other"):
        imported(tmp_path, rows(["0"]), COLUMNS + "rate: 100")


def test_lines_that_lost_or_gained_fields_are_dropped_and_counted(tmp_path: Path) -> None:
    good = [f"{0.01 * i:.2f},{READINGS}" for i in range(50)]
    bad = ["0.111,1,2,3,4", "0.222", "0.333,1,2,3,4,5,6,7,8", "0.4x4,1,2,3,4,5,6"]
    lines = [*good[:20], bad[0], *good[20:30], *bad[1:], *good[30:], "0.60,1,2,3,4,5,6,"]
    log = imported(tmp_path, "\n".join([NAMES, *lines]))
    assert log.recording.imu.stamps.size == 51
    assert log.recording.repairs == {
        "rows that are not numbers dropped": 4,
        "imu: gaps longer than 0.05 s left as they are": 1,
    }


@pytest.mark.parametrize(("bits", "unit", "step"), [(32, "us", 5000), (16, "ms", 5), (32, "ms", 5)])
def test_a_counter_of_the_time_goes_on(tmp_path: Path, bits: int, unit: str, step: int) -> None:
    times = [str((2**bits - 7 * step + step * i) % 2**bits) for i in range(20)]
    log = imported(tmp_path, rows(times), COLUMNS + f"units: {{time: {unit}}}")
    np.testing.assert_allclose(steps(log), 5_000_000, atol=2)


def drive(count: int = 4000) -> np.ndarray:
    time = 0.005 * np.arange(count)
    return np.round(50_000.0 * (1.0 - np.cos(0.7 * time)) + 300.0 * np.sin(5.0 * time))


@pytest.mark.parametrize(("bits", "key"), [(16, ""), (12, ""), (8, "wheel_wrap: 256\n"), (15, "")])
@pytest.mark.parametrize("signed", [True, False])
def test_counters_of_the_wheels_go_on(tmp_path: Path, bits: int, key: str, signed: bool) -> None:
    counts = drive() / (20 if bits < 12 else 4 if bits < 15 else 1)
    counts = np.round(counts)
    low = -(2 ** (bits - 1)) if signed else 0
    read = np.mod(counts - low, 2**bits) + low
    lines = [f"{0.005 * i:.3f},{READINGS},{w:.0f}" for i, w in enumerate(read)]
    description = COLUMNS.replace("}", ", wheels: w}") + key
    description += "units: {wheels: counts}\ncounts_per_turn: {wheels: 1320}\nsigns: {wheels: -1}\n"
    log = imported(tmp_path, "\n".join([f"{NAMES},w", *lines]), description)
    assert log.recording.wheels is not None
    turned = -log.recording.wheels.angle[:, 0] * 1320 / (2.0 * math.pi)
    np.testing.assert_allclose(turned - turned[0], counts - counts[0], atol=1e-6)
    assert any("wheels: counter starts again" in repair for repair in log.recording.repairs)


def test_speeds_motors_and_the_robot_s_own_estimate_are_kept(tmp_path: Path) -> None:
    time = 0.01 * np.arange(300)
    lines = [
        f"{t:.2f},{READINGS},{60 * np.sin(3 * t):.5f},{1000 * t:.1f},{10 * np.sin(t):.6f}"
        for t in time
    ]
    extra = ", wheel_speeds: v, motors: u, estimates: {mine: pitch}}"
    units = "units: {wheel_speeds: rpm, motors: mV, estimates: deg}\n"
    description = COLUMNS.replace("}", extra) + units
    log = imported(tmp_path, "\n".join([f"{NAMES},v,u,pitch", *lines]), description)
    write_import(tmp_path / "bag", log)
    recording = read_recording(tmp_path / "bag", estimators={"mine": "/imu/mine"})
    assert recording.wheels is not None and recording.motors is not None
    turned = 2.0 * math.pi / 3.0 * (1.0 - np.cos(3.0 * time))
    np.testing.assert_allclose(recording.wheels.angle[:, 0], turned, atol=1e-3)
    np.testing.assert_allclose(recording.motors.voltage[:, 0], time, atol=1e-6)
    own = recording.estimators["mine"].tilt
    np.testing.assert_allclose(own, np.radians(10.0 * np.sin(time)), atol=1e-6)


@pytest.mark.parametrize(
    "line",
    [
        "time_wrap: .nan", "time_wrap: -1", "reference: {delay: .inf}", "reference: {delay: 1e300}",
        "reference: 3", "columns: 3", "skip_rows: .inf", "encoding: klingon", "signs: [1]",
        "units: {gyro: LSB}\nlsb_per: {gyro: .inf}", "robot: {wheel_radius: .nan}", "robot: 3",
        "units: {gyro: [1]}", "axes: 3", "header: {a: 1}\ndelimiter: ''", "wheel_wrap: 1e300",
    ],
)  # fmt: skip
def test_a_number_beyond_sense_is_refused(tmp_path: Path, line: str) -> None:
    description = line if line.startswith("columns") else COLUMNS + line
    with pytest.raises(TwbrError, match=r"columns\.yaml: "):
        imported(tmp_path, rows(["0", "1"]), description)


def test_what_is_no_file_is_refused_at_once() -> None:
    with pytest.raises(TwbrError, match="it is a device"):
        load(Path("/dev/zero"), "csv", ImportOptions(Path("/dev/zero")))
