"""A recording through correction and filters, compared with its reference encoder.

ros2 launch twbr_estimation replay.launch.py bag:=bags/verification
ros2 launch twbr_estimation replay.launch.py bag:=my_bag rate:=0.0 json:=figures.json
ros2 launch twbr_estimation replay.launch.py bag:=my_bag loop:=true dashboard:=true
"""

from __future__ import annotations

from pathlib import Path

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction, Shutdown
from launch_ros.actions import Node, PushRosNamespace

from twbr_estimation.configuration.files import configuration_files
from twbr_estimation.nodes.launch_arguments import PAGE_ARGUMENTS, lossless, page_parameters

PACKAGE = "twbr_estimation"
CONFIG = Path(__file__).resolve().parent.parent / "config"
SWITCH = ["true", "false"]
RECORDED = (
    "imu/data_raw",
    "imu/temperature",
    "joint_states",
    "reference/joint_states",
    "motor/command",
)
"""Topics of a recording that follow the nodes into a namespace."""


def argument(
    name: str, default: str | None, description: str, switch: bool = False
) -> LaunchDescriptionEntity:
    """Return a launch argument; one without a default must be given."""
    choices = SWITCH if switch else None
    return DeclareLaunchArgument(
        name, default_value=default, description=description, choices=choices
    )


ARGUMENTS = (
    argument("bag", None, "The recording: rosbag2 folder, .mcap, .db3 or ROS 1 .bag."),
    argument("rate", "1.0", "Speed; 1.0 as recorded, 0.0 as fast as the graph takes it, lossless."),
    argument("start", "0.0", "Time at the beginning that is left out [s]."),
    argument("duration", "0.0", "Time that is played from there [s]; 0.0 is all."),
    argument("loop", "false", "Begin again at the end.", switch=True),
    argument("paused", "false", "Wait for the service /replay_node/resume.", switch=True),
    argument("config", "", "Folder with robot.yaml, calibration.yaml, filters.yaml; empty: the "
             "recording's own folder `config`, else the package's."),
    argument("settings", "", "One more parameter file for the filters, such as a preset's."),
    argument("filter", "", "Filter whose estimate is published; empty: as configured."),
    argument("compare", "all", "Filters beside it on tilt/compare: NAME,NAME or all."),
    argument("json", "", "File for the evaluator's figures; empty: none."),
    argument("shutdown", "true", "End everything after the last message.", switch=True),
    argument("namespace", "", "Namespace of nodes and topics, those of the recording as well."),
    argument("left_wheel_joint", "left_wheel_joint", "Name of the left wheel in joint_states."),
    argument("right_wheel_joint", "right_wheel_joint", "Name of the right wheel."),
    argument("use_sim_time", "true", "Take the time from the recording's clock.", switch=True),
    *(argument(*each) for each in PAGE_ARGUMENTS),
)  # fmt: skip


def nodes(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the nodes that the arguments ask for."""
    given = context.launch_configurations
    settings: list[object] = [str(path) for path in configuration(given["bag"], given["config"])]
    if given["settings"]:
        settings.append(given["settings"])
    sim_time = {"use_sim_time": given["use_sim_time"] == "true"}
    joints = {name: given[name] for name in ("left_wheel_joint", "right_wheel_joint")}
    common: list[object] = [lossless(CONFIG / "lossless.yaml", given["namespace"]), sim_time]
    chosen: dict[str, object] = {"compare": given["compare"].split(",")}
    if given["filter"]:
        chosen["filter"] = given["filter"]
    evaluator = {"json_file": given["json"], "source": Path(given["bag"]).name}
    found = [
        node("evaluator_node", [*common, evaluator]),
        node("filter_node", [*settings, *common, joints, chosen]),
        node("correction_node", [*settings, *common, joints]),
        replay(given),
    ]
    if page := page_parameters(given):
        found.insert(0, node("dashboard_node", [sim_time, page]))
    return [GroupAction([PushRosNamespace(given["namespace"]), *found])]


def configuration(bag: str, config: str) -> list[Path]:
    """Return the parameter files for a recording."""
    own = Path(bag) / "config"
    return configuration_files(config or (own if own.is_dir() else CONFIG))


def replay(given: dict[str, str]) -> Node:
    """Return the action that plays the recording once everybody listens."""
    ends = given["shutdown"] == "true"
    parameters = {
        "bag": given["bag"],
        **{name: float(given[name]) for name in ("rate", "start", "duration")},
        **{name: given[name] == "true" for name in ("loop", "paused")},
        "exit_at_end": ends,
        "wait_for": ["imu/data_raw", "imu/data_corrected", "imu/data", "tilt/compare"],
    }
    done = [Shutdown(reason="the recording has been played")] if ends else None
    moved = [(f"/{topic}", topic) for topic in RECORDED] if given["namespace"] else []
    return node("replay_node", [parameters], on_exit=done, remappings=moved)


def node(executable: str, parameters: list[object], **options: object) -> Node:
    """Return the action that runs one of our executables."""
    return Node(
        package=PACKAGE, executable=executable, parameters=parameters, output="screen", **options
    )


def generate_launch_description() -> LaunchDescription:
    """Return arguments and nodes."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=nodes)])
