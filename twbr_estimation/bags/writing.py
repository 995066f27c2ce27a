"""Write a recording as a rosbag2 directory: metadata.yaml and one zstd-compressed MCAP file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..disk.reading import exists
from ..disk.writing import whole_folder
from ..errors import RecordingError
from ..recording import SINGLE_WHEEL_JOINT, Recording, StampArray, TiltTrack
from ..samples import LAST_STAMP
from .encoding import (
    float64_array_messages,
    imu_messages,
    joint_state_messages,
    orientation_messages,
    temperature_messages,
)
from .mcap_checksums import add_checksums
from .topics import FLOAT64_ARRAY, IMU, JOINT_STATE, TEMPERATURE, TopicNames

if TYPE_CHECKING:
    from rosbags.interfaces import Qos


@dataclass(frozen=True, slots=True)
class BagTopic:
    """Serialised messages of one topic."""

    topic: str
    type: str
    """For example `std_msgs/msg/Float64`; a type that ROS 2 Jazzy ships."""
    stamps: StampArray
    """When each message was recorded [ns], (n,)."""
    messages: Sequence[bytes]
    """Serialised in little-endian XCDR version 1, (n,)."""


def write_recording(
    path: str | Path,
    recording: Recording,
    extra_messages: Iterable[BagTopic] = (),
    *,
    overwrite: bool = False,
    beside: Callable[[Path], None] = lambda folder: None,
) -> None:
    """Write a recording so that `ros2 bag` and `read_recording` can read it.

    A sample's stamp is both its header's and the bag's time; the same recording gives the
    same bytes. Estimators' tilt becomes the orientation of an Imu on `/imu/NAME`. The folder
    appears whole, or what was there stays; every chunk and the file carry checksums.

    Args:
        path: Directory to create.
        recording: What to write.
        extra_messages: Further topics.
        overwrite: Whether an existing recording at `path` is replaced.
        beside: Writes further files into the folder it is given, before that appears.

    Raises:
        RecordingError: something exists at `path`, or is no recording that may be replaced; or a
            stamp is outside of what a message can hold.
        WritingError: it cannot be written.
    """
    target = Path(path)
    own = _recording_topics(recording)
    for entry in own:
        _require_stamps(entry)
    topics = [*own, *extra_messages]
    require_room(target, overwrite)
    size = sum(len(message) for entry in topics for message in entry.messages)
    with whole_folder(target, size, replace=overwrite) as folder:
        _write(folder, topics)
        add_checksums(folder / f"{folder.name}.mcap")
        beside(folder)


def _require_stamps(entry: BagTopic) -> None:
    if entry.stamps.size == 0:
        return
    first, last = int(entry.stamps.min()), int(entry.stamps.max())
    if first < 0 or last > LAST_STAMP:
        raise RecordingError(
            f"{entry.topic}: stamps from {first} to {last} ns; a message holds 0 to {LAST_STAMP} ns"
        )


def _write(folder: Path, topics: Sequence[BagTopic]) -> None:
    # rosbags is imported where something is written: reading does without, and starts sooner.
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    typestore = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        connections = [
            writer.add_connection(
                entry.topic, entry.type, typestore=typestore, offered_qos_profiles=[_reliable()]
            )
            for entry in topics
        ]
        for topic, index, stamp in _in_time(topics):
            writer.write(connections[topic], stamp, topics[topic].messages[index])


def _reliable() -> Qos:
    """Return rosbag2's description of ROS' default quality of service."""
    from rosbags import interfaces as rosbags

    forever = rosbags.QosTime(9223372036, 854775807)
    return rosbags.Qos(
        rosbags.QosHistory.KEEP_LAST,
        10,
        rosbags.QosReliability.RELIABLE,
        rosbags.QosDurability.VOLATILE,
        forever,
        forever,
        rosbags.QosLiveliness.AUTOMATIC,
        forever,
        avoid_ros_namespace_conventions=False,
    )


def estimator_topic(name: str) -> str:
    """Return the topic on which `write_recording` stores an estimator."""
    return f"/imu/{name}"


def _recording_topics(recording: Recording) -> list[BagTopic]:
    names = TopicNames()
    imu = recording.imu
    topics = [BagTopic(names.imu, IMU, imu.stamps, imu_messages(imu))]
    if recording.wheels is not None:
        stamps, angle = recording.wheels.stamps, recording.wheels.angle
        joints = names.wheel_joints if angle.shape[1] == 2 else (SINGLE_WHEEL_JOINT,)
        messages = joint_state_messages(stamps, joints, angle, None)
        topics.append(BagTopic(names.joint_states, JOINT_STATE, stamps, messages))
    for topic, track in ((names.reference, recording.reference), (names.truth, recording.truth)):
        if track is not None:
            topics.append(_joint_topic(topic, names.reference_joint, track))
    for name, track in recording.estimators.items():
        messages = orientation_messages(track.stamps, track.tilt, track.rate, imu.frame_id)
        topics.append(BagTopic(estimator_topic(name), IMU, track.stamps, messages))
    if recording.temperature is not None:
        stamps = recording.temperature.stamps
        messages = temperature_messages(stamps, recording.temperature.temperature, imu.frame_id)
        topics.append(BagTopic(names.temperature, TEMPERATURE, stamps, messages))
    if recording.motors is not None:
        stamps, messages = recording.motors.stamps, float64_array_messages(recording.motors.voltage)
        topics.append(BagTopic(names.motors, FLOAT64_ARRAY, stamps, messages))
    return topics


def _joint_topic(topic: str, joint: str, track: TiltTrack) -> BagTopic:
    rate = None if track.rate is None else track.rate[:, None]
    messages = joint_state_messages(track.stamps, (joint,), track.tilt[:, None], rate)
    return BagTopic(topic, JOINT_STATE, track.stamps, messages)


def _in_time(topics: Sequence[BagTopic]) -> Iterable[tuple[int, int, int]]:
    """Yield topic number, message number and stamp in the order of the stamps."""
    stamps = np.concatenate([entry.stamps for entry in topics])
    topic = np.repeat(np.arange(len(topics)), [entry.stamps.size for entry in topics])
    index = np.concatenate([np.arange(entry.stamps.size) for entry in topics])
    order = np.lexsort((index, topic, stamps))
    return zip(topic[order].tolist(), index[order].tolist(), stamps[order].tolist(), strict=True)


def require_room(target: Path, overwrite: bool) -> None:
    """Check that a recording may be written there, before the work of making it.

    Raises:
        RecordingError: something exists there and `overwrite` is not set, or it is no recording.
    """
    if not exists(target):
        return
    if not overwrite:
        raise RecordingError(f"{target}: exists already; `overwrite` lets it be replaced")
    if not (target / "metadata.yaml").is_file():
        raise RecordingError(f"{target} is not a recording; it is not deleted")
