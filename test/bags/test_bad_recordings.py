"""What is wrong with a recording is said or counted, never passed on as a number."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin

from bags.copies import copy_with_rosbags
from twbr_estimation.bags import BagTopic, TopicNames, read_recording, write_recording
from twbr_estimation.bags.encoding import (
    float64_array_messages,
    imu_messages,
    joint_state_messages,
    orientation_messages,
)
from twbr_estimation.bags.topics import FLOAT64, FLOAT64_ARRAY, IMU, JOINT_STATE
from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.recording import ImuTrack, Recording, TiltTrack

Make = Callable[..., Recording]
START = 1_700_000_000_000_000_000
PERIOD = 2_000_000


def write_topics(path: Path, *topics: BagTopic, **options: object) -> Path:
    """Write topics in the given order with rising bag times, whatever their stamps."""
    with path.open("wb") as file:
        writer = McapWriter(file, **options)
        writer.start(profile="ros2")
        for topic in topics:
            schema = writer.register_schema(topic.type, "ros2msg", b"")
            channel = writer.register_channel(topic.topic, "cdr", schema)
            for index, message in enumerate(topic.messages):
                time = START + PERIOD * index
                writer.add_message(channel, time, message, time)
        writer.finish()
    return path


def imu_topic(stamps: Sequence[int], gyro: np.ndarray | None = None, frame: str = "i") -> BagTopic:
    """Return IMU messages whose gyro y counts them, unless given."""
    array = np.array(stamps, dtype=np.int64)
    if gyro is None:
        gyro = np.zeros((array.size, 3))
        gyro[:, 1] = np.arange(array.size)
    track = ImuTrack(array, gyro, np.tile([0.0, 0.0, 9.8], (array.size, 1)), frame)
    return BagTopic("/imu/data_raw", IMU, array, imu_messages(track))


def regular(count: int, start: int = START) -> list[int]:
    return [start + PERIOD * index for index in range(count)]


def repairs_of(recording: Recording, text: str) -> int:
    """Return the count of the one repair whose description contains `text`."""
    (count,) = (number for what, number in recording.repairs.items() if text in what)
    return count


def database(folder: Path, small_recording: Make) -> Path:
    """Return a small recording in sqlite3."""
    write_recording(folder / "ours", small_recording(samples=1000))
    copy_with_rosbags(folder / "ours", folder / "copy", StoragePlugin.SQLITE3)
    return folder / "copy" / "copy.db3"


def test_a_missing_topic_lists_what_there_is_and_the_flag(tmp_path: Path) -> None:
    path = write_topics(tmp_path / "a.mcap", replace(imu_topic(regular(5)), topic="/other"))
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    for text in ("a.mcap", "/imu/data_raw", "/other", "sensor_msgs/msg/Imu", "`topics.imu`"):
        assert text in str(caught.value)


@pytest.mark.parametrize(
    "topics", [TopicNames(reference="/mocap"), TopicNames(joint_states="wheels")]
)
def test_a_topic_that_was_asked_for_must_be_there(tmp_path: Path, topics: TopicNames) -> None:
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(5)))
    with pytest.raises(RecordingError, match="there is no topic"):
        read_recording(path, topics)
    assert read_recording(path).reference is None
    with pytest.raises(RecordingError, match=r"`topics\.reference`"):
        read_recording(path, required=["reference"])


def test_a_missing_estimator_and_a_wrong_type_are_named(tmp_path: Path) -> None:
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(5)))
    with pytest.raises(RecordingError, match="`estimators`: dmp"):
        read_recording(path, estimators={"dmp": "imu/dmp"})
    with pytest.raises(RecordingError, match=r"JointState"):
        read_recording(path, TopicNames(joint_states="/imu/data_raw"))


def test_a_topic_without_messages_and_an_empty_bag(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="holds no messages"):
        read_recording(write_topics(tmp_path / "a.mcap", imu_topic([])))
    with pytest.raises(RecordingError, match="no topics at all"):
        read_recording(write_topics(tmp_path / "b.mcap"))


@pytest.mark.parametrize("content", [b"", b"\0" * 100, b"SQLite format 3\0", b"#ROSBAG V2.0\n"])
@pytest.mark.parametrize("name", ["a.mcap", "a.db3", "a.bag", "a.txt"])
def test_what_is_no_bag_is_refused(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(RecordingError, match=re.escape(name)):
        read_recording(tmp_path / name)


def test_missing_files_are_named(tmp_path: Path, small_recording: Make) -> None:
    with pytest.raises(RecordingError, match="no such recording"):
        read_recording(tmp_path / "none")
    write_recording(tmp_path / "bag", small_recording())
    (file,) = (tmp_path / "bag").glob("*.mcap")
    file.rename(tmp_path / "bag" / "lost")
    with pytest.raises(RecordingError, match=re.escape(file.name)):
        read_recording(tmp_path / "bag")
    (tmp_path / "bag" / "metadata.yaml").write_text("rosbag2_bagfile_information: {")
    with pytest.raises(RecordingError, match=r"metadata\.yaml"):
        read_recording(tmp_path / "bag")
    (tmp_path / "bag" / "metadata.yaml").unlink()
    with pytest.raises(RecordingError, match="holds no recording"):
        read_recording(tmp_path / "bag")


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("share", [0.3, 0.7, 0.98])
def test_a_truncated_file_gives_its_beginning(
    tmp_path: Path, compression: CompressionType, share: float
) -> None:
    random = np.random.default_rng(1)
    topic = imu_topic(regular(3000), random.normal(size=(3000, 3)))
    path = write_topics(tmp_path / "a.mcap", topic, compression=compression, chunk_size=50_000)
    whole = read_recording(path).imu
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    cut = read_recording(path)
    count = cut.imu.stamps.size
    assert 0.8 * share - 0.1 < count / 3000 <= 1.0
    np.testing.assert_array_equal(cut.imu.stamps, whole.stamps[:count])
    np.testing.assert_array_equal(cut.imu.gyro, whole.gyro[:count])
    assert repairs_of(cut, "cut off") == 1


def test_a_file_padded_with_zeros_counts_as_cut_off(tmp_path: Path) -> None:
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(100)), use_chunking=False)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2] + bytes(len(content) // 2))
    cut = read_recording(path)
    assert 20 < cut.imu.stamps.size < 60
    np.testing.assert_array_equal(cut.imu.gyro[:, 1], np.arange(cut.imu.stamps.size))


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_damaged_chunk_is_left_out_and_counted(
    tmp_path: Path, compression: CompressionType
) -> None:
    random = np.random.default_rng(1)
    topic = imu_topic(regular(3000), random.normal(size=(3000, 3)))
    path = write_topics(tmp_path / "a.mcap", topic, compression=compression, chunk_size=50_000)
    whole = read_recording(path).imu
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 40] = bytes(40)
    path.write_bytes(content)
    got = read_recording(path)
    assert 2500 < got.imu.stamps.size < 3000
    rows = np.searchsorted(whole.stamps, got.imu.stamps)
    np.testing.assert_array_equal(got.imu.gyro, whole.gyro[rows])
    assert repairs_of(got, "chunk") == 1 and repairs_of(got, "gaps") == 1


@pytest.mark.parametrize("percent", [50, 90, 99])
def test_a_truncated_database_is_read_up_to_there(
    tmp_path: Path, small_recording: Make, percent: int
) -> None:
    """SQLite itself refuses a file that is shorter than its header says."""
    path = database(tmp_path, small_recording)
    whole, content = read_recording(path).imu, path.read_bytes()
    (tmp_path / "cut.db3").write_bytes(content[: len(content) * percent // 100])
    got = read_recording(tmp_path / "cut.db3")
    count = got.imu.stamps.size
    assert 10 * (percent - 5) <= count < 1000
    np.testing.assert_array_equal(got.imu.gyro, whole.gyro[:count])
    assert repairs_of(got, "file is cut off; read up to there; .recover") == 1


def test_a_database_cut_off_at_its_beginning_is_refused(
    tmp_path: Path, small_recording: Make
) -> None:
    content = database(tmp_path, small_recording).read_bytes()
    (tmp_path / "cut.db3").write_bytes(content[: len(content) // 40])
    with pytest.raises(RecordingError, match=r"cut\.db3.*cut off"):
        read_recording(tmp_path / "cut.db3")


def test_a_damaged_database_is_read_up_to_the_damage(tmp_path: Path, small_recording: Make) -> None:
    path = database(tmp_path, small_recording)
    whole = read_recording(path).imu
    content = bytearray(path.read_bytes())
    half = len(content) // 2 // 4096 * 4096
    content[half : half + 8192] = bytes(8192)
    path.write_bytes(content)
    names = TopicNames(joint_states="", reference="", truth="", temperature="")
    got = read_recording(path, names)
    count = got.imu.stamps.size
    assert 100 < count < whole.stamps.size
    np.testing.assert_array_equal(got.imu.gyro, whole.gyro[:count])
    assert repairs_of(got, "database is damaged") == 1


def test_nan_and_infinity_are_dropped(tmp_path: Path) -> None:
    gyro = np.zeros((10, 3))
    gyro[2, 0], gyro[5, 2] = np.nan, np.inf
    got = read_recording(write_topics(tmp_path / "a.mcap", imu_topic(regular(10), gyro)))
    assert got.imu.stamps.size == 8
    assert repairs_of(got, "NaN") == 2


def test_only_nan_is_an_error(tmp_path: Path) -> None:
    topic = imu_topic(regular(10), np.full((10, 3), np.nan))
    with pytest.raises(RecordingError, match="none of 10 messages is usable"):
        read_recording(write_topics(tmp_path / "a.mcap", topic))


def test_other_frames_are_another_sensor(tmp_path: Path) -> None:
    stamps = regular(20)
    near, far = imu_topic(stamps, frame="imu_link"), imu_topic(stamps, frame="camera_imu")
    mixed = [far.messages[i] if i % 5 == 0 else near.messages[i] for i in range(20)]
    got = read_recording(write_topics(tmp_path / "a.mcap", replace(near, messages=mixed)))
    assert got.imu.frame_id == "imu_link"
    np.testing.assert_array_equal(got.imu.gyro[:, 1], [i for i in range(20) if i % 5])
    assert repairs_of(got, "frame other than 'imu_link'") == 4


def tilt_topic(stamps: Sequence[int], tilt: np.ndarray, topic: str = "/imu/dmp") -> BagTopic:
    array = np.array(stamps, dtype=np.int64)
    return BagTopic(topic, IMU, array, orientation_messages(array, tilt, None, "i"))


def test_quaternions_that_are_none_are_dropped(tmp_path: Path) -> None:
    stamps = regular(10)
    tilt = np.linspace(-0.5, 0.5, 10)
    estimator = tilt_topic(stamps, tilt)
    messages = list(estimator.messages)
    at = len(messages[0]) - 37 * 8
    messages[3] = messages[3][:at] + bytes(32) + messages[3][at + 32 :]
    unreported = np.array([-1.0]).tobytes()
    messages[6] = messages[6][: at + 32] + unreported + messages[6][at + 40 :]
    huge = np.array([1e200]).tobytes()
    messages[8] = messages[8][:at] + huge + messages[8][at + 8 :]
    nan = np.array([np.nan]).tobytes()
    messages[9] = messages[9][:at] + nan + messages[9][at + 8 :]
    path = write_topics(
        tmp_path / "a.mcap", imu_topic(stamps), replace(estimator, messages=messages)
    )
    got = read_recording(path, estimators={"dmp": "/imu/dmp"})
    kept = [i for i in range(10) if i not in (3, 6, 8, 9)]
    np.testing.assert_allclose(got.estimators["dmp"].tilt, tilt[kept], atol=1e-15)
    assert repairs_of(got, "zero quaternion") == 1
    assert repairs_of(got, "no orientation") == 1
    assert repairs_of(got, "length 1") == 1
    assert repairs_of(got, "NaN") == 1


def test_a_raw_imu_is_no_estimator(tmp_path: Path) -> None:
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(10)))
    with pytest.raises(RecordingError, match="no orientation"):
        read_recording(path, estimators={"raw": "/imu/data_raw"})


def test_a_float64_estimator_has_the_bags_time(tmp_path: Path) -> None:
    messages = [b"\0\1\0\0" + np.array([0.1 * i]).tobytes() for i in range(10)]
    tilt = BagTopic("/tilt", FLOAT64, np.array(regular(10)), messages)
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(10, START + 500)), tilt)
    track = read_recording(path, estimators={"mine": "tilt"}).estimators["mine"]
    np.testing.assert_array_equal(track.stamps, regular(10))
    np.testing.assert_allclose(track.tilt, 0.1 * np.arange(10))
    turned = {"mine": "tilt,sign=-1,unit=deg,offset_deg=-0.5"}
    track = read_recording(path, estimators=turned).estimators["mine"]
    np.testing.assert_allclose(np.degrees(track.tilt), -0.1 * np.arange(10) - 0.5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("tilt,sign=0", "'sign=0' is not understood; expected TOPIC"),
        ("tilt,unit=turns", "'unit=turns' is not understood"),
        ("tilt,offset_deg=much", "'much' is not a finite number"),
        ("tilt,offset_deg=inf", "'inf' is not a finite number"),
        (",sign=-1", "names no topic"),
        ("tilt,upside_down", "'upside_down' is not understood"),
    ],
)
def test_an_estimator_in_another_form_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(10)))
    with pytest.raises(ConfigurationError, match=re.escape(said)):
        read_recording(path, estimators={"mine": text})


def joint_topic(
    topic: str, stamps: Sequence[int], names: tuple[str, ...], position: np.ndarray
) -> BagTopic:
    array = np.array(stamps, dtype=np.int64)
    messages = joint_state_messages(array, names, position, None)
    return BagTopic(topic, JOINT_STATE, array, messages)


def test_a_reference_that_does_not_overlap_is_an_error(tmp_path: Path) -> None:
    late = regular(10, START + 10**12)
    reference = joint_topic("/reference/joint_states", late, ("tilt",), np.zeros((10, 1)))
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(10)), reference)
    with pytest.raises(RecordingError, match="do not overlap"):
        read_recording(path)


def test_a_reference_shorter_than_the_data_is_counted(tmp_path: Path) -> None:
    short = regular(10, START + 20 * PERIOD)
    reference = joint_topic("/reference/joint_states", short, ("tilt",), np.zeros((10, 1)))
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(50)), reference)
    got = read_recording(path)
    assert repairs_of(got, "outside the time of /reference") == 40
    # A Counter would not survive this: it takes the pairs for keys.
    assert asdict(got)["repairs"] == got.repairs


def test_motor_commands_of_another_number_or_another_clock(tmp_path: Path) -> None:
    def motors(stamps: Sequence[int]) -> BagTopic:
        messages = float64_array_messages(np.ones((len(stamps) - 1, 2)))
        messages += float64_array_messages(np.ones((1, 1)))
        return BagTopic("/motor/command", FLOAT64_ARRAY, np.array(stamps), messages)

    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(10)), motors(regular(10)))
    got = read_recording(path)
    assert got.motors is not None and got.motors.voltage.shape == (9, 2)
    assert repairs_of(got, "without 2 voltages") == 1
    simulated = imu_topic(regular(10, 10**9))
    got = read_recording(write_topics(tmp_path / "b.mcap", simulated, motors(regular(10))))
    assert got.motors is None
    assert repairs_of(got, "another time") == 10


def test_unknown_joints_are_listed(tmp_path: Path) -> None:
    wheels = joint_topic("/joint_states", regular(10), ("wheel_a", "wheel_b"), np.zeros((10, 2)))
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(10)), wheels)
    with pytest.raises(RecordingError, match=r"wheel_a, wheel_b.*`topics\.wheel_joints`"):
        read_recording(path)
    named = read_recording(path, TopicNames(wheel_joints=("wheel_b",))).wheels
    assert named is not None and named.angle.shape == (10, 1)
    assert read_recording(path, TopicNames(joint_states="")).wheels is None


def test_one_wheel_of_two_is_counted(tmp_path: Path) -> None:
    position = np.arange(10.0)[:, None]
    wheels = joint_topic("/joint_states", regular(10), ("left_wheel_joint",), position)
    got = read_recording(write_topics(tmp_path / "a.mcap", imu_topic(regular(10)), wheels))
    assert got.wheels is not None
    np.testing.assert_array_equal(got.wheels.angle, position)
    assert repairs_of(got, "without right_wheel_joint") == 10


def test_other_joints_on_the_topic_are_passed_over(tmp_path: Path) -> None:
    names = ("left_wheel_joint", "right_wheel_joint")
    wheels = joint_topic("/joint_states", regular(10), names, np.ones((10, 2)))
    arm = joint_topic("/joint_states", regular(10), ("arm", "hand", "finger"), np.zeros((10, 3)))
    turned = joint_topic("/joint_states", regular(10), ("x", *names[::-1]), np.ones((10, 3)) * 2)
    mixed = [(wheels, arm, turned)[i % 3].messages[i] for i in range(10)]
    path = write_topics(
        tmp_path / "a.mcap", imu_topic(regular(10)), replace(wheels, messages=mixed)
    )
    got = read_recording(path).wheels
    assert got is not None
    np.testing.assert_array_equal(got.stamps, [regular(10)[i] for i in range(10) if i % 3 != 1])
    np.testing.assert_array_equal(got.angle[:, 0], [1, 2, 1, 2, 1, 2, 1])


def test_damaged_messages_are_counted(tmp_path: Path) -> None:
    topic = imu_topic(regular(10))
    messages = list(topic.messages)
    messages[4] = messages[4][:100]
    messages[2] = b"\x55" * len(messages[2])
    messages[7] = b"\0\1\0\0"
    messages[8] = messages[8][:12] + b"\xff\xff\xff\x7f" + messages[8][16:]
    got = read_recording(write_topics(tmp_path / "a.mcap", replace(topic, messages=messages)))
    np.testing.assert_array_equal(got.imu.gyro[:, 1], [0, 1, 3, 5, 6, 9])
    assert repairs_of(got, "damaged messages") == 4


def test_another_serialisation_is_refused(tmp_path: Path) -> None:
    topic = imu_topic(regular(3))
    messages = [b"\0\7" + message[2:] for message in topic.messages]
    with pytest.raises(RecordingError, match="encapsulation 0x0007"):
        read_recording(write_topics(tmp_path / "a.mcap", replace(topic, messages=messages)))


def test_an_existing_track_without_overlap_of_clocks_names_both(tmp_path: Path) -> None:
    dmp = tilt_topic(regular(10, 5), np.zeros(10))
    path = write_topics(tmp_path / "a.mcap", imu_topic(regular(10)), dmp)
    with pytest.raises(RecordingError, match=r"/imu/dmp.*/imu/data_raw"):
        read_recording(path, estimators={"dmp": "/imu/dmp"})


def test_a_track_may_be_of_one_message(tmp_path: Path) -> None:
    recording = read_recording(write_topics(tmp_path / "a.mcap", imu_topic(regular(1))))
    assert recording.imu.stamps.size == 1 and recording.repairs == {}
    assert TiltTrack(recording.imu.stamps, recording.imu.gyro[:, 1]).tilt.shape == (1,)


def test_an_orientation_that_was_never_set_is_named(tmp_path: Path) -> None:
    stamps = regular(10)
    path = write_topics(tmp_path / "a.mcap", imu_topic(stamps), tilt_topic(stamps, np.zeros(10)))
    got = read_recording(path, estimators={"dmp": "/imu/dmp"})
    assert repairs_of(got, "stays at its default with covariance 0") == 10
    leaning = tilt_topic(stamps, np.r_[0.0, np.full(9, 0.1)])
    path = write_topics(tmp_path / "b.mcap", imu_topic(stamps), leaning)
    assert read_recording(path, estimators={"dmp": "/imu/dmp"}).repairs == {}
