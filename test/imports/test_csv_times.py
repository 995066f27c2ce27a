"""Times of a log that step rarely, stand still, or are those of a board's own clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.imports import ImportedLog, ImportOptions, load

COLUMNS = "columns: {time: t, gyro: [gx, gy, gz], accel: [ax, ay, az], wheels: w}\n"
PERIOD = 0.004
"""Of the samples [s]."""
ROWS = 2000


def imported(folder: Path, times: list[list[str]], head: str, description: str) -> ImportedLog:
    rows = [",".join([*row, "0,0.1,0,0,0,9.8", str(i)]) for i, row in enumerate(times)]
    text = "\n".join([f"{head},gx,gy,gz,ax,ay,az,w", *rows])
    (folder / "log.csv").write_text(text)
    (folder / "columns.yaml").write_text(description)
    return load(folder / "log.csv", "csv", ImportOptions(folder / "columns.yaml"))


def seconds(log: ImportedLog) -> np.ndarray:
    return (log.recording.imu.stamps - log.recording.imu.stamps[0]) * 1e-9


@pytest.mark.parametrize("form", ["12:00:{:02.0f}", "2024-05-01 12:00:{:02.0f}", "{:.0f}"])
def test_times_in_whole_seconds_are_spread_over_their_rows(tmp_path: Path, form: str) -> None:
    times = [[form.format(np.floor(0.7 + PERIOD * i))] for i in range(ROWS)]
    log = imported(tmp_path, times, "t", COLUMNS)
    np.testing.assert_allclose(seconds(log), PERIOD * np.arange(ROWS), atol=1e-6)
    assert log.recording.repairs == {
        "rows of one time spread evenly up to the next time": ROWS - 9,
    }
    assert log.recording.wheels is not None and log.recording.wheels.stamps.size == ROWS


def test_a_gap_is_not_filled_with_rows(tmp_path: Path) -> None:
    true = PERIOD * np.arange(ROWS) + np.where(np.arange(ROWS) < 1000, 0.0, 3.0)
    times = [[f"{np.floor(10.0 * t) / 10.0:.1f}"] for t in true]
    found = seconds(imported(tmp_path, times, "t", COLUMNS))
    np.testing.assert_allclose(found, true - true[0], atol=PERIOD)


def test_a_time_that_stands_still_asks_for_the_rate(tmp_path: Path) -> None:
    """As a column with the time since the row before."""
    with pytest.raises(
        RecordingError, match="'t' of the time reads 4 in every row; give the `rate`"
    ):
        imported(tmp_path, [["4"]] * 20, "t", COLUMNS)


def board_and_computer(drift: float = 1e-3) -> tuple[np.ndarray, list[list[str]]]:
    """Return true times [s] of samples, and columns of a board's clock [ms] and of arrivals."""
    true = 100.0 + PERIOD * np.arange(ROWS)
    board = (true - 93.0) * (1.0 + drift)
    arrival = np.ceil(true / 0.02) * 0.02 + 0.001  # in bursts
    rows = zip(board, arrival, strict=True)
    return true, [[f"{1e3 * sent:.3f}", f"{came:.6f}"] for sent, came in rows]


def test_a_board_s_clock_is_related_to_the_arrivals(tmp_path: Path) -> None:
    true, times = board_and_computer()
    head, units = "board,pc", "units: {time: ms}\nstamps: device\n"
    columns = COLUMNS.replace("time: t", "time: board, arrival: pc")
    log = imported(tmp_path, times, head, columns + units)
    np.testing.assert_allclose(seconds(log), true - true[0], atol=1e-4)
    assert log.recording.repairs["rows: stamps related to the time of recording"] == ROWS
    plain = imported(tmp_path, times, head, columns + "units: {time: ms}\n")
    assert abs(seconds(plain)[-1] - (true[-1] - true[0])) > 5e-3


def test_arrivals_alone_may_stamp_the_rows(tmp_path: Path) -> None:
    _, times = board_and_computer()
    columns = COLUMNS.replace("time: t", "arrival: pc") + "stamps: arrival\n"
    log = imported(tmp_path, times, "board,pc", columns)
    assert log.recording.imu.stamps.size == ROWS
    assert np.all(np.diff(log.recording.imu.stamps) > 0)
    assert abs(seconds(log)[-1] - PERIOD * (ROWS - 1)) < 0.02


def test_a_serial_monitor_s_times_are_arrivals(tmp_path: Path) -> None:
    true, times = board_and_computer()
    head = "board,pc"
    columns = COLUMNS.replace("time: t", "time: board") + "units: {time: ms}\nstamps: device\n"
    moments = [f"12:00:{t - 100.0:06.3f} -> {row[0]}" for t, row in zip(true, times, strict=True)]
    log = imported(tmp_path, [[each, "0"] for each in moments], head, columns)
    np.testing.assert_allclose(seconds(log), true - true[0], atol=1e-3)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("stamps: gps\n", "stamps: 'gps'; known: arrival, device, header"),
        ("stamps: [1]\n", "stamps: "),
    ],
)
def test_other_stamps_are_named(tmp_path: Path, key: str, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        imported(tmp_path, [["0"], ["1"]], "t", COLUMNS + key)


def test_stamps_without_arrivals_say_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"columns\.arrival"):
        imported(tmp_path, [["0"], ["1"]], "t", COLUMNS + "stamps: device\n")
