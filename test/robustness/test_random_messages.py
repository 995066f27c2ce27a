"""Random messages, parameters and transitions end no node, and nothing but numbers comes out."""

from __future__ import annotations

import math
import random
from typing import Any

import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from reliability.graph import Wiretap, taped
from reliability.random_messages import RandomMessages
from sensor_msgs.msg import Imu, JointState

from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.evaluator_node import EvaluatorNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.streams.messages import decode_float64, decode_float64s, decode_imu

COUNT = 4000


@pytest.mark.parametrize("seed", [101, 102])
def test_random_messages_end_no_node(graph: Any, seed: int) -> None:
    nodes = [
        CorrectionNode(**graph.options()),
        FilterNode(**graph.options(compare=["all"], predict=True)),
        ControllerNode(**graph.options(prepare_all=False)),
        EvaluatorNode(**graph.options(table=False)),
    ]
    correction, tilt, controller, evaluator = map(graph.add, nodes)
    imus: list[Any] = []
    tilts: list[Any] = []
    commands: list[Any] = []
    taped(correction._publisher, imus.append)
    taped(tilt._outputs._imu, imus.append)
    taped(tilt._outputs._tilt, tilts.append)
    taped(controller._command, commands.append)
    wire = Wiretap(*nodes)
    for topic, message in RandomMessages(seed).messages(COUNT):
        wire.send(topic, message)
    evaluator.publish_figures()
    for node in nodes:
        assert not node.callback_errors.counts, (
            f"{node.get_name()}: {node.callback_errors.recent(math.inf)}"
        )
    assert len(imus) > 100 and len(tilts) > 50 and len(commands) > 0
    assert all(math.isfinite(sum(decode_imu(each)[1])) for each in imus)
    assert all(math.isfinite(decode_float64(each)) for each in tilts)
    assert all(math.isfinite(sum(decode_float64s(each))) for each in commands)


def test_the_tilt_is_right_two_seconds_after_the_last_random_message(graph: Any) -> None:
    node = graph.add(FilterNode(**graph.options(filter="complementary", compare=["all"])))
    wire = Wiretap(node)
    noise = RandomMessages(103)
    for _ in range(500):
        wire.send("imu/data_corrected", noise.message(Imu))
        wire.send("joint_states", noise.message(JointState))
    tilts: list[Any] = []
    taped(node._outputs._tilt, tilts.append)
    lean, start = 0.1, 1_800_000_000_000_000_000
    for index in range(600):
        good = Imu()
        good.header.stamp.sec, good.header.stamp.nanosec = divmod(start + 5_000_000 * index, 10**9)
        good.orientation.y, good.orientation.w = math.sin(lean / 2), math.cos(lean / 2)
        good.orientation_covariance[0] = good.orientation_covariance[4] = 1e-4
        good.linear_acceleration.x = -9.80665 * math.sin(lean)
        good.linear_acceleration.z = 9.80665 * math.cos(lean)
        wire.send("imu/data_corrected", good)
    assert len(tilts) >= 580
    late = [decode_float64(each) for each in tilts[-180:]]
    assert max(abs(each - lean) for each in late) < math.radians(0.5)


VALUES: tuple[Any, ...] = (
    True, 0, -1, 2**62, 0.0, -1.0, 1e308, math.nan, math.inf, "", "all", "kalman", "x" * 1000,
    [], [0.1], [0.1, 0.2], [0.1] * 3, [math.nan] * 3, [1e300] * 3, [1] * 3, [True], ["a"], [""],
)  # fmt: skip


@pytest.mark.parametrize("kind", [FilterNode, CorrectionNode, ControllerNode])
def test_random_parameters_end_no_node(graph: Any, kind: Any) -> None:
    node = graph.add(kind(**graph.options()))
    draw = random.Random(7)
    names = [*node.list_parameters([], 0).names, "", "unknown", "kalman", "robot."]
    names = [each for each in names if each != "use_sim_time"]
    for _ in range(15):
        parameters = [
            Parameter(name, value=draw.choice(VALUES))
            if draw.random() < 0.9
            else Parameter(name, Parameter.Type.NOT_SET)
            for name in draw.choices(names, k=20)
        ]
        request = SetParameters.Request(parameters=[each.to_parameter_msg() for each in parameters])
        service = f"/{node.get_name()}/set_parameters"
        response = graph.call(SetParameters, service, request)
        assert len(response.results) == len(parameters)
        for parameter, result in zip(parameters, response.results, strict=True):
            assert result.successful or result.reason
            assert not result.successful or parameter.name in names[:-4]
    assert not node.callback_errors.counts, node.callback_errors.recent(math.inf)
