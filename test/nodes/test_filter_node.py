"""The filter node on real middleware: switching, refusing, surviving."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.parameter import Parameter
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Float64, Float64MultiArray
from std_srvs.srv import Trigger

from twbr_estimation import simulate
from twbr_estimation.batch import correct, run_filter
from twbr_estimation.configuration.filter_settings import DEFAULT_FILTER
from twbr_estimation.filters.base import filter_named, listed_filters
from twbr_estimation.nodes import inputs
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.diagnostics import Level
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.qos import latched
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.robot import Robot, Setup
from twbr_estimation.ros_messages import stamp_of, tilt_of
from twbr_estimation.samples import STANDARD_GRAVITY, CorrectedSample

COUNT = 300
LONGEST = 60.0
"""Largest `timeout` [s]."""
OUTPUTS = ("tilt", "imu/data", "tilt/compare")
PERIOD = 5_000_000
"""[ns]."""
REST = CorrectedSample(
    **{**dict.fromkeys(CorrectedSample._fields, 0.0), "dt": 0.005, "accel_z": STANDARD_GRAVITY}
)
"""A robot that stands upright."""


def filter_in(graph: Any, **parameters: Any) -> FilterNode:
    lossless = graph.lossless("imu/data_corrected", "joint_states", published=OUTPUTS)
    return graph.add(FilterNode(**graph.options(**lossless, **parameters)))


def both_in(graph: Any, **parameters: Any) -> FilterNode:
    lossless = graph.lossless("imu/data_raw", "joint_states", published=("imu/data_corrected",))
    graph.add(CorrectionNode(**graph.options(**lossless)))
    return filter_in(graph, **parameters)


def offline(drive: Any, name: str) -> Any:
    entry = filter_named(name)
    corrected = correct(pair(drive.imu, drive.wheels), Setup())
    return run_filter(entry, entry.configure(), corrected, Robot())


def test_live_equals_offline_for_every_filter(graph: Any, sensors: Any) -> None:
    both_in(graph, compare=["all"])
    tilts, imus = graph.collect(Float64, "tilt"), graph.collect(Imu, "imu/data")
    compared = graph.collect(JointState, "tilt/compare")
    graph.settle()
    drive = sensors.drive(COUNT)
    sensors.play(drive)
    graph.spin_until(lambda: min(len(tilts), len(imus), len(compared)) == COUNT)
    assert [stamp_of(message) for message in imus] == drive.imu.stamps.tolist()
    assert list(compared[0].name) == list(listed_filters())
    chosen = offline(drive, DEFAULT_FILTER)
    np.testing.assert_allclose([message.data for message in tilts], chosen.tilt, atol=1e-12)
    angles = [tilt_of(message.orientation) for message in imus]
    np.testing.assert_allclose(angles, chosen.tilt, atol=1e-12)
    for row, name in enumerate(listed_filters()):
        track = offline(drive, name)
        live = np.array([(each.position[row], each.velocity[row]) for each in compared])
        np.testing.assert_allclose(live[:, 0], track.tilt, rtol=1e-9, atol=1e-9, err_msg=name)
        np.testing.assert_allclose(live[:, 1], track.rate, rtol=1e-9, atol=1e-9, err_msg=name)


def test_degrees_are_published_only_while_they_are_plotted(graph: Any, sensors: Any) -> None:
    node = filter_in(graph, filter="accelerometer", tilt_offset=0.1)
    sent: list[bytes] = []
    outputs = node._outputs
    publish = outputs._degrees.publish
    outputs._degrees.publish = lambda data: (sent.append(data), publish(data))
    tilts = graph.collect(Float64, "tilt")
    graph.settle()
    feed(graph, sensors, 0.2, tilts, first=1, count=3)
    assert sent == []
    degrees = graph.collect(Float64, "tilt_deg")
    graph.settle()
    graph.spin_until(lambda: outputs._plotted)
    feed(graph, sensors, 0.2, tilts, first=4, count=3)
    graph.spin_until(lambda: len(degrees) == 3)
    assert [each.data for each in degrees] == [math.degrees(each.data) for each in tilts[3:]]


@pytest.mark.parametrize(("dt", "expected"), [(0.002, False), (0.01, True)])
def test_defaults_tuned_at_another_period_are_named(graph: Any, dt: float, expected: bool) -> None:
    """As offline, for the active filter and those that run beside it."""
    node = filter_in(graph, filter="alpha_beta_wb", compare=["kalman_tuned"], timeout=20.0)
    received = graph.collect(DiagnosticArray, "/diagnostics")
    for index in range(300):
        x = 0.01 * (index % 3)
        readings = 0.0, 0.0, 0.0, x, 0.0, 9.81
        variances = 1e-6, 1e-6, 1e-6, 1e-2, 1e-2, 1e-2
        sample = CorrectedSample(
            dt, math.atan2(-x, 9.81), 1e-3, *readings, *variances, 0.0, 0.0, 0.0
        )
        node.take(10**12 + index * round(dt * 1e9), sample)

    def said() -> list[str]:
        mine = [s for each in received for s in each.status if s.name == "filter_node"]
        counted = [s for s in mine if {"samples": "300"}.items() <= _values(s).items()]
        return [s.message for s in counted]

    graph.spin_until(lambda: bool(said()))
    names = "defaults of alpha_beta_wb, kalman_tuned: tuned at 0.002 s, used at 0.01 s"
    assert (names in said()[0]) == expected
    assert ("tuned" in said()[0]) == expected


@pytest.mark.parametrize(
    ("wanted", "names", "shown"),
    [
        (True, ("correction", "ins_odometer"), "correction, ins_odometer"),
        (True, (), "not prepared"),
        (False, ("correction",), "off"),
    ],
)
def test_the_diagnostics_show_what_is_prepared_as_machine_code(
    graph: Any, monkeypatch: pytest.MonkeyPatch, wanted: bool, names: tuple[str, ...], shown: str
) -> None:
    steps = SimpleNamespace(
        ready=True, refusal="", names=names, of_filter=lambda entry: None, correction=lambda: None
    )
    monkeypatch.setattr(inputs, "background_steps", lambda: steps)
    received = graph.collect(DiagnosticArray, "/diagnostics")
    node = filter_in(graph, machine_code=wanted)
    graph.spin_until(
        lambda: any(
            _values(s).get("machine_code") == shown
            for each in received
            for s in each.status
            if s.name == node.get_name()
        )
    )


def _values(status: Any) -> dict[str, str]:
    return {each.key: each.value for each in status.values}


def feed(graph: Any, sensors: Any, angle: float, tilts: list[Any], first: int, count: int) -> None:
    """Publish corrected samples 5 ms apart and wait for their tilts."""
    for index in range(first, first + count):
        sensors.corrected(1_000_000_000 + index * 5_000_000, angle)
    graph.spin_until(lambda: len(tilts) == first + count - 1)


def test_raw_straight_in_gives_the_same_as_through_the_correction(graph: Any, sensors: Any) -> None:
    remap = ["--ros-args", "-r", "imu/data_corrected:=imu/data_raw"]
    lossless = graph.lossless("imu/data_raw", "joint_states", published=OUTPUTS)
    graph.add(FilterNode(cli_args=remap, **graph.options(**lossless)))
    tilts = graph.collect(Float64, "tilt")
    graph.settle()
    drive = sensors.drive(COUNT)
    sensors.imu(int(drive.imu.stamps[0]) - 2_000_000_000, accel=(0.0, 0.0, 9.8))
    graph.spin_until(lambda: len(tilts) == 1)
    graph.settle()  # now that the first sample was raw, the node listens to the wheels
    sensors.play(drive)
    # Those after the last wheel reading go on without it when nothing more arrives.
    graph.spin_until(lambda: len(tilts) == COUNT + 1)
    np.testing.assert_allclose(
        [message.data for message in tilts[1:]], offline(drive, DEFAULT_FILTER).tilt, atol=1e-12
    )


def test_switching_under_load_loses_nothing_and_does_not_jump(graph: Any, sensors: Any) -> None:
    node = both_in(graph, filter="complementary")
    imus = graph.collect(Imu, "imu/data")
    graph.settle()
    # One has no past; to the other the wheels of this drive, which are made up, contradict the IMU.
    names = [name for name in listed_filters() if name not in ("accelerometer", "ins_odometer")]
    drive = sensors.drive(20 * len(names))
    for index, name in enumerate(names):
        sensors.play(drive, start=20 * index, stop=20 * (index + 1))
        assert node.set_parameters([Parameter("filter", value=name)])[0].successful
    graph.spin_until(lambda: len(imus) == 20 * len(names))
    assert [stamp_of(message) for message in imus] == drive.imu.stamps.tolist()
    tilt = np.array([tilt_of(message.orientation) for message in imus])
    # The motion itself and every filter's correction stay far below this between two samples.
    assert np.abs(np.diff(tilt)).max() < 0.02


def test_a_half_bad_request_changes_nothing(graph: Any) -> None:
    node = filter_in(graph)
    before = node.get_parameter("kalman.q1").value
    for bad, said in (
        (Parameter("complementary.time_constant", value=-1.0), "time_constant"),
        (Parameter("filter", value="unheard_of"), "unheard_of"),
        (Parameter("compare", value=["kalman", "nobody"]), "nobody"),
        (Parameter("tilt_sign", value=0.5), "tilt_sign"),
    ):
        good = Parameter("kalman.q1", value=2.0 * before)
        result = node.set_parameters_atomically([good, bad])
        assert not result.successful and said in result.reason
        assert node.get_parameter("kalman.q1").value == before
    assert node.set_parameters_atomically([Parameter("kalman.q1", value=2.0 * before)]).successful


def corrected(sensors: Any, index: int, angle: float, stamp: int | None = None) -> None:
    at = 10**12 + index * 2_000_000 if stamp is None else stamp
    sensors.corrected(at, angle)


def test_parameters_act_from_the_next_sample_on(graph: Any, sensors: Any) -> None:
    node = filter_in(graph, tilt_sign=-1.0, tilt_offset=0.1)
    tilts = graph.collect(Float64, "tilt")
    graph.settle()
    corrected(sensors, 0, 0.3)
    graph.spin_until(lambda: len(tilts) == 1)
    assert tilts[0].data == pytest.approx(-0.2)
    node.set_parameters([Parameter("filter", value="accelerometer")])
    corrected(sensors, 1, 0.5)
    graph.spin_until(lambda: len(tilts) == 2)
    assert tilts[1].data == pytest.approx(-0.4)


def test_bad_stamps_and_values_have_their_outcomes(graph: Any, sensors: Any) -> None:
    filter_in(graph, filter="accelerometer", timeout=20.0)
    tilts, diagnostics = (
        graph.collect(Float64, "tilt"),
        graph.collect(DiagnosticArray, "/diagnostics"),
    )
    graph.settle()
    for index in range(5):
        corrected(sensors, index, 0.1)
    corrected(sensors, 4, 0.2)  # repeated
    corrected(sensors, 2, 0.2)  # late
    corrected(sensors, 0, 0.2, stamp=0)
    corrected(sensors, 5, math.nan)
    corrected(sensors, 6, 0.3)
    corrected(sensors, 3_000_000, 0.4)  # far ahead
    corrected(sensors, 7, 0.5)  # back again
    corrected(sensors, 8, 0.6)
    graph.spin_until(lambda: len(tilts) == 9)
    assert [round(message.data, 9) for message in tilts] == [0.1] * 5 + [0.3, 0.4, 0.5, 0.6]

    def counts() -> dict[str, str]:
        mine = [s for each in diagnostics for s in each.status if s.name == "filter_node"]
        return {each.key: each.value for each in mine[-1].values} if mine else {}

    graph.spin_until(lambda: counts().get("imu_restart") == "1")
    expected = {"imu_repeated_stamp": "1", "imu_late_stamp": "1", "imu_zero_stamp": "1"}
    expected |= {"imu_not_finite": "1", "imu_gap": "1", "samples": "9"}
    assert expected.items() <= counts().items()


def test_stale_input_is_not_valid_and_recovers(graph: Any, sensors: Any) -> None:
    filter_in(graph, filter="complementary", timeout=0.1)  # valid from its first sample on
    valid, diagnostics = (
        graph.collect(Bool, "tilt/valid"),
        graph.collect(DiagnosticArray, "/diagnostics"),
    )
    tilts = graph.collect(Float64, "tilt")
    graph.settle()
    graph.spin_until(lambda: len(valid) >= 1)
    assert not valid[-1].data and not tilts
    corrected(sensors, 0, 0.1)
    graph.spin_until(lambda: valid[-1].data)
    graph.spin_until(lambda: not valid[-1].data)
    graph.spin_until(lambda: any("stale" in s.message for each in diagnostics for s in each.status))
    corrected(sensors, 1, 0.1)
    graph.spin_until(lambda: valid[-1].data)


def test_reset_starts_from_the_next_sample(graph: Any, sensors: Any) -> None:
    filter_in(graph, filter="complementary", complementary__time_constant=1000.0)
    tilts = graph.collect(Float64, "tilt")
    graph.settle()
    corrected(sensors, 0, 0.0)
    corrected(sensors, 1, 0.5)
    graph.spin_until(lambda: len(tilts) == 2)
    assert abs(tilts[1].data) < 0.01
    assert graph.call(Trigger, "/filter_node/reset", Trigger.Request()).success
    corrected(sensors, 2, 0.5)
    graph.spin_until(lambda: len(tilts) == 3)
    assert tilts[2].data == pytest.approx(0.5)


def test_a_missing_transform_message_is_said_not_fatal(graph: Any, sensors: Any) -> None:
    diagnostics = graph.collect(DiagnosticArray, "/diagnostics")
    try:
        import tf2_msgs  # noqa: F401
    except ImportError:
        pass
    else:
        pytest.skip("tf2_msgs is installed here")
    filter_in(graph, filter="complementary", publish_tf=True, timeout=20.0)
    graph.settle()
    sensors.corrected(10**12, 0.1)
    graph.spin_until(
        lambda: any("tf2_msgs is not installed" in s.message for m in diagnostics for s in m.status)
    )


def test_motor_commands_are_subscribed_once_a_filter_uses_them(graph: Any) -> None:
    node = filter_in(graph, filter="complementary")
    graph.settle()
    assert graph.probe.count_subscribers("motor/command") == 0
    assert node.set_parameters([Parameter("filter", value="dynamic_planar")])[0].successful
    publisher = graph.probe.create_publisher(Float64MultiArray, "motor/command", 10)
    graph.spin_until(lambda: publisher.get_subscription_count() == 1)
    heard: list[Any] = []
    node.pass_motors = heard.append
    for voltages in ([1.0, 4.0], [1.0, 2.0, 3.0], [-2.0]):
        publisher.publish(Float64MultiArray(data=voltages))
    graph.spin_until(lambda: len(heard) == 2)
    assert [command[1:] for command in heard] == [(2.5, 3.0, 2.0), (-2.0, 0.0, 1.0)]
    now = node.get_clock().now().nanoseconds
    assert 0 <= now - heard[0].stamp < 5_000_000_000


@pytest.mark.parametrize(
    ("force", "cause"), [(1.0, "it is in g; give m/s^2"), (-9.81, "its z axis points down")]
)
def test_a_cause_of_distrust_is_named_before_it(graph: Any, force: float, cause: str) -> None:
    node = filter_in(graph, timeout=20.0)
    received = graph.collect(DiagnosticArray, "/diagnostics")
    for index in range(600):
        x = 0.01 * (index % 3)
        readings = 0.0, 0.0, 0.0, x, 0.0, force
        variances = 1e-6, 1e-6, 1e-6, 1e-2, 1e-2, 1e-2
        angle = math.atan2(-x, force)
        sample = CorrectedSample(0.005, angle, 1e-3, *readings, *variances, 0.0, 0.0, 0.0)
        node.take(10**12 + index * 5_000_000, sample)

    def messages() -> list[str]:
        return [s.message for each in received for s in each.status if s.name == "filter_node"]

    graph.spin_until(lambda: any(cause in each for each in messages()))


def played(drive: Any, signs: tuple[float, float, float]) -> Any:
    """Return the readings of a simulated drive for `sensors.play`, its gyro times `signs`."""
    imu, wheels = drive.recording.imu, drive.recording.wheels
    columns = imu.stamps.tolist(), (imu.gyro * signs).tolist(), imu.accel.tolist()
    angle = np.repeat(wheels.angle.reshape(-1, 1), 2, axis=1)
    return SimpleNamespace(
        imu_columns=columns, wheels=SimpleNamespace(stamps=wheels.stamps, angle=angle)
    )


@pytest.mark.parametrize("name", ["accelerometer", "complementary", "ins_odometer"])
def test_a_contradiction_reaches_any_filter_of_another_process(
    graph: Any, sensors: Any, name: str
) -> None:
    node = both_in(graph, filter=name, timeout=LONGEST)
    correction = next(each for each in graph.nodes if isinstance(each, CorrectionNode))
    valid = graph.collect(Bool, "tilt/valid")
    graph.settle()
    drive = simulate("W1", seed=314, dt=0.01, duration=12.0, scene="drive")
    sensors.play(played(drive, (1.0, -1.0, 1.0)))
    graph.spin_until(lambda: not valid[-1].data)
    assert "contradict" in said(node) or "sign" in said(node)
    assert [each.check for each in correction._quick.untrusted] == ["sign"]
    result = correction.set_parameters([Parameter("robot.wheel_radius", value=0.05)])
    assert all(each.successful for each in result)
    graph.spin_until(lambda: node._stream.input_valid)


def test_a_contradiction_is_forgotten_with_who_found_it(graph: Any) -> None:
    node = filter_in(graph, timeout=LONGEST)
    valid = graph.collect(Bool, "tilt/valid")
    judge = graph.probe.create_publisher(Bool, "imu/valid", latched())
    judge.publish(Bool(data=False))
    graph.spin_until(lambda: not node._stream.input_valid)
    for index in range(3):  # a gap says nothing of the sensors
        node.take(400 * PERIOD * index, REST._replace(dt=2.0))
    graph.spin_until(lambda: len(valid) > 0)
    assert not valid[-1].data and not node._stream.input_valid
    graph.probe.destroy_publisher(judge)
    graph.spin_until(lambda: node._stream.input_valid)


def test_a_step_that_fails_in_whatever_way_leaves_no_valid_tilt(
    graph: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = filter_in(graph, timeout=LONGEST)
    valid = graph.collect(Bool, "tilt/valid")
    for index in range(200):
        node.take(PERIOD * index, REST)
    graph.spin_until(lambda: valid and valid[-1].data)

    def failing(sample: CorrectedSample) -> None:
        raise IndexError("a filter of a user")

    monkeypatch.setattr(node._stream, "step", failing)
    with pytest.raises(IndexError):
        node.take(PERIOD * 200, REST)
    graph.spin_until(lambda: not valid[-1].data)


def said(node: Any) -> str:
    """Return what a node reports as an error."""
    report = node._report()
    return str(report.message) if report.level is Level.ERROR else ""
