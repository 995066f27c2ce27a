"""A user's own controller on our tilt, in the whole loop: simulator, correction, filter, motors.

All are nodes in lockstep; the robot's sensors have their errors and their noise. Remaps and
parameters alone reach the controllers, which do not use this package.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from rclpy.context import Context

from nodes import foreign_controllers
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.simulator_node import SimulatorNode
from twbr_estimation.simulation.worlds import PAPER_CALIBRATION
from twbr_estimation.streams.simulator.simulator import Disturbance

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "my_balance_controller"
SEED = 12
LEAN = 0.4
"""Further than a push leans it, and less than where it falls [rad]."""
PUSHES = (2.0, -2.0)
"""One every two seconds [N]."""
CALIBRATION = {
    f"calibration__{name}": list(getattr(PAPER_CALIBRATION, name))
    for name in ("gyro_bias", "accel_bias", "accel_scale_x", "accel_scale_z")
}
LOSSLESS = ("imu/data_raw", "imu/data_corrected", "joint_states", "motor/command")


class Loop:
    """Simulator, correction and filter with the remaps of a user."""

    def __init__(
        self,
        graph: Any,
        *remaps: str,
        period: float = 0.005,
        unit: str = "voltage",
        **joints: str,
    ) -> None:
        self.graph = graph
        remapped = ["--ros-args", *(part for each in remaps for part in ("-r", each))]
        lossless: dict[str, Any] = graph.lossless(*LOSSLESS)
        for each in remaps:  # the quality of service goes by the name that counts
            lossless |= graph.lossless(each.split(":=")[1].lstrip("/"))
        robot: dict[str, Any] = {"world": "paper", "seed": SEED, "duration": 8.0, "lockstep": True}
        if joints:
            robot["wheel_joints"] = list(joints.values())
        timing = {"imu_period": 0.005, "control_period": period, "start_tilt": 0.02}
        self.robot = self._add(
            SimulatorNode, remapped, **lossless, **robot, **timing, command_unit=unit
        )
        known = {"use_sim_time": True, "timeout": 60.0, **lossless, **CALIBRATION, **joints}
        self._add(CorrectionNode, remapped, **known)
        self._add(FilterNode, remapped, filter="complementary", **known)

    def _add(self, kind: Any, remapped: list[str], **parameters: Any) -> Any:
        return self.graph.add(kind(cli_args=remapped, **self.graph.options(**parameters)))

    def lean(self, controller: Any | None) -> float:
        """Let the controller balance under the pushes; return how far the robot leaned [rad]."""
        if controller is not None:
            self.graph.add(controller)
        self.graph.settle()
        simulator, pushes, farthest = self.robot.simulator, list(PUSHES), 0.0

        def over() -> bool:
            nonlocal farthest
            farthest = max(farthest, abs(simulator.robot.truth.tilt))
            time = simulator.robot.time
            if pushes and time > 2.0 * (1 + len(PUSHES) - len(pushes)):
                simulator.push(Disturbance(push_force=pushes.pop(0)))
            return bool(time >= 2.0 * (1 + len(PUSHES)) or simulator.robot.held)

        self.graph.spin_until(over, 90.0)
        return farthest


@pytest.fixture
def examples(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], Any]]:
    """Return what imports a module of the example package."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    yield lambda name: import_module(f"my_balance_controller.{name}")
    for name in [name for name in sys.modules if name.startswith("my_balance_controller")]:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("module", "kind"), [("on_tilt", "BalanceOnTilt"), ("on_imu", "BalanceOnImu")]
)
def test_the_examples_balance(graph: Any, examples: Any, module: str, kind: str) -> None:
    loop = Loop(graph)
    own = getattr(examples(module), kind)(**graph.options(use_sim_time=True))
    assert 0.01 < loop.lean(own) < LEAN


@pytest.mark.parametrize(
    ("module", "kind"), [("on_tilt", "BalanceOnTilt"), ("on_imu", "BalanceOnImu")]
)
def test_a_sample_that_ctrl_c_overtakes_raises_nothing(
    examples: Any, module: str, kind: str
) -> None:
    context = Context()
    context.init()
    controller = getattr(examples(module), kind)(context=context)
    controller.drive(1.0)
    context.shutdown()
    controller.drive(1.0)  # rclpy ends the context at once, a callback may still run


def test_a_controller_of_torques_needs_a_remap_and_the_joints_names(graph: Any) -> None:
    """GRACE: `/robot_pitch`, `wheel_left_joint` and `wheel_right_joint`, torques out."""
    loop = Loop(
        graph,
        "tilt:=/robot_pitch",
        "motor/command:=/simple_effort_controller/commands",
        period=0.01,
        unit="torque",
        left_wheel_joint="wheel_left_joint",
        right_wheel_joint="wheel_right_joint",
    )
    own = foreign_controllers.TorqueOnPitch(**graph.options(use_sim_time=True))
    assert 0.01 < loop.lean(own) < LEAN


def test_a_controller_of_an_imu_needs_a_remap(graph: Any) -> None:
    loop = Loop(graph, "imu/data:=/imu", "motor/command:=/wheel_volts")
    own = foreign_controllers.PidOnImu(**graph.options())
    assert 0.01 < loop.lean(own) < LEAN


def test_a_controller_of_the_wrong_sign_lets_the_robot_fall(graph: Any, examples: Any) -> None:
    """The tests above can fail: nobody holds the robot but its controller."""
    loop = Loop(graph)
    own = examples("on_imu").BalanceOnImu(**graph.options(use_sim_time=True))
    drive = own.drive
    own.drive = lambda voltage: drive(-voltage)
    assert loop.lean(own) > LEAN


@pytest.mark.parametrize(
    "path",
    [*EXAMPLES.rglob("*.py"), Path(foreign_controllers.__file__)],
    ids=lambda path: path.name,
)
def test_they_are_written_without_ours(path: Path) -> None:
    source = path.read_text()
    tree = list(ast.walk(ast.parse(source)))
    names = [alias.name for node in tree if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module or "" for node in tree if isinstance(node, ast.ImportFrom)]
    assert "twbr_estimation" not in {name.split(".")[0] for name in names}
    if path.name.startswith("on_"):
        assert len(source.splitlines()) <= 68, "an example is short enough to read at once"
