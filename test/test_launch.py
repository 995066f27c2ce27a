"""The launch files load where launch is installed (it is no part of the ROS wheels)."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest
import yaml

from twbr_estimation.errors import ConfigurationError

launch = pytest.importorskip("launch", reason="needs ROS 2's launch")
pytest.importorskip("launch_ros", reason="needs ROS 2's launch_ros")

FOLDER = Path(__file__).resolve().parent.parent / "launch"
FILES = sorted(FOLDER.glob("*.launch.py"))


def load(path: Path) -> Any:
    specification = importlib.util.spec_from_file_location(path.name.split(".")[0], path)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def started(path: Path, **given: str) -> list[str]:
    """Return the executables a launch file would start."""
    return [each.node_executable for each in actions(path, **given)]


def parameters(path: Path, executable: str, **given: str) -> dict[str, Any]:
    """Return the parameters of text that one executable gets beside its files."""
    chosen = [each for each in actions(path, **given) if each.node_executable == executable]
    assert len(chosen) == 1
    found: dict[str, Any] = {}
    for each in chosen[0]._Node__parameters:
        if isinstance(each, dict):
            names = {"".join(part.text for part in name): value for name, value in each.items()}
            texts = {
                name: value[0].text for name, value in names.items() if isinstance(value, tuple)
            }
            found |= {name: yaml.safe_load(text) for name, text in texts.items()}
    return found


def actions(path: Path, **given: str) -> list[Any]:
    """Return the actions of the nodes that a launch file would start."""
    module = load(path)
    context = launch.LaunchContext()
    for argument in module.ARGUMENTS:
        if argument.default_value is not None:
            argument.visit(context)
    context.launch_configurations.update(given)
    flat = []
    for entity in module.nodes(context):
        is_group = isinstance(entity, launch.actions.GroupAction)
        flat += entity.get_sub_entities() if is_group else [entity]
    return [each for each in flat if hasattr(each, "node_executable")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_argument_is_described(path: Path) -> None:
    description = load(path).generate_launch_description()
    arguments = description.get_launch_arguments()
    assert arguments
    for argument in arguments:
        assert argument.description and argument.description != "no description given"


def test_a_robot_starts_what_is_asked_for() -> None:
    path = FOLDER / "robot.launch.py"
    separate = ["mpu6050_node", "encoder_node", "correction_node", "filter_node"]
    assert started(path) == ["estimation_node"]
    assert started(path, composed="true", compare="all") == ["estimation_node"]
    assert started(path, controller="lqr") == ["estimation_node"]
    assert started(path, composed="false") == separate
    beside = ["encoder_node", "evaluator_node"]
    assert started(path, reference="true") == ["estimation_node", *beside]
    assert started(path, reference="true", composed="false") == [*separate, *beside]
    assert started(path, controller="lqr", composed="false") == [*separate, "controller_node"]


@pytest.mark.parametrize("composed", ["true", "false"])
def test_the_node_that_calibrates_gets_the_file_that_keeps_it(composed: str) -> None:
    path = FOLDER / "robot.launch.py"
    calibrates = "estimation_node" if composed == "true" else "correction_node"
    given = parameters(path, calibrates, composed=composed, calibration_file="/c.yaml")
    assert given["calibration_file"] == "/c.yaml"
    assert "calibration_file" not in parameters(path, calibrates, composed=composed)


def test_a_robot_with_drivers_of_its_own_starts_the_rest() -> None:
    path = FOLDER / "robot.launch.py"
    rest = ["correction_node", "filter_node"]
    none = {"imu_driver": "false", "encoder_driver": "false"}
    assert started(path, **none) == ["estimation_node"]
    assert started(path, **none, composed="false") == rest
    assert started(path, imu_driver="false") == ["encoder_node", *rest]
    with pytest.raises(ValueError, match="composed"):
        started(path, imu_driver="false", composed="true")


@pytest.mark.parametrize("missing", ["/no/such/folder", "no_such.yaml"])
def test_a_configuration_that_is_not_there_is_an_error(missing: str) -> None:
    with pytest.raises(ConfigurationError, match="no such"):
        started(FOLDER / "robot.launch.py", config=missing)
    with pytest.raises(ConfigurationError, match="no such"):
        started(FOLDER / "replay.launch.py", bag="bag", config=missing)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_launch_file_takes_namespace_joints_and_clock(path: Path) -> None:
    names = {each.name for each in load(path).ARGUMENTS}
    assert {"namespace", "left_wheel_joint", "right_wheel_joint", "use_sim_time"} <= names


def test_topics_in_a_namespace_stay_lossless() -> None:
    for name in ("replay", "simulation"):
        module = load(FOLDER / f"{name}.launch.py")
        plain, moved = module.lossless(""), module.lossless("robot1/")
        assert plain["qos_overrides./imu/data_raw.subscription.reliability"] == "reliable"
        assert moved["qos_overrides./robot1/imu/data_raw.subscription.reliability"] == "reliable"
        assert len(plain) == len(moved)


def test_a_replay_starts_the_whole_graph(tmp_path: Path) -> None:
    names = started(FOLDER / "replay.launch.py", bag=str(tmp_path), rate="0.0", json="x.json")
    assert names == ["evaluator_node", "filter_node", "correction_node", "replay_node"]


def test_a_simulation_starts_the_whole_robot() -> None:
    path = FOLDER / "simulation.launch.py"
    whole = [
        "simulator_node",
        "correction_node",
        "filter_node",
        "controller_node",
        "evaluator_node",
    ]
    assert started(path) == whole
    assert started(path, lockstep="true", world="W4", filter="ins_odometer") == whole


@pytest.mark.parametrize("name", ["robot", "replay", "simulation"])
def test_the_page_is_started_where_it_is_asked_for(name: str) -> None:
    path = FOLDER / f"{name}.launch.py"
    given = {"bag": "bag"} if name == "replay" else {}
    assert "dashboard_node" not in started(path, **given)
    assert started(path, **given, dashboard="true").count("dashboard_node") == 1


def test_a_display_describes_the_robot_and_opens_rviz_on_demand(tmp_path: Path) -> None:
    path = FOLDER / "display.launch.py"
    assert started(path) == ["robot_state_publisher", "rviz2"]
    assert started(path, rviz="false") == ["robot_state_publisher"]
    robot = tmp_path / "robot.yaml"
    robot.write_text("/**: {ros__parameters: {robot: {lever_arm: [0.0, 0.0, 0.321]}}}\n")
    module = load(path)
    given = {each.name: "" for each in module.ARGUMENTS}
    given |= {"config": str(robot), "base_frame": "base", "imu_frame": "imu"}
    given |= {"left_wheel_joint": "l_joint", "right_wheel_joint": "r_joint"}
    text = module.document(given)
    assert 'xyz="0 0 0.321"' in text and 'name="imu"' in text and 'name="r_joint"' in text


def test_the_simulation_passes_its_setup_to_the_estimator() -> None:
    known = load(FOLDER / "simulation.launch.py").estimator_setup("W4", 3)
    assert known["robot.track_width"] == 0.16 and known["robot.lever_arm"] == (0.0, 0.0, 0.135)
    assert len(known["calibration.accel_scale_x"]) == 5
    assert "calibration.accel_scale_y" not in known
