"""A recording through correction and filters, compared with its reference encoder.

ros2 launch twbr_estimation replay.launch.py bag:=bags/verification
ros2 launch twbr_estimation replay.launch.py bag:=my_bag rate:=0.0 json:=figures.json
"""

from __future__ import annotations

from pathlib import Path

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch_ros.actions import Node

from twbr_estimation.configuration.files import configuration_files

PACKAGE = "twbr_estimation"
CONFIG = Path(__file__).resolve().parent.parent / "config"
SWITCH = ["true", "false"]


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
)  # fmt: skip


def nodes(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the nodes that the arguments ask for."""
    given = context.launch_configurations
    settings: list[object] = [str(path) for path in configuration(given["bag"], given["config"])]
    if given["settings"]:
        settings.append(given["settings"])
    common = [str(CONFIG / "lossless.yaml"), {"use_sim_time": True}]
    chosen: dict[str, object] = {"compare": given["compare"].split(",")}
    if given["filter"]:
        chosen["filter"] = given["filter"]
    evaluator = {"json_file": given["json"], "source": Path(given["bag"]).name}
    return [
        node("evaluator_node", [*common, evaluator]),
        node("filter_node", [*settings, *common, chosen]),
        node("correction_node", [*settings, *common]),
        replay(given),
    ]


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
    return node("replay_node", [parameters], on_exit=done)


def node(executable: str, parameters: list[object], **options: object) -> Node:
    """Return the action that runs one of our executables."""
    return Node(
        package=PACKAGE, executable=executable, parameters=parameters, output="screen", **options
    )


def generate_launch_description() -> LaunchDescription:
    """Return arguments and nodes."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=nodes)])
