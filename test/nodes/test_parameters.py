"""ROS parameters derived from specs: declared, checked as a whole, applied at once."""

from __future__ import annotations

from typing import Any

import pytest
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.filters.base import filter_named
from twbr_estimation.nodes.declarations import (
    declarations_of,
    declared_values_from,
    named_declarations_of,
    settings_from,
)
from twbr_estimation.nodes.filter_parameters import declare_filter_parameters
from twbr_estimation.nodes.parameters import NodeParameters
from twbr_estimation.robot import EncoderPlacement, Setup

KALMAN = filter_named("alpha_beta_wb")


def _setup_parameters(node: Node, applied: list[Setup]) -> NodeParameters[Setup]:
    return NodeParameters(
        node,
        declarations_of(Setup()),
        lambda values: settings_from(Setup(), values),
        applied.append,
    )


def test_settings_survive_the_way_through_ros_parameters(graph: Any) -> None:
    node = graph.add(Node("subject", **graph.options(robot__wheel_radius=0.05)))
    parameters = _setup_parameters(node, [])
    assert parameters.current.robot.wheel_radius == 0.05
    assert parameters.current.calibration == Setup().calibration
    assert parameters.current.robot.encoder_placement is EncoderPlacement.BODY


def test_an_empty_array_default_can_be_filled_at_run_time(graph: Any) -> None:
    node = graph.add(Node("subject", **graph.options()))
    parameters = _setup_parameters(node, [])
    assert len(parameters.current.calibration.accel_scale_x) == 0
    (result,) = node.set_parameters([Parameter("calibration.accel_scale_x", value=[0.1, 0.2])])
    assert result.successful, result.reason
    assert parameters.current.calibration.accel_scale_x == (0.1, 0.2)


def test_all_parameters_can_be_asked_for_at_once(graph: Any) -> None:
    node = graph.add(Node("subject", **graph.options()))
    _setup_parameters(node, [])
    declared = node.list_parameters([], 0).names
    names = [name for name in declared if not name.startswith("qos_overrides")]
    response = graph.call(
        GetParameters, "/subject/get_parameters", GetParameters.Request(names=names)
    )
    assert len(response.values) == len(names)
    empty = response.values[names.index("calibration.accel_scale_x")]
    assert empty.type == ParameterType.PARAMETER_DOUBLE_ARRAY and not empty.double_array_value


def test_a_refused_request_changes_nothing(graph: Any) -> None:
    node = graph.add(Node("subject", **graph.options()))
    applied: list[Setup] = []
    parameters = _setup_parameters(node, applied)
    before = parameters.current
    result = node.set_parameters_atomically(
        [
            Parameter("robot.track_width", value=0.2),
            Parameter("robot.wheel_radius", value=-0.1),
        ]
    )
    assert not result.successful
    assert "wheel_radius" in result.reason and "-0.1" in result.reason
    assert parameters.current == before and applied == []
    assert node.get_parameter("robot.track_width").value == before.robot.track_width


def test_an_accepted_request_is_applied_once_as_a_whole(graph: Any) -> None:
    node = graph.add(Node("subject", **graph.options()))
    applied: list[Setup] = []
    _setup_parameters(node, applied)
    node.set_parameters_atomically(
        [
            Parameter("robot.track_width", value=0.2),
            Parameter("robot.encoder_placement", value="ground"),
        ]
    )
    assert len(applied) == 1
    assert applied[0].robot.track_width == 0.2
    assert applied[0].robot.encoder_placement is EncoderPlacement.GROUND


def test_a_choice_outside_the_enumeration_is_refused_with_the_choices(graph: Any) -> None:
    node = graph.add(Node("subject", **graph.options()))
    _setup_parameters(node, [])
    (result,) = node.set_parameters([Parameter("robot.encoder_placement", value="wheel")])
    assert not result.successful and "body, ground" in result.reason


@pytest.mark.parametrize("value", [2.0, float("nan"), float("inf")])
def test_filter_parameters_are_refused_outside_their_bounds(graph: Any, value: float) -> None:
    node = graph.add(Node("subject", **graph.options()))
    parameters = NodeParameters(
        node,
        named_declarations_of(KALMAN),
        lambda values: declared_values_from(KALMAN, values),
    )
    (result,) = node.set_parameters([Parameter("alpha_beta_wb.alpha", value=value)])
    assert not result.successful and "alpha_beta_wb.alpha" in result.reason
    assert parameters.current == KALMAN.configure()


def test_descriptors_carry_description_unit_and_limits(graph: Any) -> None:
    node = graph.add(Node("subject", **graph.options()))
    NodeParameters(
        node,
        named_declarations_of(KALMAN) + declarations_of(Setup(), read_only=True),
        lambda values: None,
    )
    request = DescribeParameters.Request(names=["alpha_beta_wb.beta", "robot.wheel_radius"])
    response = graph.call(DescribeParameters, "/subject/describe_parameters", request)
    beta, radius = response.descriptors
    assert "[1/s]" in beta.description and not beta.read_only
    assert (beta.floating_point_range[0].from_value, beta.floating_point_range[0].to_value) == (
        -1.0,
        1.0,
    )
    assert "[m]" in radius.description and radius.read_only


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [("robot__wheel_radius", 1, "decimal point"), ("robot__wheel_radius", -1.0, "wheel_radius")],
)
def test_a_bad_initial_value_is_one_clear_error(
    graph: Any, name: str, value: object, reason: str
) -> None:
    node = graph.add(Node("subject", **graph.options(**{name: value})))
    with pytest.raises(ConfigurationError, match=reason):
        _setup_parameters(node, [])


def test_a_request_is_built_once(graph: Any) -> None:
    node, built, applied = graph.add(Node("subject", **graph.options())), [0], []

    def build(values: Any) -> Setup:
        built[0] += 1
        return settings_from(Setup(), values)

    parameters = NodeParameters(node, declarations_of(Setup()), build, applied.append)
    built[0] = 0
    (result,) = node.set_parameters([Parameter("robot.wheel_radius", value=0.06)])
    assert result.successful and built[0] == 1
    assert applied == [parameters.current] and parameters.current.robot.wheel_radius == 0.06


def test_a_change_builds_only_the_filter_that_it_concerns(graph: Any) -> None:
    node, applied = graph.add(Node("filter_node", **graph.options())), []
    before = declare_filter_parameters(node, applied.append).current.filters.parameters
    (result,) = node.set_parameters([Parameter("kalman.q1", value=2e-5)])
    after = applied[0].filters.parameters
    assert result.successful and after["kalman"]["q1"] == 2e-5 != before["kalman"]["q1"]
    assert [name for name in after if after[name] is not before[name]] == ["kalman"]
