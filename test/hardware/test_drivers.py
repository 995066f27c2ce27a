"""The drivers on device files of a real kernel: i2c-dev or CUSE, gpio-sim, counters."""

from __future__ import annotations

import errno
import time
from pathlib import Path
from typing import Any

import pytest

from hardware.gpio_sim import GpioSim
from hardware.transfers import Adapter
from twbr_estimation.errors import SensorError
from twbr_estimation.sensors.encoder import Encoder, EncoderSettings
from twbr_estimation.sensors.gpio_counter import Bias, open_gpio_counter
from twbr_estimation.sensors.i2c import I2cRegisters
from twbr_estimation.sensors.motion import swing
from twbr_estimation.sensors.mpu6050 import ImuReading, Mpu6050, Mpu6050Settings, Reading
from twbr_estimation.sensors.mpu6050_reader import Mpu6050Reader
from twbr_estimation.sensors.sysfs_counter import SysfsCounter

MAX_READ = Path("/sys/module/rig_i2c/parameters/max_read")
SMBUS_ONLY = Path("/sys/module/rig_i2c/parameters/smbus_only")


def _reader(number: int, **settings: Any) -> Mpu6050Reader:
    given = Mpu6050Settings(bus=number, **{"poll_rate": 100.0, **settings})
    device = Mpu6050(I2cRegisters(number, given.address), given)
    reader = Mpu6050Reader(device, time.monotonic_ns)
    reader.start()
    return reader


def _run(reader: Mpu6050Reader, seconds: float) -> list[ImuReading]:
    found: list[ImuReading] = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.01)
        found.extend(reader.poll())
    return found


def _wrong(readings: list[ImuReading]) -> int:
    return sum(abs(each.accel_z - swing(each.stamp * 1e-9).accel_z) > 1.0 for each in readings)


@pytest.mark.parametrize("reading", list(Reading))
def test_samples_come_through(bus: tuple[int, Adapter], reading: Reading) -> None:
    reader = _reader(bus[0], reading=reading)
    readings = _run(reader, 1.0)
    assert len(readings) > (20 if reading is Reading.BURST else 300)
    assert _wrong(readings) == 0
    assert reader.counters.bus_errors == 0
    reader.stop()


@pytest.mark.parametrize("number", [errno.EREMOTEIO, errno.ENXIO, errno.ETIMEDOUT, errno.EIO])
def test_errors_of_the_bus_are_survived(bus: tuple[int, Adapter], number: int) -> None:
    reader = _reader(bus[0])
    _run(reader, 0.1)
    bus[1].error = number
    assert _run(reader, 0.5) == []
    bus[1].error = 0
    readings = _run(reader, 2.0)
    assert reader.running
    assert readings and _wrong(readings) == 0
    reader.stop()


def test_half_a_transfer_gives_no_old_bytes(bus: tuple[int, Adapter]) -> None:
    reader = _reader(bus[0])
    _run(reader, 0.1)
    bus[1].half = 2
    readings = _run(reader, 0.5)
    assert bus[1].half == 0
    assert reader.counters.bus_errors == 2
    assert _wrong(readings) == 0
    reader.stop()


def test_a_stalled_fifo_transfer_tears_no_packet(bus: tuple[int, Adapter]) -> None:
    reader = _reader(bus[0], reading=Reading.FIFO)
    readings = _run(reader, 0.3)
    read, stalls = bus[1].chip.read, [1]

    def stall(register: int, length: int) -> bytes:
        if register == 0x74 and stalls and stalls.pop():
            time.sleep(0.8)
        return bytes(read(register, length))

    bus[1].chip.read = stall  # type: ignore[method-assign]
    readings += _run(reader, 1.0)
    assert _wrong(readings) == 0
    assert reader.counters.fifo_overflows >= 1
    reader.stop()


def test_an_adapter_of_60_bytes_reads_the_fifo(bus: tuple[int, Adapter]) -> None:
    if not MAX_READ.exists() or bus[0] == 99:
        pytest.skip("only the rig's i2c-dev has such limits")
    MAX_READ.write_text("60")
    try:
        reader = _reader(bus[0], reading=Reading.FIFO, poll_rate=50.0)
        readings = _run(reader, 1.0)
        assert len(readings) > 300 and _wrong(readings) == 0
        assert reader.fifo.transfer_packets <= 4
        reader.stop()
    finally:
        MAX_READ.write_text("0")


def test_an_smbus_adapter_is_refused_by_its_name(bus: tuple[int, Adapter]) -> None:
    if not SMBUS_ONLY.exists() or bus[0] == 99:
        pytest.skip("only the rig's i2c-dev has such limits")
    SMBUS_ONLY.write_text("Y")
    try:
        with pytest.raises(SensorError, match="SMBus commands only"):
            I2cRegisters(bus[0], 0x68)
    finally:
        SMBUS_ONLY.write_text("N")


def test_a_chip_that_a_driver_holds_is_refused(bus: tuple[int, Adapter]) -> None:
    adapter = Path(f"/sys/bus/i2c/devices/i2c-{bus[0]}")
    if not adapter.exists():
        pytest.skip("only i2c-dev has drivers beside it")
    (adapter / "new_device").write_text("dummy 0x68")  # held by the kernel's placeholder driver
    try:
        with pytest.raises(SensorError, match="a kernel driver holds the chip at 0x68"):
            I2cRegisters(bus[0], 0x68)
    finally:
        (adapter / "delete_device").write_text("0x68")
    I2cRegisters(bus[0], 0x68).close()


@pytest.mark.parametrize("by", ["path", "label"])
def test_gpio_edges_are_counted(gpio: GpioSim, by: str) -> None:
    counter = open_gpio_counter(gpio.path if by == "path" else "rig-gpio", 5, 6)
    gpio.turn(60)
    assert counter.read() == 60
    gpio.turn(-100)
    assert counter.read() == -40
    assert (counter.errors, counter.behind) == (0, 0)
    counter.close()


def test_gpio_edges_lost_before_the_first_read_are_counted(gpio: GpioSim) -> None:
    counter = open_gpio_counter(gpio.path, 5, 6)
    gpio.turn(1030)
    counter.read()
    assert counter.errors == 1030 - 1024
    counter.close()


def test_gpio_lines_in_use_are_advised_on(gpio: GpioSim) -> None:
    counter = open_gpio_counter(gpio.path, 5, 6, 7, Bias.PULL_UP)
    with pytest.raises(SensorError, match=r"lines 5 and 6: .*gpioinfo"):
        open_gpio_counter(gpio.path, 5, 6)
    counter.close()
    open_gpio_counter(gpio.path, 5, 6).close()


@pytest.mark.parametrize("counter", ["rig-eqep", "rig-intel", "rig-plain"], indirect=True)
def test_a_kernel_counter_counts(counter: Path) -> None:
    encoder = Encoder(SysfsCounter(str(counter)), EncoderSettings(counts_per_turn=1000))
    start = int((counter / "count").read_text())
    for step in range(1, 101):
        (counter / "count").write_text(str((start + 900 * step) % 2**32))
        reading = encoder.read(step)
    assert reading.position == pytest.approx(90_000 * EncoderSettings(1000).angle_per_count)
    encoder.close()


@pytest.mark.parametrize("counter", ["rig-intel"], indirect=True)
def test_the_index_of_a_counter_that_is_busy_can_be_used(counter: Path) -> None:
    SysfsCounter(str(counter), use_index=True).close()
    assert (counter / "preset_enable").read_text().strip() == "1"
    assert (counter / "enable").read_text().strip() == "1"


@pytest.mark.parametrize("counter", ["rig-fixed"], indirect=True)
def test_a_counter_of_one_line_is_refused(counter: Path) -> None:
    with pytest.raises(SensorError, match="does not let it be changed from 'increase'"):
        SysfsCounter(str(counter))
