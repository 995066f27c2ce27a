"""Read a recording: decode, clean, check and name what a bag holds."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..disk.reading import readable
from ..errors import ConfigurationError, RecordingError
from ..recording import (
    SINGLE_WHEEL_JOINT,
    ImuTrack,
    MotorTrack,
    Recording,
    TemperatureTrack,
    TiltTrack,
    WheelTrack,
)
from ..ros_messages import UNREPORTED, tilt_of_quaternion
from ..scoring.estimator_topics import EstimatorTopic, estimator_topic
from .cleaning import Cleaner, Required
from .contents import Contents, TopicRequest, read_contents
from .decoding import (
    ACCEL_COLUMNS,
    ACCEL_STATED,
    GYRO_COLUMNS,
    GYRO_STATED,
    ORIENTATION_COLUMNS,
    ORIENTATION_STATED,
    Columns,
)
from .restamping import restamped
from .topics import (
    FLOAT64,
    FLOAT64_ARRAY,
    IMU,
    JOINT_STATE,
    ODOMETRY,
    ROLES,
    TEMPERATURE,
    TopicNames,
    absolute,
)
from .wheel_tracks import repaired_wheels, rolled, wheel_columns

_UNIT_TOLERANCE = 0.1
"""Largest deviation of a quaternion's length from 1; two decimals keep it within 0.01."""
_WHEEL_TYPES = (JOINT_STATE, ODOMETRY)
_RESTAMPED = ("imu", "joint_states", "temperature")
"""Roles whose stamps may be those of a device."""
_TILT_TYPES = (JOINT_STATE, IMU, FLOAT64)


def read_recording(
    path: str | Path,
    topics: TopicNames | None = None,
    estimators: Mapping[str, str] | None = None,
    required: Collection[str] = (),
) -> Recording:
    """Read a rosbag2 directory, an .mcap or .db3 file, or a ROS 1 bag.

    Header stamps rule; the bag's own time serves only types without a header (Float64 and the
    motors' Float64MultiArray).
    Repairs are described and counted in the result, see `cleaning`.

    Args:
        path: The recording.
        topics: Topics and joints, where they differ from the defaults. An empty topic is
            not read; a topic that was given and is absent is an error.
        estimators: Topics of other estimators' tilt by name, Imu, Float64 or JointState, in
            the form of `estimator_topics`.
        required: Roles besides the IMU (fields of `TopicNames`) that must be there.

    Raises:
        RecordingError: no bag, a missing or empty topic, or tracks that do not overlap.
        ConfigurationError: an estimator in another form, or a role that does not exist.
    """
    names = topics or TopicNames()
    for role in required:
        if role not in ROLES:
            raise ConfigurationError(
                f"`required`: there is no {role!r}; there are {', '.join(ROLES)}"
            )
    reader = _Reader(Path(path), names, dict(estimators or {}), {"imu", *required})
    return reader.recording()


class _Reader:
    """One reading of one bag."""

    def __init__(
        self, path: Path, names: TopicNames, estimators: dict[str, str], required: set[str]
    ) -> None:
        self.path, self.names, self.required = path, names, required
        self.requests = _role_requests(names)
        self.described = {name: estimator_topic(text) for name, text in estimators.items()}
        self.estimators = {
            name: _tilt_request(each, names.reference_joint)
            for name, each in self.described.items()
        }
        wanted = [*self.requests.values(), *self.estimators.values()]
        self.contents: Contents = read_contents(path, list(dict.fromkeys(wanted)))
        self.repairs = self.contents.repairs

    def recording(self) -> Recording:
        """Return the recording, its tracks checked against the IMU's time."""
        imu = self._imu()
        recording = Recording(
            source=readable(self.path),
            imu=imu,
            wheels=self._wheels(),
            reference=self._tilt("reference"),
            truth=self._tilt("truth"),
            estimators={name: self._estimator(name) for name in self.estimators},
            temperature=self._temperature(),
            motors=self._motors(imu),
        )
        self._check_overlap(recording)
        return replace(recording, repairs=dict(self.repairs))

    def _imu(self) -> ImuTrack:
        topic = self.names.imu
        columns = self._columns("imu")
        assert columns is not None
        total = columns.stamps.size
        cleaner = Cleaner(topic, self.repairs)
        for covariance, what in ((GYRO_STATED, "rate"), (ACCEL_STATED, "acceleration")):
            reported = columns.values[:, covariance] != UNREPORTED
            columns = cleaner.keep(columns, reported, f"messages that report no {what} dropped")
        readings = (
            *range(GYRO_COLUMNS.start, GYRO_COLUMNS.stop),
            *range(ACCEL_COLUMNS.start, ACCEL_COLUMNS.stop),
        )
        columns = self._clean(topic, columns, readings, total)
        frame = str(columns.frames[0]) or "imu_link"
        return ImuTrack(
            columns.stamps, columns.values[:, GYRO_COLUMNS], columns.values[:, ACCEL_COLUMNS], frame
        )

    def _wheels(self) -> WheelTrack | None:
        columns = self._columns("joint_states")
        if columns is None:
            return None
        topic = self.names.joint_states
        if self.contents.types[topic] == ODOMETRY:
            return rolled(topic, self._clean(topic, columns, slice(None)), self.repairs)
        columns = wheel_columns(topic, columns, self.names.wheel_joints, self.repairs)
        columns = self._clean(topic, columns, slice(None))
        return repaired_wheels(topic, WheelTrack(columns.stamps, columns.values), self.repairs)

    def _tilt(self, role: str) -> TiltTrack | None:
        columns = self._columns(role)
        return None if columns is None else self._tilt_track(self.requests[role], columns)

    def _estimator(self, name: str) -> TiltTrack:
        request = self.estimators[name]
        if request not in self.contents.columns:
            raise self._missing(f"`estimators`: {name}", request.topic)
        columns = self._with_joint(request, f"`estimators`: {name}")
        published, described = self._tilt_track(request, columns), self.described[name]
        rate = None if published.rate is None else described.factor * published.rate
        return TiltTrack(published.stamps, described.tilt(published.tilt), rate)

    def _tilt_track(self, request: TopicRequest, columns: Columns) -> TiltTrack:
        if self.contents.types[request.topic] != IMU:
            columns = self._clean(request.topic, columns, slice(0, 1))
            rate = columns.values[:, 1] if columns.values.shape[1] > 1 else None
            if rate is not None and not np.all(np.isfinite(rate)):
                rate = None
            return TiltTrack(columns.stamps, columns.values[:, 0], rate)
        oriented = self._oriented(request.topic, columns)
        columns = self._clean(request.topic, oriented, ORIENTATION_COLUMNS, columns.stamps.size)
        x, y, z, w = columns.values[:, ORIENTATION_COLUMNS].T
        rates = columns.values[:, GYRO_COLUMNS]
        known = np.all(columns.values[:, GYRO_STATED] != UNREPORTED)
        rate = rates[:, 1] if known and np.all(np.isfinite(rates)) else None
        return TiltTrack(columns.stamps, tilt_of_quaternion(x, y, z, w), rate)

    def _oriented(self, topic: str, columns: Columns) -> Columns:
        """Drop messages that declare no orientation (REP-145) or hold a zero quaternion."""
        cleaner = Cleaner(topic, self.repairs)
        reported = columns.values[:, ORIENTATION_STATED] != UNREPORTED
        columns = cleaner.keep(columns, reported, "messages that report no orientation dropped")
        # One identity may be a robot upright; nothing else ever is a driver that sets none.
        default = np.all(columns.values[:, ORIENTATION_COLUMNS] == (0.0, 0.0, 0.0, 1.0), axis=1)
        default &= columns.values[:, ORIENTATION_STATED] == 0.0
        if default.size > 1 and default.all():
            what = "orientation stays at its default with covariance 0: its driver sets none"
            self.repairs[f"{topic}: {what}"] += default.size
        real = ~np.all(columns.values[:, ORIENTATION_COLUMNS] == 0.0, axis=1)
        columns = cleaner.keep(columns, real, "messages with a zero quaternion dropped")
        within = np.clip(columns.values[:, ORIENTATION_COLUMNS], -2.0, 2.0)
        unit = np.abs(np.linalg.norm(within, axis=1) - 1.0) <= _UNIT_TOLERANCE
        unit |= ~np.all(np.isfinite(within), axis=1)  # counted as such later
        return cleaner.keep(columns, unit, "messages with a quaternion not of length 1 dropped")

    def _temperature(self) -> TemperatureTrack | None:
        columns = self._columns("temperature")
        if columns is None:
            return None
        columns = self._clean(self.names.temperature, columns, slice(None))
        return TemperatureTrack(columns.stamps, columns.values[:, 0])

    def _motors(self, imu: ImuTrack) -> MotorTrack | None:
        topic, columns = self.names.motors, self._columns("motors")
        if columns is None:
            return None
        cleaner = Cleaner(topic, self.repairs)
        length = columns.values[:, 0]
        motors = 2 if np.count_nonzero(length == 2) >= np.count_nonzero(length == 1) else 1
        why = f"messages without {motors} voltages dropped"
        columns = cleaner.keep(columns, length == motors, why)
        columns.values = columns.values[:, 1 : 1 + motors]
        columns = self._clean(topic, columns, slice(None), length.size)
        if columns.stamps[0] > imu.stamps[-1] or columns.stamps[-1] < imu.stamps[0]:
            # A simulation's header stamps and the bag's times may be of two clocks.
            cleaner.count(f"messages of another time than {self.names.imu} left out", length.size)
            return None
        return MotorTrack(columns.stamps, columns.values)

    def _columns(self, role: str) -> Columns | None:
        """Return a role's messages; None where it may be absent and is."""
        request = self.requests.get(role)
        if request is None or request not in self.contents.columns:
            topic = getattr(self.names, role)
            if role in self.required or not (topic == "" or self.names.is_default(role)):
                smooth = "; `smooth` makes a reference" if role == "reference" else ""
                raise self._missing(f"`topics.{role}`", topic, smooth)
            return None
        joint = "wheel_joints" if role == "joint_states" else "reference_joint"
        columns = self._with_joint(request, f"`topics.{joint}`")
        if role not in _RESTAMPED:
            return columns
        return restamped(request.topic, columns, self.names.stamps, self.repairs)

    def _with_joint(self, request: TopicRequest, argument: str) -> Columns:
        columns = self.contents.columns[request]
        if request.joints and columns.names and not columns.stamps.size:
            if silent := [joint for joint in request.joints if joint in columns.names]:
                raise RecordingError(
                    f"{self.path}: {request.topic} gives neither position nor velocity of "
                    f"{', '.join(silent)}"
                )
            raise RecordingError(
                f"{self.path}: {request.topic} has no joint {' or '.join(request.joints)}; it has "
                f"{', '.join(sorted(columns.names))} (name the right one with {argument})"
            )
        return columns

    def _missing(self, argument: str, topic: str, remedy: str = "") -> RecordingError:
        types = self.contents.types
        if topic in types:
            return RecordingError(f"{self.path}: {topic} holds no messages{self._damage()}")
        there = "".join(f"\n  {name} [{kind}]" for name, kind in sorted(types.items()))
        return RecordingError(
            f"{self.path}: there is no topic {topic!r} "
            f"(name the right one with {argument}{remedy}); "
            + (f"there are:{there}" if there else f"there are no topics at all{self._damage()}")
        )

    def _damage(self) -> str:
        """Return what could not be read, for the message of a recording without content."""
        return "".join(f"; {what}: {number}" for what, number in self.repairs.items())

    def _clean(
        self, topic: str, columns: Columns, required: Required, total: int | None = None
    ) -> Columns:
        """Return the repaired messages; `total` were there before earlier repairs."""
        cleaner = Cleaner(topic, self.repairs)
        cleaner.count("damaged messages dropped", columns.broken)
        total = columns.stamps.size if total is None else total
        try:
            columns = cleaner.clean(columns, required)
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from error
        if not columns.stamps.size:
            reasons = "; ".join(f"{what}: {n}" for what, n in self.repairs.items())
            raise RecordingError(
                f"{self.path}: {topic}: none of {total} messages is usable ({reasons})"
            )
        return columns

    def _check_overlap(self, recording: Recording) -> None:
        """Require a common stretch of time, and count IMU samples outside the reference."""
        stamps = recording.imu.stamps
        tracks = {
            self.names.joint_states: recording.wheels,
            self.names.reference: recording.reference,
            self.names.truth: recording.truth,
            **{self.estimators[name].topic: track for name, track in recording.estimators.items()},
        }
        for topic, track in tracks.items():
            if track is None:
                continue
            first, last = track.stamps[0], track.stamps[-1]
            if last < stamps[0] or first > stamps[-1]:
                raise RecordingError(
                    f"{self.path}: {topic} ({first} to {last} ns) and {self.names.imu} "
                    f"({stamps[0]} to {stamps[-1]} ns) do not overlap in time; `topics.stamps`: "
                    "device relates the clock of a sender to the recorder's, arrival takes the "
                    f"time of recording{self._damage()}"
                )
        if recording.reference is not None:
            first, last = recording.reference.stamps[[0, -1]]
            outside = int(np.count_nonzero((stamps < first) | (stamps > last)))
            where = f"{self.names.imu}: samples outside the time of {self.names.reference}"
            # One sample at either end is how two interleaved streams begin and end.
            if outside > 2:
                self.repairs[where] += outside


def _role_requests(names: TopicNames) -> dict[str, TopicRequest]:
    wheels = (*names.wheel_joints, SINGLE_WHEEL_JOINT)
    tilt = (names.reference_joint,)
    requests = {
        "imu": TopicRequest(names.imu, (IMU,)),
        "joint_states": TopicRequest(names.joint_states, _WHEEL_TYPES, wheels, velocities=True),
        "reference": TopicRequest(names.reference, _TILT_TYPES, tilt),
        "truth": TopicRequest(names.truth, _TILT_TYPES, tilt),
        "temperature": TopicRequest(names.temperature, (TEMPERATURE,)),
        "motors": TopicRequest(names.motors, (FLOAT64_ARRAY,)),
    }
    return {role: request for role, request in requests.items() if request.topic}


def _tilt_request(described: EstimatorTopic, joint: str) -> TopicRequest:
    return TopicRequest(absolute(described.topic), _TILT_TYPES, (described.joint or joint,))
