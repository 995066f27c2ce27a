"""A recording in memory: what the sensors and the reference said, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .samples import SINGLE_WHEEL_JOINT as SINGLE_WHEEL_JOINT

FloatArray = NDArray[np.float64]
StampArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class ImuTrack:
    """IMU readings in sensor axes as the device reports them."""

    stamps: StampArray
    """Header stamps [ns], (n,), strictly increasing."""
    gyro: FloatArray
    """Angular rate [rad/s], (n, 3)."""
    accel: FloatArray
    """Specific force [m/s^2], (n, 3)."""
    frame_id: str = "imu_link"


@dataclass(frozen=True, slots=True)
class WheelTrack:
    """Wheel encoder angles."""

    stamps: StampArray
    """Header stamps [ns], (m,), strictly increasing."""
    angle: FloatArray
    """Encoder angle [rad], (m, w) with w = 1, or 2 as left, right."""


@dataclass(frozen=True, slots=True)
class MotorTrack:
    """Commands to the motors, each in force until the next."""

    stamps: StampArray
    """When each command was given [ns], (m,), strictly increasing."""
    voltage: FloatArray
    """Motor voltage [V], (m, w) with w = 1 for both motors together, or 2 as left, right."""


@dataclass(frozen=True, slots=True)
class TiltTrack:
    """A tilt over time: the reference encoder, the truth, or another estimator."""

    stamps: StampArray
    """Header stamps [ns], (m,), strictly increasing."""
    tilt: FloatArray
    """Tilt [rad], (m,)."""
    rate: FloatArray | None = None
    """Tilt rate [rad/s], (m,), where the source has it."""


@dataclass(frozen=True, slots=True)
class TemperatureTrack:
    """The IMU's own temperature."""

    stamps: StampArray
    """Header stamps [ns], (m,), strictly increasing."""
    temperature: FloatArray
    """Temperature [degC], (m,)."""


class Event(NamedTuple):
    """A period in which something happens to the robot."""

    name: str
    """For example `lying`, `carried`, or `after` such an event."""
    begin: int
    """[ns]."""
    end: int
    """[ns]."""


@dataclass(frozen=True, slots=True)
class Recording:
    """One recording, cleaned: stamps increase, values are finite, repairs are counted."""

    source: str
    """Where it came from: a path, or a description of the simulation."""
    imu: ImuTrack
    wheels: WheelTrack | None = None
    reference: TiltTrack | None = None
    truth: TiltTrack | None = None
    """The simulator's true tilt, where there is one."""
    estimators: Mapping[str, TiltTrack] = field(default_factory=dict)
    """Other estimators' tilt by name, for comparison."""
    temperature: TemperatureTrack | None = None
    motors: MotorTrack | None = None
    repairs: Mapping[str, int] = field(default_factory=dict)
    """What had to be mended, by description, with the number of messages."""

    @property
    def dt(self) -> float:
        """Median sampling period [s]."""
        if self.imu.stamps.size < 2:
            return 0.0
        return float(np.median(np.diff(self.imu.stamps))) * 1e-9

    @property
    def duration(self) -> float:
        """Time from the first to the last IMU sample [s]."""
        if self.imu.stamps.size == 0:
            return 0.0
        return float(self.imu.stamps[-1] - self.imu.stamps[0]) * 1e-9
