"""Messages at the start: one line for what rcl refuses, a warning for what no node takes."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

import pytest
from rclpy.parameter import Parameter

from twbr_estimation.configuration.ros_yaml import read_parameters
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.nodes.command_line import ParameterFile, prepared
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node
from twbr_estimation.nodes.start import applies, start_warnings

ROOT = Path(__file__).resolve().parent.parent.parent
MIXED = "/**:\n  ros__parameters:\n    robot: {lever_arm: [0, 0, 0.135]}\n"


def started(python: str, *arguments: str, **changed: str | None) -> tuple[int, str]:
    """Return status and output of a node that a wrong start ends."""
    environment = {**os.environ, **{k: v for k, v in changed.items() if v is not None}}
    for name in (name for name, value in changed.items() if value is None):
        environment.pop(name, None)
    program = "import sys; from twbr_estimation.nodes.filter_node import main; sys.exit(main())"
    result = subprocess.run(
        [python, "-c", program, "--ros-args", *arguments],
        env=environment, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    return result.returncode, result.stdout + result.stderr


@pytest.mark.parametrize(
    ("arguments", "changed", "said"),
    [
        (("--params-file", "none.yaml"), {}, "none.yaml: cannot be read"),
        (("-p", "filter"), {}, "NAME:=VALUE"),
        (("-r", "foo"), {}, "FROM:=TO"),
        (("--bogus",), {}, "--ros-args come"),
        (("-p", "compare:=all"), {}, "['all']"),
        (("-p", "filter:=[]"), {}, "filter: [] is of the wrong type; needed is a text"),
        (("-p", "robot.wheel_radius:=[]"), {}, "[] is of the wrong type; needed is a number"),
        (("-p", "use_sim_time:=[]"), {}, "[] is of the wrong type; needed is true or false"),
        (("-p", "valid_stddev:=99.0"), {}, "]: valid_stddev: 99.0 is outside [1e-06, 3.14159] rad"),
        (("-p", "valid_stddev:=.nan"), {}, "]: valid_stddev: nan is not a number"),
        (("-p", "robot.mounting:=[0.1, 0.2]"), {}, "3 are needed"),
        ((), {"HOME": None, "ROS_LOG_DIR": None, "ROS_HOME": None}, "set HOME or ROS_LOG_DIR"),
        ((), {"ROS_DOMAIN_ID": "abc"}, "whole number from 0 to 101"),
    ],
)
@pytest.mark.usefixtures("domain")
def test_a_refused_start_is_one_line(
    python: str, arguments: tuple[str, ...], changed: dict[str, str | None], said: str
) -> None:
    status, output = started(python, *arguments, **changed)
    assert status == 1 and said in output.splitlines()[-1], output
    assert "Traceback" not in output


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ("filter: []", "filter: [] is of the wrong type"),
        ("robot: {wheel_radius: 9.0}", "robot.wheel_radius: 9.0 is outside [0.001, 1] m"),
        ("use_sim_time: 5", "'use_sim_time' to '5' of type 'INTEGER', expecting type 'BOOL'"),
    ],
)
@pytest.mark.usefixtures("domain")
def test_the_file_of_a_refused_value_is_named(
    python: str, tmp_path: Path, values: str, said: str
) -> None:
    file = tmp_path / "values.yaml"
    file.write_text(f"filter_node:\n  ros__parameters:\n    {values}\n")
    status, output = started(python, "--params-file", str(file), "-p", "predict:=true")
    last = output.splitlines()[-1]
    assert status == 1 and f"{file}: " in last and said in last, output
    assert "Traceback" not in output


def test_a_file_is_named_only_where_it_is_certain(tmp_path: Path) -> None:
    every, a, b = (tmp_path / f"{name}.yaml" for name in ("every", "a", "b"))
    for file, node in ((every, "/**"), (a, "a_node"), (b, "b_node")):
        file.write_text(f"{node}:\n  ros__parameters: {{x: 1, only: {{{file.stem}: 2}}}}\n")

    def origin(name: str, *given: Path | str) -> Path | None:
        flags = [("--params-file" if isinstance(each, Path) else "-p", str(each)) for each in given]
        arguments = ["node", "--ros-args", *(each for flag in flags for each in flag)]
        return prepared(arguments, tmp_path).origin(name)

    assert origin("x", a) == a and origin("only.b", a, b, every) == b
    assert origin("x", a, every) == every and origin("x", "x:=3", every) == every
    assert origin("x", every, "x:=3") is None, "the command line's own comes last"
    assert origin("x", a, b) is None and origin("x", every, b) is None, "for which node is it?"
    assert origin("x", a, "node:x:=3") is None and origin("y", a) is None


@pytest.mark.parametrize(
    "text",
    [
        "/**:\n\tros__parameters:\n",
        "/**: 3\n",
        "- 1\n",
        "a: [1\n",
        "/**: {ros__parameters: {robot: {lever_arm: [[0, 0, 1]]}}}\n",
    ],
)
def test_a_file_that_is_no_parameter_file_is_named(tmp_path: Path, text: str) -> None:
    file = tmp_path / "wrong.yaml"
    file.write_text(text)
    with pytest.raises(ConfigurationError, match=r"wrong\.yaml"):
        prepared(["node", "--ros-args", "--params-file", str(file)], tmp_path)


def test_whole_numbers_among_fractions_are_numbers(tmp_path: Path) -> None:
    file, plain = tmp_path / "mixed.yaml", tmp_path / "plain.yaml"
    file.write_text(MIXED)
    plain.write_text("robot/filter_node:\n  ros__parameters: {filter: kalman}\n")
    files = ["--params-file", str(file), "--params-file", str(plain)]
    given = ["node", "--ros-args", *files, "-p", "robot.mounting:=[0, 0.5, 0]", "-p", "x:=[1, 2]"]
    arguments, found, _ = prepared(given, tmp_path)
    (entry,) = read_parameters(Path(arguments[3]))
    assert entry.value == [0.0, 0.0, 0.135] and {*map(type, entry.value)} == {float}
    assert arguments[5] == str(plain)
    assert arguments[7:] == ["robot.mounting:=[0.0, 0.5, 0.0]", "-p", "x:=[1, 2]"]
    assert [each.nodes for each in found] == [("/**",), ("robot/filter_node",)]


def test_a_list_of_whole_numbers_is_one_of_numbers(graph: Any) -> None:
    node = graph.add(FilterNode(**graph.options(robot__lever_arm=[0, 0, 1], compare=[""])))
    assert list(node.get_parameter("robot.lever_arm").value) == [0.0, 0.0, 1.0]
    (result,) = node.set_parameters([Parameter("robot.lever_arm", value=[0, 0, 2])])
    assert result.successful, result.reason
    compare = Parameter("compare", value=["kalman"])
    assert node.set_parameters([compare])[0].successful
    empty = Parameter("compare", Parameter.Type.BOOL_ARRAY, [])  # what `ros2 param set` sends
    (result,) = node.set_parameters([empty])
    assert result.successful and list(node.get_parameter("compare").value) == []


def test_names_that_no_node_has_are_refused_and_provenance_is_not(graph: Any) -> None:
    node = graph.add(FilterNode(**graph.options()))
    for name, meant in (("", ""), ("robot.wheel_radious", "robot.wheel_radius")):
        (result,) = node.set_parameters([Parameter(name, value=1.0)])
        assert not result.successful and meant in result.reason
    assert node.set_parameters([Parameter("provenance.source", value="me")])[0].successful
    removed = node.set_parameters([Parameter("kalman.q1", Parameter.Type.NOT_SET)])[0]
    assert not removed.successful and node.has_parameter("kalman.q1")


def warned(graph: Any, kind: Any, *files: ParameterFile, **given: Any) -> str:
    node = graph.add(kind(**graph.options(**given)))
    return "\n".join(start_warnings([node], files))


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("robot.wheel_radious", "robot.wheel_radius"),
        ("kalman.qq", "is kalman.q"),
        ("filtr", "filter"),
        ("robot", "parameter robot does not exist"),
        ("kalman", "parameter kalman does not exist"),
        ("spin", "parameter spin does not exist"),
        ("angles.x", "parameter angles.x does not exist"),
        ("no_such_thing", ""),
    ],
)
def test_a_parameter_that_no_node_has_is_named(graph: Any, name: str, meant: str) -> None:
    said = warned(graph, FilterNode, **{name: 0.05})
    assert name in said and meant in said


def test_a_driver_names_what_its_chip_does_not_have_and_takes_a_whole_robot(graph: Any) -> None:
    robot = {entry.name: entry.value for entry in read_parameters(ROOT / "config" / "robot.yaml")}
    assert warned(graph, Mpu6050Node, simulated=True, autostart=False, **robot) == ""
    wrong = {"mpu6050.gyro_range": 500, "robot.wheel_radious": 0.05}
    said = warned(graph, Mpu6050Node, simulated=True, autostart=False, **wrong)
    assert "mpu6050.gyro_range_deg meant" in said and "robot.wheel_radious" in said


def test_the_files_of_the_package_warn_of_nothing(graph: Any) -> None:
    """All nodes get the same files, each takes what is its own."""
    given = {
        entry.name: entry.value
        for name in ("robot.yaml", "calibration.yaml", "filters.yaml")
        for entry in read_parameters(ROOT / "config" / name)
    }
    assert warned(graph, CorrectionNode, **given) == ""
    assert warned(graph, FilterNode, **given) == ""
    assert warned(graph, Mpu6050Node, **given, simulated=True) == ""


def test_a_file_for_another_node_is_named(graph: Any) -> None:
    wrong = ParameterFile(Path("wrong.yaml"), ("filter_nod",))
    shared = ParameterFile(Path("all.yaml"), ("controller_node", "/**/filter_node"))
    other = ParameterFile(Path("other.yaml"), ("controller_node",))
    said = warned(graph, FilterNode, wrong, shared, other)
    assert "wrong.yaml" in said and "filter_node meant" in said
    assert "other.yaml" in said and "all.yaml" not in said


@pytest.mark.parametrize(
    ("pattern", "name", "meant"),
    [
        ("/**", "/a/b/filter_node", True),
        ("filter_node", "/filter_node", True),
        ("/**/filter_node", "/filter_node", True),
        ("/*/filter_node", "/robot/filter_node", True),
        ("/*/filter_node", "/filter_node", False),
        ("robot/filter_node", "/robot/filter_node", True),
        ("filter_nod", "/filter_node", False),
    ],
)
def test_names_in_files_match_nodes_as_rcl_matches_them(
    pattern: str, name: str, meant: bool
) -> None:
    assert applies(pattern, name) == meant
