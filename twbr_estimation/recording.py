"""A recording in memory: readings of the sensors and the reference, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .errors import RecordingError
from .parameters.argument_checks import require_kind, shown
from .samples import SINGLE_WHEEL_JOINT as SINGLE_WHEEL_JOINT

FloatArray = NDArray[np.float64]
StampArray = NDArray[np.int64]
ABSURD = 1e9
"""No angle, rate or acceleration in SI units is as large; a damaged recording may hold it."""


def _settle(track: Any, widths: Mapping[str, tuple[int, ...]]) -> None:
    """Make arrays of the fields of a track.

    Args:
        track: the instance, whose `stamps` every field has one value or row for.
        widths: columns that a field may have, by name; none for a single row of numbers.

    Raises:
        RecordingError: what is no array of numbers, or has another shape.
    """
    kind = type(track).__name__
    stamps = _array(f"{kind}.stamps", track.stamps, "iu", np.int64)
    if stamps.ndim != 1:
        raise RecordingError(f"{kind}.stamps: shape {stamps.shape} is not (n,)")
    object.__setattr__(track, "stamps", stamps)
    for name, columns in widths.items():
        values = _array(f"{kind}.{name}", getattr(track, name), "iuf", np.float64)
        allowed: list[tuple[int, ...]] = [(stamps.size, width) for width in columns] or [
            (stamps.size,)
        ]
        if values.shape not in allowed:
            wanted = " or ".join(map(str, allowed))
            raise RecordingError(
                f"{kind}.{name}: shape {values.shape} is not {wanted}: {stamps.size} stamps"
            )
        object.__setattr__(track, name, values)


def _array(name: str, value: object, kinds: str, dtype: type[Any]) -> NDArray[Any]:
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.asarray(None)
    if array.size == 0:
        array = array.astype(dtype) if array.dtype.kind in "iuf" else array
    elif array.dtype.kind not in kinds:
        wanted = "whole nanoseconds" if dtype is np.int64 else "numbers"
        raise RecordingError(f"{name}: {shown(value)}: an array of {wanted} is needed")
    return np.asarray(array, dtype)


class Track:
    """Columns with stamps, which are shown in a line."""

    __slots__ = ()
    stamps: StampArray

    def __repr__(self) -> str:
        """Return how many stamps there are, and over which time."""
        seconds = 1e-9 * float(np.ptp(self.stamps)) if self.stamps.size else 0.0
        return f"<{type(self).__name__}: {self.stamps.size} stamps over {seconds:.4g} s>"


@dataclass(frozen=True, slots=True, repr=False)
class ImuTrack(Track):
    """IMU readings in sensor axes as the device reports them."""

    stamps: StampArray
    """Header stamps [ns], (n,), strictly increasing."""
    gyro: FloatArray
    """Angular rate [rad/s], (n, 3)."""
    accel: FloatArray
    """Specific force [m/s^2], (n, 3)."""
    frame_id: str = "imu_link"

    def __post_init__(self) -> None:
        _settle(self, {"gyro": (3,), "accel": (3,)})
        require_kind("frame_id", self.frame_id, str, "a text")


@dataclass(frozen=True, slots=True, repr=False)
class WheelTrack(Track):
    """Wheel encoder angles."""

    stamps: StampArray
    """Header stamps [ns], (m,), strictly increasing."""
    angle: FloatArray
    """Encoder angle [rad], (m, w) with w = 1, or 2 as left, right."""
    is_distance: bool = False
    """Whether `angle` is the distance rolled [m], as that of an odometry; `with_angles` follows."""

    def __post_init__(self) -> None:
        _settle(self, {"angle": (1, 2)})

    def with_angles(self, radius: float) -> WheelTrack:
        """Return the track with angles in place of distances, by the wheels' radius [m]."""
        return WheelTrack(self.stamps, self.angle / radius) if self.is_distance else self


@dataclass(frozen=True, slots=True, repr=False)
class MotorTrack(Track):
    """Commands to the motors, each in force until the next."""

    stamps: StampArray
    """When each command was given [ns], (m,), strictly increasing."""
    voltage: FloatArray
    """Motor voltage [V], (m, w) with w = 1 for both motors together, or 2 as left, right."""

    def __post_init__(self) -> None:
        _settle(self, {"voltage": (1, 2)})


@dataclass(frozen=True, slots=True, repr=False)
class TiltTrack(Track):
    """A tilt over time: the reference encoder, the truth, or another estimator."""

    stamps: StampArray
    """Header stamps [ns], (m,), strictly increasing."""
    tilt: FloatArray
    """Tilt [rad], (m,)."""
    rate: FloatArray | None = None
    """Tilt rate [rad/s], (m,), where the source has it."""

    def __post_init__(self) -> None:
        _settle(self, {"tilt": ()} if self.rate is None else {"tilt": (), "rate": ()})


@dataclass(frozen=True, slots=True, repr=False)
class TemperatureTrack(Track):
    """The IMU's own temperature."""

    stamps: StampArray
    """Header stamps [ns], (m,), strictly increasing."""
    temperature: FloatArray
    """Temperature [degC], (m,)."""

    def __post_init__(self) -> None:
        _settle(self, {"temperature": ()})


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

    def __post_init__(self) -> None:
        require_kind("source", self.source, str, "a text")
        require_kind("imu", self.imu, ImuTrack, "an ImuTrack")
        for name, kind in _OPTIONAL.items():
            require_kind(name, getattr(self, name), (kind, type(None)), f"a {kind.__name__}")
        require_kind("estimators", self.estimators, Mapping, "a mapping of names to TiltTracks")
        for name, track in self.estimators.items():
            require_kind(f"estimators[{name!r}]", track, TiltTrack, "a TiltTrack")
        require_kind("repairs", self.repairs, Mapping, "a mapping of descriptions to counts")

    def __repr__(self) -> str:
        """Return a line about the length of the recording and what it holds."""
        held = ", ".join(name for name in _OPTIONAL if getattr(self, name) is not None)
        size = f"{self.imu.stamps.size} samples at {1e3 * self.dt:.3g} ms"
        return f"<Recording {self.source}: {size}{held and f', with {held}'}>"

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

    def with_wheel_angles(self, radius: float) -> Recording:
        """Return the recording with the wheels' angles, where it holds the distance they rolled.

        Args:
            radius: of the wheels [m].
        """
        if self.wheels is None or not self.wheels.is_distance:
            return self
        return replace(self, wheels=self.wheels.with_angles(radius))

    def require_usable(self) -> None:
        """Raise where filters cannot run: no sample, stamps that do not rise, no finite number.

        Raises:
            RecordingError: the message names the track.
        """
        if self.imu.stamps.size == 0:
            raise RecordingError(f"{self.source}: imu: there is no sample")
        tracks = {"imu": self.imu, **{name: getattr(self, name) for name in _OPTIONAL}}
        tracks.update(self.estimators)
        for name, track in tracks.items():
            if track is not None:
                _require_usable(f"{self.source}: {name}", track)


_OPTIONAL: Mapping[str, type[Any]] = {
    "wheels": WheelTrack,
    "reference": TiltTrack,
    "truth": TiltTrack,
    "temperature": TemperatureTrack,
    "motors": MotorTrack,
}
"""Tracks that a recording may have beside that of the IMU."""


def _require_usable(what: str, track: object) -> None:
    for each in fields(track):  # type: ignore[arg-type]
        values = getattr(track, each.name)
        if each.name == "stamps" and values.size > 1 and np.diff(values).min() <= 0:
            raise RecordingError(f"{what}.stamps: not strictly increasing")
        if each.type == "FloatArray" and not np.all(np.abs(values) < ABSURD):
            raise RecordingError(f"{what}.{each.name}: a value is not finite, or beyond {ABSURD:g}")
