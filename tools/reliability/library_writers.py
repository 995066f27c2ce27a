"""Writers of the package that no command starts: each writes into a folder and returns a status."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from twbr_estimation.bags.recorder import BagRecorder
from twbr_estimation.bags.topics import IMU, TopicNames
from twbr_estimation.configuration.files import write_section
from twbr_estimation.errors import TwbrError
from twbr_estimation.live_code.files import ObjectCode, kept, saved
from twbr_estimation.many.results import ResultTable
from twbr_estimation.robot import Calibration
from twbr_estimation.ros_messages import ACCEL, GYRO, IMU_DOUBLES
from twbr_estimation.streams.messages import ImuEncoder


def said(error: TwbrError) -> int:
    """Print an error as `twbr` does; return the status."""
    print(f"error: {error}", file=sys.stderr)
    return 1


def save_calibration(to: Path) -> int:
    """Save what the service of a node saves."""
    provenance: dict[str, str | float] = {"source": "a service", "duration": 3.0}
    try:
        write_section(to / "calibration.yaml", Calibration(), provenance, replace=True)
    except TwbrError as error:
        return said(error)
    return 0


def record(to: Path) -> int:
    """Record a new drive of 2 MB, as the page does."""
    try:
        recorder = BagRecorder(to / "new", {TopicNames().imu: IMU})
        for number in range(6_000):
            recorder.add(TopicNames().imu, number * 5_000_000, message(number))
        recorder.close()
    except TwbrError as error:
        return said(error)
    return 0


def message(number: int) -> bytes:
    """Return a serialised Imu."""
    values = [0.0] * IMU_DOUBLES
    values[4], values[GYRO], values[ACCEL] = -1.0, 1e-4 * number, 9.8
    return bytes(ImuEncoder("imu_link").encode(1_700_000_000 * 10**9 + 5_000_000 * number, values))


def add_result(to: Path) -> int:
    """Append a row of a thousand numbers to a table."""
    try:
        table = ResultTable(to / "results.jsonl")
        table.append([{"key": "row", "numbers": list(range(1000))}])
        table.close()
    except TwbrError as error:
        return said(error)
    return 0


def keep_step(to: Path) -> int:
    """Keep machine code as the compiler of the live path does."""
    os.environ["NUMBA_CACHE_DIR"] = str(to)
    code = ObjectCode("step", bytes(300_000))
    path = saved("filter", "digest", code)
    return 0 if path is None or kept("filter", "digest") == code else 1
