"""The estimation of a robot: drivers, correction, filter; on request controller and evaluation.

ros2 launch twbr_estimation robot.launch.py
ros2 launch twbr_estimation robot.launch.py config:=/home/pi/my_robot compare:=all
ros2 launch twbr_estimation robot.launch.py controller:=lqr dashboard:=true
ros2 launch twbr_estimation robot.launch.py simulated:=true reference:=true
ros2 launch twbr_estimation robot.launch.py imu_driver:=false encoder_driver:=false
ros2 launch twbr_estimation robot.launch.py composed:=false
"""

from __future__ import annotations

from pathlib import Path

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction
from launch_ros.actions import Node, PushRosNamespace

from twbr_estimation.configuration.files import configuration_files
from twbr_estimation.nodes.launch_arguments import PAGE_ARGUMENTS, page_parameters

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
    argument(
        "calibration_file",
        "",
        "File to which ~/calibrate of correction_node saves, and from which it starts, in the "
        "place of the folder's calibration; empty: what is found lasts until the end.",
    ),
    argument(
        "imu_driver",
        "true",
        "Run mpu6050_node; false where another driver publishes imu/data_raw.",
        switch=True,
    ),
    argument(
        "encoder_driver",
        "true",
        "Run encoder_node; false where another driver publishes joint_states.",
        switch=True,
    ),
    argument("imu_params", str(CONFIG / "mpu6050.yaml"), "Parameter file of mpu6050_node."),
    argument("encoder_params", str(CONFIG / "encoders.yaml"), "Parameter file of encoder_node."),
    argument("filter", "", "Filter whose estimate is published; empty: as filters.yaml says."),
    argument("compare", "", "Filters beside it on tilt/compare: NAME,NAME or all; empty: none."),
    argument("controller", "", "Controller that balances with the estimate; empty: none runs."),
    argument(
        "reference", "false", "Read a reference encoder and evaluate against it.", switch=True
    ),
    DeclareLaunchArgument(
        "composed",
        default_value="auto",
        description="One process for drivers, correction, filter and controller, which is what a "
        "small computer has time for; auto: unless only one of the drivers runs.",
        choices=["auto", *SWITCH],
    ),
    argument("namespace", "", "Namespace of nodes and topics."),
    argument("left_wheel_joint", "left_wheel_joint", "Name of the left wheel in joint_states."),
    argument("right_wheel_joint", "right_wheel_joint", "Name of the right wheel."),
    argument("use_sim_time", "false", "Take the time from /clock.", switch=True),
    *(argument(*each) for each in PAGE_ARGUMENTS),
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
    common: dict[str, object] = {"use_sim_time": given["use_sim_time"] == "true"}
    joints = {name: given[name] for name in ("left_wheel_joint", "right_wheel_joint")}
    controller = {"controller": given["controller"]} if given["controller"] else {}
    kept = {"calibration_file": given["calibration_file"]} if given["calibration_file"] else {}
    composed = one_process(given)
    if composed:
        files = [*config, given["imu_params"], given["encoder_params"]]
        chosen |= {"drivers": given["imu_driver"] == "true", "control": bool(controller)}
        chosen |= controller
        found = [node("estimation_node", [*files, common, joints, simulated, kept, chosen])]
    else:
        found = [
            *drivers([*imu, common], [*encoders, common], given),
            node("correction_node", [*config, common, joints, kept]),
            node("filter_node", [*config, common, joints, chosen]),
        ]
    if controller and not composed:
        found.append(node("controller_node", [*config, common, joints, controller]))
    if given["reference"] == "true":
        found.append(node("encoder_node", [*encoders, common], name="reference_encoder_node"))
        found.append(node("evaluator_node", [common]))
    if page := page_parameters(given):
        found.append(node("dashboard_node", [common, page]))
    return [GroupAction([PushRosNamespace(given["namespace"]), *found])]


def drivers(
    imu: list[object], encoders: list[object], given: dict[str, str]
) -> list[LaunchDescriptionEntity]:
    """Return the drivers that are to run, with these parameters."""
    wanted = []
    if given["imu_driver"] == "true":
        wanted.append(node("mpu6050_node", imu))
    if given["encoder_driver"] == "true":
        wanted.append(node("encoder_node", encoders))
    return wanted


def one_process(given: dict[str, str]) -> bool:
    """Return whether all runs in one process, which reads both sensors or none."""
    one_driver = given["imu_driver"] != given["encoder_driver"]
    if given["composed"] == "true" and one_driver:
        raise ValueError(
            "composed:=true runs both drivers or none; set imu_driver as encoder_driver"
        )
    return given["composed"] != "false" and not one_driver


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
