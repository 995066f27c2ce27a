"""Fixtures that more than one test file uses."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from twbr_estimation.recording import ImuTrack, WheelTrack

os.environ["TWBR_NO_BACKGROUND"] = "1"  # no process is left behind by a test
_CACHE = tempfile.TemporaryDirectory(prefix="twbr-test-")
os.environ["XDG_CACHE_HOME"] = _CACHE.name  # no result of another run is taken for one of this
CHECKOUT = Path(__file__).resolve().parent.parent
WATCHED = ("test/filters/", "test/pipeline/", "test/streams/")
"""Tests that coverage is measured on; `pyproject.toml` names the folders of the package."""


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real recordings, which are too large to live in the repository."""
    named = os.environ.get("TWBR_DATA")
    folder = Path(named) if named else CHECKOUT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no real recordings: TWBR_DATA is not set and {folder} does not exist")
    return folder


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let coverage watch the tests in `WATCHED`, with the first of their sets of parameters.

    A tracer doubles the time of what it watches, and the other sets run hardly another line.
    """
    if not config.pluginmanager.hasplugin("pytest_cov"):
        return
    watched = set()
    for item in items:
        test = item.nodeid.partition("[")[0]
        if test in watched or not test.startswith(WATCHED):
            item.add_marker("no_cover")
        watched.add(test)


DRIVE_START = 1_000_000_000_000


class Drive(NamedTuple):
    """Readings of a drive."""

    imu: ImuTrack
    wheels: WheelTrack

    @property
    def imu_columns(self) -> tuple[list[int], list[list[float]], list[list[float]]]:
        """Stamps, gyro and accelerometer readings as lists."""
        return self.imu.stamps.tolist(), self.imu.gyro.tolist(), self.imu.accel.tolist()


def drive(seed: int = 1, count: int = 1000, wheel_delay: int = 700_000) -> Drive:
    """Return `count` IMU readings at 500 Hz with jitter, and wheels at 250 Hz."""
    generator = np.random.default_rng(seed)
    stamps = DRIVE_START + np.cumsum(generator.integers(1_500_000, 2_500_000, count))
    times = (stamps - DRIVE_START) * 1e-9
    tilt, rate = 0.2 * np.sin(3.0 * times), 0.6 * np.cos(3.0 * times)
    gyro = generator.normal(0.0, 0.01, (count, 3))
    accel = generator.normal(0.0, 0.1, (count, 3))
    gyro[:, 1] += rate
    accel[:, 0] -= 9.81 * np.sin(tilt)
    accel[:, 2] += 9.81 * np.cos(tilt)
    wheel_stamps = stamps[::2] + wheel_delay
    seconds = (wheel_stamps - DRIVE_START) * 1e-9
    angle = np.stack([8.0 * np.sin(seconds), 8.0 * np.sin(seconds) + 0.3 * seconds], axis=1)
    return Drive(ImuTrack(stamps, gyro, accel), WheelTrack(wheel_stamps, angle))


@pytest.fixture(scope="session")
def make_drive() -> Callable[..., Drive]:
    """Return the function that makes drives: `make_drive(seed, count)`."""
    return drive


@pytest.fixture
def driven() -> Drive:
    """Return one drive of two seconds."""
    return drive()
