"""A user's own controller on our tilt, in the whole loop: sensors, correction, filter, motors.

The robot's sensors have their errors and their noise; everything is reached by remaps alone.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.simulation.stepping import SimulatedRobot

from . import foreign_controllers
from .simulated import SimulatedTopics, upright

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "my_balance_controller"
SEED = 12
LEAN = 0.4
"""Further than a push leans it, and less than where it falls [rad]."""
INPUTS = ("imu/data_raw", "joint_states")


class Estimation:
    """Robot, correction and filter; the controller is yet to come."""

    def __init__(self, graph: Any, remaps: tuple[str, ...] = (), **parameters: Any) -> None:
        self.graph = graph
        self.robot = SimulatedRobot("paper", SEED, 0.005, disturbed=False, stay_down=True)
        self.robot.place(0.02)
        config = parameters_of(self.robot)
        common = {"use_sim_time": True, **config, **parameters}
        remapped = ["--ros-args", *(part for each in remaps for part in ("-r", each))]
        for kind, inputs in ((CorrectionNode, INPUTS), (FilterNode, ("imu/data_corrected",))):
            options = graph.options(**graph.lossless(*inputs), **common)
            self.filter = graph.add(kind(cli_args=remapped, **options))

    def drive(self, controller: Any, period: float = 0.005, **options: Any) -> list[float]:
        """Let the controller balance for six seconds with two pushes; return the true tilts."""
        self.graph.add(controller)
        topics = SimulatedTopics(self.graph, self.robot, **options)
        self.graph.settle()
        for count in range(1, 101):  # somebody holds the robot until all is running
            self.robot.place(0.02)
            topics.run(0.005, wait=False)
            self.graph.spin_until(lambda count=count: self.filter._counts["samples"] == count)
        self.graph.spin_until(lambda: bool(topics.commands))
        tilts = topics.run(2.0, period)
        self.robot.push(2.0)
        tilts += topics.run(2.0, period)
        self.robot.push(-2.0)
        return tilts + topics.run(2.0, period)


def parameters_of(robot: SimulatedRobot) -> dict[str, Any]:
    """Return the calibration that the robot's user knows."""
    calibration = robot.setup.calibration
    found: dict[str, Any] = {"robot__wheel_radius": robot.setup.robot.wheel_radius}
    for name in ("gyro_bias", "accel_bias", "accel_scale_x", "accel_scale_y", "accel_scale_z"):
        values = [float(value) for value in getattr(calibration, name)]
        if values:
            found[f"calibration__{name}"] = values
    return found


@pytest.fixture
def examples(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    """Return what imports a module of the example package."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    yield lambda name: import_module(f"my_balance_controller.{name}")
    for name in [name for name in sys.modules if name.startswith("my_balance_controller")]:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("module", "kind"), [("on_tilt", "BalanceOnTilt"), ("on_imu", "BalanceOnImu")]
)
def test_the_examples_balance(graph: Any, examples: Any, module: str, kind: str) -> None:
    estimation = Estimation(graph)
    own = getattr(examples(module), kind)(**graph.options(use_sim_time=True))
    assert upright(estimation.drive(own), LEAN)


def test_a_controller_of_torques_needs_one_remap(graph: Any) -> None:
    """GRACE: `/robot_pitch`, `wheel_left_joint` and `wheel_right_joint`, torques out."""
    joints = ("wheel_left_joint", "wheel_right_joint")
    estimation = Estimation(
        graph,
        ("tilt:=/robot_pitch",),
        left_wheel_joint=joints[0],
        right_wheel_joint=joints[1],
    )
    plant = estimation.robot.plant
    gain = plant.gear_ratio * plant.torque_constant / plant.winding_resistance

    def volts(torques: tuple[float, ...], reading: Any) -> tuple[float, ...]:
        """Be the motor driver that keeps the torque."""
        wheel = reading.truth.velocity / plant.wheel_radius - reading.truth.rate
        back = plant.back_emf_constant * plant.gear_ratio * wheel
        return tuple(torque / gain + back for torque in torques)

    own = foreign_controllers.TorqueOnPitch(**graph.options(use_sim_time=True))
    out = "/simple_effort_controller/commands"
    tilts = estimation.drive(own, 0.01, joints=joints, command=out, voltages=volts)
    assert upright(tilts, LEAN)


def test_a_controller_of_an_imu_needs_one_remap(graph: Any) -> None:
    estimation = Estimation(graph, ("imu/data:=/imu",))
    own = foreign_controllers.PidOnImu(**graph.options())
    assert upright(estimation.drive(own, command="/wheel_volts"), LEAN)


def test_without_a_controller_the_robot_falls(graph: Any) -> None:
    """The tests above can fail: nobody holds the robot but its controller."""
    estimation = Estimation(graph)
    topics = SimulatedTopics(graph, estimation.robot)
    assert not upright(topics.run(3.0, wait=False), LEAN)


@pytest.mark.parametrize(
    "path",
    [*EXAMPLES.rglob("*.py"), Path(foreign_controllers.__file__)],
    ids=lambda path: path.name,
)
def test_they_are_written_without_ours(path: Path) -> None:
    source = path.read_text()
    assert "twbr_estimation" not in {
        name.split(".")[0]
        for node in ast.walk(ast.parse(source))
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    if path.name.startswith("on_"):
        assert len(source.splitlines()) <= 66, "an example is short enough to read at once"
