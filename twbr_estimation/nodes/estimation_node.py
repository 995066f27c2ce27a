"""Drivers, correction, filter and on request the controller in one process: for small computers.

The nodes keep their names, parameters, services and topics; what one hands to the next goes
by a direct call instead of the middleware. So its services lie below `/correction_node` and
`/filter_node`, for instance `/correction_node/calibrate` and `/filter_node/set_parameters`, and
below `/mpu6050_node`, `/encoder_node` and `/controller_node` where those run in it; none of
them lies below `/estimation_node`, which has the parameters `drivers` (default true: the
sensors are read in this process) and `control` (default false: the controller runs in it) alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rclpy.node import Node

from ..sensors.encoder import Counter
from ..sensors.i2c import Registers
from .correction_node import CorrectionNode
from .declarations import Declaration
from .encoder_node import EncoderNode
from .filter_node import FilterNode
from .guard import GuardedNode
from .mpu6050_node import Mpu6050Node
from .output import never_wait
from .parameters import declare
from .spin import run

DRIVERS = Declaration(
    "drivers",
    True,
    "Whether the sensors are read in this process; else from imu/data_raw and joint_states, for "
    "instance of a replay.",
    read_only=True,
)

CONTROL = Declaration(
    "control",
    False,
    "Whether controller_node runs in this process, too, and gets tilt, wheels and validity by "
    "direct calls.",
    read_only=True,
)


def compose(
    registers: Registers | None = None, counters: Sequence[Counter] = (), **options: Any
) -> list[Node]:
    """Return the connected nodes.

    Args:
        registers: A chip to read instead of the bus, such as a simulated one.
        counters: What to read instead of the encoders' devices.
        options: For each `rclpy.node.Node`.
    """
    process = GuardedNode("estimation_node", **options)
    drivers, control = declare(process, DRIVERS), declare(process, CONTROL)
    tilt = FilterNode(subscribe=False, **options)
    correction = CorrectionNode(tilt.take, subscribe=not drivers, **options)
    tilt.pass_motors, correction.pass_change = correction.take_motors, tilt.begin_checks
    nodes = [process, tilt, correction]
    if control:
        nodes.append(_controller(tilt, correction, options))
    if drivers:
        nodes.append(Mpu6050Node(registers, correction.take_imu, **options))
        nodes.append(EncoderNode(counters, correction.take_joints, **options))
    return nodes


def _controller(tilt: FilterNode, correction: CorrectionNode, options: dict[str, Any]) -> Node:
    """Return a controller that gets what the two publish; its errors stay its own."""
    from .controller_node import ControllerNode  # with all controllers, which few processes need

    node = ControllerNode(subscribe=False, **options)
    tilt.pass_estimate = node.guarded("tilt", node.take_estimate)
    tilt.pass_valid = node.guarded("tilt/valid", node.take_valid)
    correction.pass_wheels = node.guarded("joint_states", node.take_wheels)
    return node


def main(arguments: list[str] | None = None) -> int:
    """Run the nodes until they are asked to stop."""
    never_wait()
    return run(compose, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
