"""Real device files of this kernel, where it has them; tests skip elsewhere and say why."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from hardware import cuse_i2c, relay
from hardware.gpio_sim import CONFIGFS, GpioSim
from hardware.transfers import Adapter
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050

CUSE_BUS = 99
RIG = "tools/kernel_rig.py runs these in a kernel of its own"


@pytest.fixture(params=["i2c-dev", "CUSE"])
def bus(request: pytest.FixtureRequest) -> Iterator[tuple[int, Adapter]]:
    """Yield the number of a /dev/i2c-N and what answers on it."""
    pytest.importorskip("smbus2", reason="needs the extra `hardware`")
    device = relay.DEVICE if request.param == "i2c-dev" else cuse_i2c.DEVICE
    if not os.access(device, os.R_OK | os.W_OK):
        pytest.skip(f"{device} is missing or not permitted; {RIG}")
    adapter = Adapter(SimulatedMpu6050(time.monotonic_ns, reset_time=0.0))
    if request.param == "i2c-dev":
        served, number = relay.Relay(adapter), relay.bus_number()
    else:
        served, number = cuse_i2c.CuseI2c(adapter, CUSE_BUS), CUSE_BUS
        _wait_for(Path(f"/dev/i2c-{CUSE_BUS}"))
    yield number, adapter
    served.close()


def _wait_for(path: Path) -> None:
    for _ in range(500):
        if path.exists():
            return
        time.sleep(0.01)
    pytest.fail(f"{path} did not appear")


@pytest.fixture
def gpio() -> Iterator[GpioSim]:
    """Yield a simulated GPIO chip of the kernel."""
    pytest.importorskip("gpiod", minversion="2.1", reason="needs the extra `hardware`")
    if not os.access(CONFIGFS, os.W_OK):
        pytest.skip(f"{CONFIGFS} is missing or not permitted (gpio-sim); {RIG}")
    chip = GpioSim()
    yield chip
    chip.close()


@pytest.fixture
def counter(request: pytest.FixtureRequest) -> Path:
    """Return the count of the rig's counter with the name that the test asks for."""
    for name in Path("/sys/bus/counter/devices").glob("*/name"):
        if name.read_text().strip() == request.param:
            return name.parent / "count0"
    pytest.skip(f"this kernel has no counter {request.param}; {RIG}")
