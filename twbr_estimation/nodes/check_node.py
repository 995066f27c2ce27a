"""The acceptance test of a live robot: asks for what it needs, and ends with a table.

It asks, in the log, to leave the robot at rest, to turn each wheel forward and to lean it
forward, then watches it move for 20 s and prints what `twbr check` prints of a recording: PASS,
WARN or FAIL with the lines of YAML to change. The process ends with status 1 if anything FAILs,
else 0; interrupted, it prints what was found so far.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import rclpy
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import Imu, JointState

from ..checks.finding import Severity, noteworthy, worst
from ..errors import ConfigurationError
from ..parameters.bounds import Meaning
from ..robot import Setup
from ..streams.acceptance import Acceptance, AcceptanceSettings
from ..streams.device.stamping import Stamping
from ..streams.inputs import InputSettings, wheel_input
from ..streams.messages import JointStateDecoder, decode_raw_imu
from .diagnostics import Diagnostics, Level, Report
from .guard import GuardedNode
from .inputs import listen_to_wheels
from .parameters import declare_settings
from .qos import listen
from .spin import run

LOOK_PERIOD = 0.2
"""Time between two looks at the data [s]."""
LEVELS = {Severity.FAIL: Level.ERROR, Severity.WARN: Level.WARN}


@dataclass(frozen=True, slots=True)
class CheckOutputs:
    """Further parameters of the node."""

    reference_joint: Annotated[
        str, Meaning("Joint of `reference/joint_states` that is the tilt.")
    ] = "tilt"
    json_file: Annotated[
        str, Meaning("Where the findings are written at the end; nowhere if empty.")
    ] = ""


class CheckNode(GuardedNode):
    """Subscribes and prints; what is found is the work of an `Acceptance`."""

    def __init__(self, at_end: Callable[[], object] | None = None, **options: Any) -> None:
        """Create the node.

        Args:
            at_end: Called once all is done.
            options: Options of `rclpy.node.Node`.

        Raises:
            ConfigurationError: a parameter that cannot be used.
        """
        super().__init__("check_node", **options)
        inputs = declare_settings(self, InputSettings())
        setup = declare_settings(self, Setup())
        self._outputs = declare_settings(self, CheckOutputs())
        self.acceptance = Acceptance(
            setup, declare_settings(self, AcceptanceSettings()), inputs.wheel_wait
        )
        self._wheels = wheel_input(inputs, lambda: setup.robot.wheel_radius)
        self._stamping = Stamping(inputs.stamps, "imu/data_raw")
        self._joints = JointStateDecoder()
        self.status: int | None = None
        """Exit status once all is done: 1 if anything fails, else 0."""
        self._at_end = at_end
        self._asked = ""
        self._printed = False
        listen(self, Imu, "imu/data_raw", self._on_imu)
        listen_to_wheels(self, inputs, self._on_joints)
        listen(self, JointState, "reference/joint_states", self._on_reference)
        self._diagnostics = Diagnostics(self, self.report)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(LOOK_PERIOD, self.look, clock=steady)

    def _on_imu(self, data: bytes) -> None:
        stamp, values = decode_raw_imu(data)
        self.acceptance.add_imu(self._stamping.stamp(stamp, self.clock_now()), values)

    def _on_joints(self, data: bytes) -> None:
        reading = self._wheels.decode(data, self.clock_now())
        if reading is not None:
            self.acceptance.add_wheels(reading)

    def _on_reference(self, data: bytes) -> None:
        stamp, names, positions = self._joints.decode(data)
        if self._outputs.reference_joint in names:
            tilt = positions[names.index(self._outputs.reference_joint)]
            self.acceptance.add_reference(stamp, tilt)

    def look(self) -> None:
        """Go on; ask for what is new, and print once all is done."""
        if self.status is not None:
            return
        self.acceptance.look(time.monotonic())
        if self.acceptance.ended:
            self.status = int(worst(self.acceptance.found) is Severity.FAIL)
            self.finish()
            if self._at_end is not None:
                self._at_end()
            return
        if self.acceptance.request != self._asked:
            self._asked = self.acceptance.request
            self.get_logger().info(self._asked)

    def report(self) -> Report:
        """Return what `/diagnostics` says."""
        found = noteworthy(self.acceptance.found)
        values = {**self.acceptance.counts, "unreadable_messages": self.unreadable}
        sentences = [self.acceptance.request, *(each.sentence for each in found)]
        level = LEVELS.get(worst(found), Level.OK)
        return Report(level, "; ".join(sentences), values)

    def finish(self) -> None:
        """Print the table and write the file, once."""
        if self._printed:
            return
        self._printed = True
        self._diagnostics.update()
        from ..checks.table import as_json, print_findings
        from ..printing.console import SafeConsole
        from ..scoring.table import write_json

        print_findings(SafeConsole(), "live", self.acceptance.found)
        if self._outputs.json_file:
            try:
                write_json(self._outputs.json_file, {"findings": as_json(self.acceptance.found)})
            except ConfigurationError as error:
                self.get_logger().error(f"json_file: {error}")

    def destroy_node(self) -> None:
        """Print what was found if that has not been done, then destroy the node."""
        if self.acceptance.found:
            self.finish()
        super().destroy_node()


def main(arguments: list[str] | None = None) -> int:
    """Run the node until all is done, or until it is asked to stop."""
    created: list[CheckNode] = []

    def create() -> CheckNode:
        created.append(CheckNode(rclpy.try_shutdown))
        return created[0]

    status = run(create, arguments)
    return status or (created[0].status or 0 if created else 0)


if __name__ == "__main__":
    raise SystemExit(main())
