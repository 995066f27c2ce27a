"""The estimation of a robot: drivers, correction, filter; on request controller and evaluation.

ros2 launch twbr_estimation robot.launch.py
ros2 launch twbr_estimation robot.launch.py config:=/home/pi/my_robot compare:=all
ros2 launch twbr_estimation robot.launch.py controller:=lqr
ros2 launch twbr_estimation robot.launch.py simulated:=true reference:=true
"""

from __future__ import annotations

from pathlib import Path

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction
from launch_ros.actions import Node, PushRosNamespace

from twbr_estimation.configuration.files import configuration_files

PACKAGE = "twbr_estimation"
CONFIG = Path(__file__).resolve().parent.parent / "config"
SWITCH = ["true", "false"]


def argument(
    name: str, default: str, description: str, switch: bool = False
) -> LaunchDescriptionEntity:
    """Return a launch argument."""
    choices = SWITCH if switch else None
    return DeclareLaunchArgument(
        name, default_value=default, description=description, choices=choices
    )


ARGUMENTS = (
    argument("simulated", "false", "Read simulated devices: needs no hardware.", switch=True),
    argument(
        "config",
        "",
        "Folder with robot.yaml, calibration.yaml, filters.yaml; empty: the package's, without "
        "its calibration where the devices are simulated, because those have no errors.",
    ),
    argument("imu_params", str(CONFIG / "mpu6050.yaml"), "Parameter file of mpu6050_node."),
    argument("encoder_params", str(CONFIG / "encoders.yaml"), "Parameter file of encoder_node."),
    argument("filter", "", "Filter whose estimate is published; empty: as filters.yaml says."),
    argument("compare", "", "Filters beside it on tilt/compare: NAME,NAME or all; empty: none."),
    argument("controller", "", "Controller that balances with the estimate; empty: none runs."),
    argument(
        "reference", "false", "Read a reference encoder and evaluate against it.", switch=True
    ),
    argument("composed", "false", "One process for all nodes but the evaluation.", switch=True),
    argument("namespace", "", "Namespace of nodes and topics."),
)


def nodes(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the nodes that the arguments ask for."""
    given = context.launch_configurations
    simulated = {"simulated": given["simulated"] == "true"}
    config = configuration(given["config"], simulated["simulated"])
    chosen: dict[str, object] = {}
    if given["filter"]:
        chosen["filter"] = given["filter"]
    if given["compare"]:
        chosen["compare"] = given["compare"].split(",")
    # The driver compares its ranges with those that the correction counts with.
    robot = [path for path in config if Path(path).name == "robot.yaml"]
    imu = [*robot, given["imu_params"], simulated]
    encoders = [given["encoder_params"], simulated]
    if given["composed"] == "true":
        parameters = [*config, given["imu_params"], given["encoder_params"], simulated, chosen]
        found = [node("estimation_node", parameters)]
    else:
        found = [
            node("mpu6050_node", imu),
            node("encoder_node", encoders),
            node("correction_node", config),
            node("filter_node", [*config, chosen]),
        ]
    if given["controller"]:
        found.append(node("controller_node", [*config, {"controller": given["controller"]}]))
    if given["reference"] == "true":
        found.append(node("encoder_node", encoders, name="reference_encoder_node"))
        found.append(node("evaluator_node", []))
    return [GroupAction([PushRosNamespace(given["namespace"]), *found])]


def configuration(folder: str, simulated: bool) -> list[str]:
    """Return the parameter files of the robot."""
    if folder or not simulated:
        return [str(path) for path in configuration_files(folder or CONFIG)]
    return [str(CONFIG / "robot.yaml"), str(CONFIG / "filters.yaml")]


def node(executable: str, parameters: list[object], name: str | None = None) -> Node:
    """Return the action that runs one of our executables."""
    return Node(
        package=PACKAGE, executable=executable, name=name, parameters=parameters, output="screen"
    )


def generate_launch_description() -> LaunchDescription:
    """Return arguments and nodes."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=nodes)])
