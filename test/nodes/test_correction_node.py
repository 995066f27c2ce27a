"""The correction node on real middleware: counted messages, never timed ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from twbr_estimation.batch import correct
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.pipeline.pairing import WheelReading, pair
from twbr_estimation.robot import Calibration, Setup
from twbr_estimation.ros_messages import set_stamp, stamp_of, tilt_of

BIAS = [0.02, -0.01, 0.005]


def node_in(graph: Any, **parameters: Any) -> CorrectionNode:
    lossless = graph.lossless("imu/data_raw", "joint_states", published=("imu/data_corrected",))
    return graph.add(CorrectionNode(**graph.options(**lossless, **parameters)))


def test_an_odometry_takes_the_place_of_the_joints(graph: Any, sensors: Any) -> None:
    """The robot's forward speed, with the radius of the correction, gives the same angles."""
    lossless = graph.lossless("imu/data_raw", "odom", published=("imu/data_corrected",))
    options = {"wheel_source": "odometry", "robot.wheel_radius": 0.05}
    node = graph.add(CorrectionNode(**graph.options(**lossless, **options)))
    taken: list[WheelReading] = []
    node.pass_wheels = taken.append
    publisher = graph.probe.create_publisher(Odometry, "odom", 50)
    graph.settle()
    for index in range(20):
        message = Odometry()
        message.header.frame_id, message.child_frame_id = "odom", "base_link"
        message.twist.twist.linear.x = 0.2
        set_stamp(message, 10**9 + index * 10_000_000)
        publisher.publish(message)
    graph.spin_until(lambda: len(taken) == 20)
    assert taken[-1].angle == pytest.approx(19 * 0.01 * 0.2 / 0.05)


def latest_status(received: list[DiagnosticArray], name: str) -> Any:
    found = [s for message in received for s in message.status if s.name == name]
    return found[-1] if found else None


def figure(status: Any, key: str) -> str | None:
    return {each.key: each.value for each in status.values}.get(key)


def test_live_equals_offline(graph: Any, sensors: Any) -> None:
    node_in(graph, calibration__gyro_bias=BIAS)
    received = graph.collect(Imu, "imu/data_corrected")
    graph.settle()
    drive = sensors.drive(400)
    sensors.play(drive)
    graph.spin_until(lambda: len(received) == 400)
    setup = Setup(calibration=Calibration(gyro_bias=tuple(BIAS)))
    offline = correct(pair(drive.imu, drive.wheels), setup)
    assert [stamp_of(message) for message in received] == drive.imu.stamps.tolist()
    angles = [tilt_of(message.orientation) for message in received]
    np.testing.assert_allclose(angles, offline.field("angle"), atol=1e-12)
    variances = [message.orientation_covariance[4] for message in received]
    np.testing.assert_allclose(variances, offline.field("angle_variance"), rtol=1e-12)
    rates = [message.angular_velocity.y for message in received]
    np.testing.assert_allclose(rates, offline.field("gyro_y"), atol=1e-12)
    last = received[-1]
    assert last.header.frame_id == "imu_link"
    assert last.orientation_covariance[0] > 9.0 and last.orientation_covariance[8] > 9.0


def test_bad_samples_never_come_out(graph: Any, sensors: Any) -> None:
    node_in(graph)
    received = graph.collect(Imu, "imu/data_corrected")
    diagnostics = graph.collect(DiagnosticArray, "/diagnostics")
    graph.settle()
    drive = sensors.drive(20)
    stamps = drive.imu.stamps.tolist()
    sensors.play(drive, stop=10)
    sensors.imu(stamps[9], accel=(0.0, 0.0, 9.8))  # repeated
    sensors.imu(0, accel=(0.0, 0.0, 9.8))
    sensors.imu(stamps[9] + 1000, accel=(float("nan"), 0.0, 9.8))
    sensors.imu(stamps[9] + 2000, gyro=(float("inf"), 0.0, 0.0))
    sensors.play(drive, start=10)
    graph.spin_until(lambda: len(received) == 20)
    assert [stamp_of(message) for message in received] == stamps

    def counted() -> bool:
        status = latest_status(diagnostics, "correction_node")
        return status is not None and figure(status, "imu_not_finite") == "2"

    graph.spin_until(counted)
    status = latest_status(diagnostics, "correction_node")
    assert figure(status, "imu_zero_stamp") == "1"
    assert figure(status, "imu_repeated_stamp") == "1"
    assert figure(status, "samples") == "20"


def test_a_dead_encoder_is_reported_and_its_return_too(graph: Any, sensors: Any) -> None:
    node_in(graph, timeout=20.0)
    received = graph.collect(Imu, "imu/data_corrected")
    diagnostics = graph.collect(DiagnosticArray, "/diagnostics")
    graph.settle()
    drive = sensors.drive(600)

    def message() -> str:
        status = latest_status(diagnostics, "correction_node")
        return status.message if status else ""

    sensors.play(drive, stop=100)
    graph.spin_until(lambda: message() == "correcting")
    sensors.play(drive, start=100, stop=500, wheels=False)
    graph.spin_until(lambda: "no wheel readings" in message())
    sensors.play(drive, start=500)
    graph.spin_until(lambda: message() == "correcting")
    assert len(received) >= 595  # those after the last wheel reading still wait for the next
    assert not any(np.isnan(each.orientation.y) for each in received)


def test_readings_that_are_repeated_are_named(graph: Any, sensors: Any) -> None:
    node_in(graph, timeout=20.0)
    diagnostics = graph.collect(DiagnosticArray, "/diagnostics")
    graph.settle()
    drive = sensors.drive(1000)  # the wheels turn back
    angle = drive.wheels.angle
    wheels = replace(drive.wheels, angle=angle[np.arange(len(angle)) // 4 * 4])

    def message() -> str:
        status = latest_status(diagnostics, "correction_node")
        return status.message if status else ""

    sensors.play(drive._replace(wheels=wheels))
    graph.spin_until(lambda: "wheel readings are repeated" in message())
    period = float(np.median(np.diff(wheels.stamps))) * 1e-6
    assert f"for {4.0 * period:.0f} ms" in message()


def test_parameters_are_refused_as_a_whole(graph: Any) -> None:
    node = node_in(graph)
    result = node.set_parameters_atomically(
        [
            Parameter("robot.wheel_radius", value=0.05),
            Parameter("calibration.accel_valid_x", value=[1.0, -1.0]),
        ]
    )
    assert not result.successful and "accel_valid_x" in result.reason
    assert node.get_parameter("robot.wheel_radius").value == Setup().robot.wheel_radius


def latched(graph: Any) -> list[bool]:
    states: list[bool] = []
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    graph.probe.create_subscription(
        Bool, "is_calibrated", lambda message: states.append(message.data), qos
    )
    return states


def calibrate(graph: Any) -> Any:
    return graph.call(Trigger, "/correction_node/calibrate", Trigger.Request())


def test_calibration_rejects_motion_then_saves_and_reloads(
    graph: Any, sensors: Any, tmp_path: Path
) -> None:
    file = tmp_path / "calibration.yaml"
    options = {"calibration_file": str(file), "stillness__duration": 0.5, "timeout": 20.0}
    node = node_in(graph, **options)
    received = graph.collect(Imu, "imu/data_corrected")
    states = latched(graph)
    graph.spin_until(lambda: states == [False])
    early = calibrate(graph)
    assert not early.success and "0.5 s are needed" in early.message
    graph.settle()
    for index in range(300):
        moving = 1.0 if index == 200 else 0.0
        gyro = (BIAS[0], BIAS[1] + 30.0 * moving, BIAS[2])
        sensors.imu(10**12 + index * 2_000_000, gyro=gyro, accel=(0.0, 0.0, 9.80665))
    graph.spin_until(lambda: len(received) >= 290)
    moved = calibrate(graph)
    assert not moved.success and "moved" in moved.message and "rad/s" in moved.message
    assert not file.exists()
    for index in range(300, 600):
        stamp = 10**12 + index * 2_000_000
        sensors.imu(stamp, gyro=tuple(BIAS), accel=(0.0, 0.0, 9.80665))
    graph.spin_until(lambda: len(received) >= 590)
    still = calibrate(graph)
    assert still.success, still.message
    graph.spin_until(lambda: states == [False, True])
    assert node.get_parameter("calibration.gyro_bias").value == pytest.approx(BIAS)
    again = node_in(graph, **options)
    assert again.get_parameter("calibration.gyro_bias").value == pytest.approx(BIAS)
    late = latched(graph)
    graph.spin_until(lambda: True in late)


def test_a_calibration_that_cannot_be_saved_changes_nothing(
    graph: Any, sensors: Any, tmp_path: Path
) -> None:
    (tmp_path / "occupied").write_text("a file where a folder is needed")
    file = tmp_path / "occupied" / "calibration.yaml"
    former = [0.1, 0.2, 0.3]
    options = {"calibration_file": str(file), "stillness__duration": 0.5, "timeout": 20.0}
    node = node_in(graph, calibration__gyro_bias=former, **options)
    received = graph.collect(Imu, "imu/data_corrected")
    graph.settle()
    for index in range(300):
        stamp = 10**12 + index * 2_000_000
        sensors.imu(stamp, gyro=tuple(BIAS), accel=(0.0, 0.0, 9.80665))
    graph.spin_until(lambda: len(received) >= 290)
    answer = calibrate(graph)
    assert not answer.success and "occupied" in answer.message
    assert list(node.get_parameter("calibration.gyro_bias").value) == former


def test_a_calibration_file_replaces_the_whole_calibration(graph: Any, tmp_path: Path) -> None:
    """A polynomial of the parameters beside the biases of the file would be neither's."""
    file = tmp_path / "calibration.yaml"
    file.write_text("/**: {ros__parameters: {calibration: {gyro_bias: [0.1, 0.2, 0.3]}}}")
    given = {"accel_scale_x": [0.1, 0.2], "gyro_scale": [1.1, 1.0, 1.0]}
    overrides = [Parameter(f"calibration.{name}", value=value) for name, value in given.items()]
    overrides.append(Parameter("calibration_file", value=str(file)))
    node = graph.add(CorrectionNode(context=graph.context, parameter_overrides=overrides))
    assert list(node.get_parameter("calibration.gyro_bias").value) == [0.1, 0.2, 0.3]
    assert len(node.get_parameter("calibration.accel_scale_x").value) == 0
    assert list(node.get_parameter("calibration.gyro_scale").value) == [1.0, 1.0, 1.0]


def test_a_calibration_file_that_cannot_be_used_is_one_clear_error(
    graph: Any, tmp_path: Path
) -> None:
    file = tmp_path / "calibration.yaml"
    file.write_text("/**: {ros__parameters: {calibration: {gyro_bias: [1.0]}}}")
    with pytest.raises(Exception, match=r"calibration.yaml.*gyro_bias"):
        CorrectionNode(**graph.options(calibration_file=str(file)))


def test_a_stamp_of_zero_explains_itself_and_arrival_is_a_way_out(graph: Any, sensors: Any) -> None:
    diagnostics = graph.collect(DiagnosticArray, "/diagnostics")
    node_in(graph)
    graph.settle()
    sensors.imu(0, accel=(0.0, 0.0, 9.81))

    def said() -> str:
        status = latest_status(diagnostics, "correction_node")
        return status.message if status else ""

    graph.spin_until(lambda: "stamps: arrival" in said())


def test_stamps_by_arrival_need_none_of_the_sender(graph: Any, sensors: Any) -> None:
    node_in(graph, stamps="arrival")
    received = graph.collect(Imu, "imu/data_corrected")
    graph.settle()
    before = graph.probe.get_clock().now().nanoseconds
    for _ in range(20):
        sensors.imu(0, accel=(0.0, 0.0, 9.81))
        graph.executor.spin_once(timeout_sec=0.0)
    graph.spin_until(lambda: len(received) >= 10)
    stamps = [each.header.stamp.sec * 10**9 + each.header.stamp.nanosec for each in received]
    assert before < stamps[0] and stamps == sorted(set(stamps))


@pytest.mark.parametrize(
    ("reading", "said"), [(np.nan, "1 not_finite"), (16384.0, "1 beyond_any_sensor; counts")]
)
def test_readings_that_cannot_be_are_named_while_others_are_waited_for(
    graph: Any, reading: float, said: str
) -> None:
    node = node_in(graph)
    received = graph.collect(DiagnosticArray, "/diagnostics")
    node.take_imu(10**12, (0.0, 0.0, 0.0, 0.0, 0.0, reading))
    graph.spin_until(lambda: latest_status(received, "correction_node") is not None)
    graph.spin_until(lambda: said in latest_status(received, "correction_node").message)
