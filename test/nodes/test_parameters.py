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
    named_declarations_of,
    parameters_from,
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
        Setup(),
        settings_from,
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


def test_an_empty_array_can_be_given_at_the_start(graph: Any) -> None:
    empty = [Parameter("compare", Parameter.Type.NOT_SET)]  # as rcl reads `compare:=[]`
    node = graph.add(Node("subject", **{**graph.options(), "parameter_overrides": empty}))
    assert declare_filter_parameters(node, lambda _: None).current.filters.settings.compare == ()


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
        {},
        lambda former, values: parameters_from({KALMAN.name: KALMAN}, former, values),
    )
    (result,) = node.set_parameters([Parameter("alpha_beta_wb.alpha", value=value)])
    assert not result.successful and "alpha_beta_wb.alpha" in result.reason
    assert parameters.current == {KALMAN.name: KALMAN.configure()._asdict()}


def test_descriptors_carry_description_unit_and_limits(graph: Any) -> None:
    node = graph.add(Node("subject", **graph.options()))
    NodeParameters(
        node,
        named_declarations_of(KALMAN) + declarations_of(Setup(), read_only=True),
        None,
        lambda former, values: None,
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

    def build(former: Setup, values: Any) -> Setup:
        built[0] += 1
        return settings_from(former, values)

    parameters = NodeParameters(node, declarations_of(Setup()), Setup(), build, applied.append)
    built[0] = 0
    (result,) = node.set_parameters([Parameter("robot.wheel_radius", value=0.06)])
    assert result.successful and built[0] == 1
    assert applied == [parameters.current] and parameters.current.robot.wheel_radius == 0.06


def test_a_change_builds_only_the_filter_that_it_concerns(graph: Any) -> None:
    node, applied = graph.add(Node("filter_node", **graph.options())), []
    former = declare_filter_parameters(node, applied.append).current
    (result,) = node.set_parameters([Parameter("kalman.q1", value=2e-5)])
    before, after = former.filters.parameters, applied[0].filters.parameters
    assert result.successful and after["kalman"]["q1"] == 2e-5 != before["kalman"]["q1"]
    assert [name for name in after if after[name] is not before[name]] == ["kalman"]
    assert applied[0].setup is former.setup
    assert applied[0].filters.settings is former.filters.settings


def test_a_change_of_the_robot_builds_neither_calibration_nor_filters(graph: Any) -> None:
    node, applied = graph.add(Node("filter_node", **graph.options())), []
    former = declare_filter_parameters(node, applied.append).current
    (result,) = node.set_parameters([Parameter("robot.wheel_radius", value=0.05)])
    (after,) = applied
    assert result.successful and after.setup.robot.wheel_radius == 0.05
    assert after.filters.robot is after.setup.robot
    assert after.setup.calibration is former.setup.calibration
    assert after.setup.correction is former.setup.correction
    for name, each in former.filters.parameters.items():
        assert after.filters.parameters[name] is each


def test_values_set_one_after_the_other_all_hold(graph: Any) -> None:
    node, applied = graph.add(Node("filter_node", **graph.options())), []
    parameters = declare_filter_parameters(node, applied.append)
    wanted = {
        "kalman.q1": 2e-5,
        "kalman.r": 1e-4,
        "robot.wheel_radius": 0.05,
        "robot.track_width": 0.2,
        "correction.euler": False,
        "tilt_stddev": 0.05,
    }
    for name, value in wanted.items():
        assert node.set_parameters([Parameter(name, value=value)])[0].successful
    (refused,) = node.set_parameters([Parameter("kalman.q2", value=-1.0)])
    assert not refused.successful and len(applied) == len(wanted)
    filters, setup = parameters.current
    assert (filters.parameters["kalman"]["q1"], filters.parameters["kalman"]["r"]) == (2e-5, 1e-4)
    assert (setup.robot.wheel_radius, setup.robot.track_width) == (0.05, 0.2)
    assert not setup.correction.euler and filters.settings.tilt_stddev == 0.05
