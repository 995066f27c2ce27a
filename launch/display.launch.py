"""The robot of robot.yaml in RViz, as the estimate tilts it.

ros2 launch twbr_estimation display.launch.py
ros2 launch twbr_estimation display.launch.py config:=/home/pi/my_robot rviz:=false

Beside it a filter_node must run with publish_tf:=true. Needs the packages robot_state_publisher
and rviz2.
"""

from __future__ import annotations

from pathlib import Path

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction
from launch_ros.actions import Node, PushRosNamespace

from twbr_estimation.configuration.files import read_setup
from twbr_estimation.configuration.urdf import FrameNames, urdf

CONFIG = Path(__file__).resolve().parent.parent / "config"
SWITCH = ["true", "false"]
FRAMES = FrameNames()


def argument(
    name: str, default: str, description: str, switch: bool = False
) -> LaunchDescriptionEntity:
    """Return a launch argument."""
    choices = SWITCH if switch else None
    return DeclareLaunchArgument(
        name, default_value=default, description=description, choices=choices
    )


ARGUMENTS = (
    argument("config", str(CONFIG), "Folder with robot.yaml, or that file."),
    argument("rviz", "true", "Open RViz; false: only publish robot_description.", switch=True),
    argument("rviz_config", str(CONFIG / "robot.rviz"), "What RViz shows."),
    argument("base_frame", FRAMES.base, "tf_child of filter_node."),
    argument("imu_frame", FRAMES.imu, "frame_id of the IMU."),
    argument("left_wheel_joint", FRAMES.wheels[0], "Name of the left wheel in joint_states."),
    argument("right_wheel_joint", FRAMES.wheels[1], "Name of the right wheel."),
    argument("namespace", "", "Namespace of nodes and topics; /tf has none."),
    argument("use_sim_time", "false", "Take the time from /clock.", switch=True),
)


def nodes(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the nodes that the arguments ask for."""
    given = context.launch_configurations
    common = {"use_sim_time": given["use_sim_time"] == "true"}
    description = {"robot_description": document(given)}
    found = [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            parameters=[description, common],
            output="screen",
        )
    ]
    if given["rviz"] == "true":
        found.append(
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", given["rviz_config"]],
                parameters=[common],
                output="screen",
            )
        )
    return [GroupAction([PushRosNamespace(given["namespace"]), *found])]


def document(given: dict[str, str]) -> str:
    """Return the robot as URDF."""
    wheels = given["left_wheel_joint"], given["right_wheel_joint"]
    frames = FrameNames(given["base_frame"], given["imu_frame"], wheels)
    return urdf(read_setup(given["config"]).robot, frames=frames)


def generate_launch_description() -> LaunchDescription:
    """Return arguments and nodes."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=nodes)])
