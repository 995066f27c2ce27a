"""The whole robot without hardware: simulator, correction, filter, controller and evaluator.

ros2 launch twbr_estimation simulation.launch.py
ros2 launch twbr_estimation simulation.launch.py world:=W2 disturbed:=true filter:=ins_odometer
ros2 launch twbr_estimation simulation.launch.py lockstep:=true json:=figures.json
ros2 launch twbr_estimation simulation.launch.py drivers:=true
ros2 launch twbr_estimation simulation.launch.py dashboard:=true dashboard_host:=0.0.0.0
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction
from launch_ros.actions import Node, PushRosNamespace

from twbr_estimation.nodes.declarations import declarations_of
from twbr_estimation.nodes.launch_arguments import PAGE_ARGUMENTS, lossless, page_parameters
from twbr_estimation.physics import SCENES
from twbr_estimation.physics.simulate import spatial
from twbr_estimation.robot import Robot
from twbr_estimation.simulation import WORLDS, world_named
from twbr_estimation.simulation.simulate import setups_of

PACKAGE = "twbr_estimation"
CONFIG = Path(__file__).resolve().parent.parent / "config"
SWITCH = ["true", "false"]
WHEEL_JOINTS = ["left_wheel_joint", "right_wheel_joint"]
SWITCHES = ("disturbed", "stay_down", "lockstep", "compiled")
START_TIMEOUT = 60.0
"""In lockstep: wall time [s] for which a clock that stands still is not a dead sensor."""


def argument(
    name: str, default: str, description: str, choices: list[str] | None = None
) -> LaunchDescriptionEntity:
    """Return a launch argument."""
    return DeclareLaunchArgument(
        name, default_value=default, description=description, choices=choices
    )


ARGUMENTS = (
    argument("world", "paper", "What is wrong with robot, sensors and ground.", list(WORLDS)),
    argument("physics", "rig", "What moves the robot.", ["rig", "mujoco"]),
    argument("scene", "stand", "In mujoco: what happens to the robot.", list(SCENES)),
    argument("seed", "1", "Number of the random draw."),
    argument("disturbed", "false", "Whether the world pushes and trips the robot.", SWITCH),
    argument("filter", "", "Filter whose estimate is balanced with; empty: as configured."),
    argument("compare", "", "Filters beside it on tilt/compare: NAME,NAME or all; empty: none."),
    argument("controller", "", "Controller; empty: the default."),
    argument("stay_down", "false", "A fallen robot lies until ~/stand_up is called.", SWITCH),
    argument("lockstep", "false", "Time waits for the controller: the same run each time.", SWITCH),
    argument("drivers", "false", "The real drivers read simulated chips.", SWITCH),
    argument("compiled", "false", "Compile the plant: less load, a slower start.", SWITCH),
    argument("settings", str(CONFIG / "filters.yaml"), "Parameter file of the filters."),
    argument("json", "", "File for the evaluator's figures; empty: none."),
    argument("namespace", "", "Namespace of nodes and topics."),
    argument("left_wheel_joint", "left_wheel_joint", "Name of the left wheel in joint_states."),
    argument("right_wheel_joint", "right_wheel_joint", "Name of the right wheel."),
    argument("use_sim_time", "false", "Take the time from /clock; in lockstep always.", SWITCH),
    *(
        argument(name, default, text, SWITCH if switch else None)
        for name, default, text, switch in PAGE_ARGUMENTS
    ),
)


def nodes(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the nodes that the arguments ask for."""
    given = context.launch_configurations
    in_lockstep = given["lockstep"] == "true"
    joints = {name: given[name] for name in ("left_wheel_joint", "right_wheel_joint")}
    reliable = lossless(CONFIG / "lossless.yaml", given["namespace"])
    lossless_topics = [reliable] if in_lockstep else []
    sim_time = {"use_sim_time": in_lockstep or given["use_sim_time"] == "true"}
    common: list[Any] = [*lossless_topics, sim_time]
    known = estimator_setup(given["world"], int(given["seed"]), given["physics"])
    chosen: dict[str, Any] = {"filter": given["filter"]} if given["filter"] else {}
    if given["compare"]:
        chosen["compare"] = given["compare"].split(",")
    patient = {"timeout": START_TIMEOUT} if in_lockstep else {}
    standing = {"clock_timeout": START_TIMEOUT} if in_lockstep else {}
    controller = {"controller": given["controller"]} if given["controller"] else {}
    source = {"json_file": given["json"], "source": f"world {given['world']}, seed {given['seed']}"}
    found = [
        node("simulator_node", [*lossless_topics, simulator(given)]),
        node("correction_node", [*common, known, joints, patient]),
        node("filter_node", [*common, given["settings"], known, joints, chosen, patient]),
        node("controller_node", [*common, known, joints, controller, standing]),
        node("evaluator_node", [*common, source]),
    ]
    if page := page_parameters(given):
        found.append(node("dashboard_node", [sim_time, page]))
    return [GroupAction([PushRosNamespace(given["namespace"]), *found])]


def simulator(given: dict[str, str]) -> dict[str, Any]:
    """Return the parameters of the simulator."""
    switches = {name: given[name] == "true" for name in SWITCHES}
    sensors = "registers" if given["drivers"] == "true" else "topics"
    # The filters were tuned at 2 ms; in lockstep a step must be whole periods of the IMU.
    periods = {} if switches["lockstep"] else {"imu_period": 0.002}
    chosen: dict[str, Any] = {
        **{name: given[name] for name in ("world", "physics", "scene")},
        "seed": int(given["seed"]),
        "sensors": sensors,
    }
    joints = [given["left_wheel_joint"], given["right_wheel_joint"]]
    if joints != WHEEL_JOINTS:
        chosen["wheel_joints"] = joints
    return {**chosen, **switches, **periods}


def estimator_setup(world: str, seed: int, physics: str = "rig") -> dict[str, Any]:
    """Return the parameters of the estimator: the robot's geometry and the sensor's errors."""
    chosen = world_named(world)
    setup, _ = setups_of(chosen if physics == "rig" else spatial(chosen, Robot()), seed)
    declared = [
        *declarations_of(setup.robot, "robot."),
        *declarations_of(setup.calibration, "calibration."),
    ]
    return {each.name: each.default for each in declared if each.default != ()}


def node(executable: str, parameters: list[Any]) -> Node:
    """Return the action that runs one of our executables."""
    return Node(package=PACKAGE, executable=executable, parameters=parameters, output="screen")


def generate_launch_description() -> LaunchDescription:
    """Return arguments and nodes."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=nodes)])
