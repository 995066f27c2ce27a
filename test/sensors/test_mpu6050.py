"""The MPU6050 driver against the simulated chip, register by register."""

from __future__ import annotations

import math
from typing import Any

import pytest

from twbr_estimation.errors import ConfigurationError, SensorError
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.sensors.i2c import I2cRegisters
from twbr_estimation.sensors.motion import ImuMotion
from twbr_estimation.sensors.mpu6050 import (
    RAW_FULL_SCALE,
    RESET_TIME,
    Mpu6050,
    Mpu6050Settings,
    Reading,
    Register,
    temperature_of,
)
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050

MOTION = ImuMotion(0.5, -1.0, 1.5, 2.0, -4.0, 9.0, 31.0)


def _set_up(chip: SimulatedMpu6050, clock: Any, **settings: Any) -> Mpu6050:
    device = Mpu6050(chip, Mpu6050Settings(**settings))
    device.reset()
    clock.advance(RESET_TIME)
    device.configure()
    return device


def _mean(device: Mpu6050, clock: Any, count: int = 200) -> list[float]:
    sums = [0.0] * 7
    for _ in range(count):
        clock.advance(0.002)
        reading = device.decode(clock(), device.read_packet())
        sums = [total + value for total, value in zip(sums, reading[1:], strict=True)]
    return [total / count for total in sums]


def test_settings_reach_the_registers_of_the_data_sheet(clock: Any) -> None:
    chip = SimulatedMpu6050(clock)
    _set_up(chip, clock, gyro_range_deg=1000, accel_range_g=8, dlpf_config=3, sample_rate_divider=1)
    assert chip.read(0x19, 4) == bytes([1, 3, 2 << 3, 2 << 3])
    assert chip.read(0x6B, 1) == b"\x01"


def test_the_default_ranges_leave_room_for_a_fall() -> None:
    settings = Mpu6050Settings()
    assert (settings.gyro_range_deg, settings.accel_range_g, settings.dlpf_config) == (1000, 8, 0)


def test_the_scales_are_those_of_the_data_sheet() -> None:
    settings = Mpu6050Settings(gyro_range_deg=250, accel_range_g=2)
    assert settings.sample_rate == 1000.0
    # The data sheet's sensitivities: 131 LSB/(deg/s) and 16384 LSB/g.
    assert 1.0 / math.degrees(settings.gyro_scale) == pytest.approx(131.0, rel=1e-3)
    assert STANDARD_GRAVITY / settings.accel_scale == 16384.0


@pytest.mark.parametrize(("gyro", "accel"), [(250, 2), (500, 4), (1000, 8), (2000, 16)])
def test_what_the_chip_measures_comes_back_in_every_range(
    clock: Any, gyro: int, accel: int
) -> None:
    chip = SimulatedMpu6050(clock, motion=lambda _: MOTION)
    device = _set_up(chip, clock, gyro_range_deg=gyro, accel_range_g=accel)
    # Five standard errors of 200 samples with the chip's noise.
    tolerance = [5 * math.radians(0.05) / 14.1] * 3 + [5 * 0.004 * 9.81 / 14.1] * 3 + [0.01]
    for found, true, limit in zip(_mean(device, clock), MOTION, tolerance, strict=True):
        assert found == pytest.approx(true, abs=limit)


def test_readings_saturate_at_full_scale(clock: Any) -> None:
    fast = ImuMotion(0.0, math.radians(400.0), -math.radians(400.0), 30.0, -30.0, 0.0)
    chip = SimulatedMpu6050(clock, motion=lambda _: fast)
    device = _set_up(chip, clock, gyro_range_deg=250, accel_range_g=2)
    clock.advance(0.01)
    reading = device.decode(0, device.read_packet())
    settings = device.settings
    assert reading.gyro_y == (RAW_FULL_SCALE - 1) * settings.gyro_scale
    assert reading.gyro_z == -RAW_FULL_SCALE * settings.gyro_scale
    assert reading.accel_x == (RAW_FULL_SCALE - 1) * settings.accel_scale
    assert reading.accel_y == -RAW_FULL_SCALE * settings.accel_scale


def test_temperature_follows_the_data_sheet() -> None:
    assert temperature_of(0) == 36.53
    assert temperature_of(-521) == pytest.approx(35.0, abs=0.003)


def test_the_fifo_holds_the_samples_since_the_last_read_in_order(clock: Any) -> None:
    chip = SimulatedMpu6050(clock, motion=lambda t: ImuMotion(0, 0, 0, 0, 0, 9.8))
    device = _set_up(chip, clock, reading=Reading.FIFO)
    clock.advance(0.0105)
    assert device.fifo_count() == 10 * 14
    first = device.read_fifo(4)
    assert device.fifo_count() == 6 * 14
    second = device.read_fifo(6)
    assert (len(first), len(second)) == (56, 84)
    assert device.decode(0, second, 5).accel_z == pytest.approx(9.8, abs=0.3)
    # The newest packet of the FIFO is what the data registers show.
    assert second[-14:] == device.read_packet()


def test_the_sample_rate_depends_on_the_low_pass_filter(clock: Any) -> None:
    for dlpf, divider, rate in ((0, 7, 1000), (0, 3, 2000), (1, 0, 1000), (6, 9, 100)):
        settings = Mpu6050Settings(dlpf_config=dlpf, sample_rate_divider=divider, poll_rate=50.0)
        assert settings.sample_rate == rate
        chip = SimulatedMpu6050(clock)
        device = _set_up(chip, clock, reading="fifo", dlpf_config=dlpf, sample_rate_divider=divider)
        clock.advance(0.0305)
        assert device.fifo_count() == 14 * int(0.0305 * rate)


def test_an_mpu6050_is_known_and_relatives_are_named(clock: Any) -> None:
    assert Mpu6050(SimulatedMpu6050(clock), Mpu6050Settings()).identify() is None
    names = ((0x70, "MPU6500"), (0x98, "copy"), (0x33, "unknown"), (0x47, "ICM42688-P"))
    for identity, name in names:
        warning = Mpu6050(SimulatedMpu6050(clock, identity=identity), Mpu6050Settings()).identify()
        assert warning is not None
        assert f"0x{identity:02x}" in warning
        assert name in warning


@pytest.mark.parametrize(
    ("identity", "words"),
    [
        (0x70, ("FIFO of 512 bytes", "333.9 counts/degC from 21 degC", "low-pass in a register")),
        (0x19, ("FIFO of 1008 bytes", "326.8 counts/degC from 25 degC", "low-pass in a register")),
        (0x72, ("FIFO of 512 bytes",)),
        (0x34, ("tried as an MPU6050", "refused where a register")),
        (0xEA, ("ICM20948", "other registers", "refused where a register")),
    ],
)
def test_a_relative_is_named_with_what_differs(
    clock: Any, identity: int, words: tuple[str, ...]
) -> None:
    remark = Mpu6050(SimulatedMpu6050(clock, identity=identity), Mpu6050Settings()).identify()
    assert remark is not None
    assert all(each in remark for each in words)


@pytest.mark.parametrize("identity", [0x00, 0xFF])
def test_an_empty_bus_is_an_error(clock: Any, identity: int) -> None:
    device = Mpu6050(SimulatedMpu6050(clock, identity=identity), Mpu6050Settings())
    with pytest.raises(SensorError, match="WHO_AM_I"):
        device.identify()


class OtherRegisters(SimulatedMpu6050):
    """An ICM42688-P: it answers at WHO_AM_I and keeps nothing of an MPU6050's set-up."""

    def _register(self, register: int) -> int:
        return super()._register(register) if register == Register.WHO_AM_I else 0


def test_a_chip_with_other_registers_is_refused_by_its_name(clock: Any) -> None:
    device = Mpu6050(OtherRegisters(clock, identity=0x47), Mpu6050Settings())
    device.identify()
    with pytest.raises(SensorError, match=r"PWR_MGMT_1: .*ICM42688-P, a chip with other registers"):
        device.configure()


def test_a_register_that_does_not_keep_its_value_is_named(clock: Any) -> None:
    class Stubborn(SimulatedMpu6050):
        def write(self, register: int, value: int) -> None:
            super().write(register, 0 if register == Register.GYRO_CONFIG else value)

    with pytest.raises(SensorError, match="GYRO_CONFIG: reads 0x00 after 0x18"):
        _set_up(Stubborn(clock), clock, gyro_range_deg=2000)


def test_a_sleeping_chip_shows_zeros_and_lost_settings(clock: Any) -> None:
    chip = SimulatedMpu6050(clock)
    device = _set_up(chip, clock)
    assert device.is_configured()
    chip.brown_out()
    clock.advance(0.01)
    assert device.read_packet() == bytes(14)
    assert not device.is_configured()


def test_a_fifo_that_would_overflow_between_two_polls_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"poll_rate: 10 Hz is too slow.*14 Hz"):
        Mpu6050Settings(reading=Reading.FIFO, poll_rate=10.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gyro_range_deg", 300),
        ("accel_range_g", 3),
        ("dlpf_config", 7),
        ("sample_rate_divider", 256),
        ("address", 0x50),
        ("poll_rate", 1500.0),
        ("gyro_stddev", math.nan),
    ],
)
def test_settings_the_chip_does_not_have_are_refused(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=name):
        Mpu6050Settings(**{name: value})


def test_a_missing_bus_is_one_clear_error() -> None:
    pytest.importorskip("smbus2")
    with pytest.raises(SensorError, match="/dev/i2c-250"):
        I2cRegisters(250, 0x68)
