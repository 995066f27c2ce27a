"""A whole robot as processes, what can be done to them, and a client that counts what comes out.

Tilts and commands are noted in the order in which the client gets them: what a controller does
after the last good tilt is counted in commands, whatever the load of the machine.
"""

from __future__ import annotations

import contextlib
import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, Float64MultiArray
from std_srvs.srv import Trigger

from twbr_estimation.ros_messages import tilt_of_quaternion
from twbr_estimation.streams.messages import decode_float64s, decode_imu

PROGRAM = "import sys; from twbr_estimation.nodes.{0} import main; sys.exit(main())"
PARAMETERS: dict[str, dict[str, object]] = {
    "simulator_node": {"world": "W1", "imu_period": 0.005, "start_tilt": 0.03},
    "correction_node": {},
    "filter_node": {},
    "controller_node": {"prepare_all": False},
}
"""The nodes of a robot; `PARAMETERS[node]` are those that differ from the defaults."""
UPRIGHT = 0.2
"""Largest tilt of a robot that balances [rad]."""

ANSWER = 3.0
"""Time that an answer may take before the request is repeated [s]."""
RECOVERY = 0.1
"""`recovery_tilt` of the controller [rad]."""


class Outcome(NamedTuple):
    """What the client saw of one cause."""

    driving: int
    """Commands that drive and came after the last tilt; those in flight with it are some."""
    zeros: int
    """Commands of zeros after the last tilt."""
    last_drive: float
    """From the last tilt to the last command that drives [s]; minus infinity without one."""
    first_zero: float
    """From the last tilt to the first command of zeros [s]; infinity without one."""


class LiveRobot:
    """Processes of nodes, and the client."""

    def __init__(self, graph: Any) -> None:
        """Listen; `start` begins the processes."""
        self.graph = graph
        self.running: dict[str, subprocess.Popen[bytes]] = {}
        self.tilts: list[tuple[float, float]] = []
        """When a tilt came [s], and how much it was [rad]."""
        self.commands: list[tuple[float, bool, int]] = []
        """When a command came [s], whether it drives, and how many tilts had come before."""
        probe = graph.probe
        probe.create_subscription(Imu, "imu/data", self._on_tilt, 1000, raw=True)
        probe.create_subscription(
            Float64MultiArray, "motor/command", self._on_command, 1000, raw=True
        )
        self.valid = probe.create_publisher(Bool, "tilt/valid", 10)
        self._standing = probe.create_client(Trigger, "simulator_node/stand_up")

    def _on_tilt(self, data: bytes) -> None:
        tilt = float(tilt_of_quaternion(*decode_imu(data)[1][:4]))
        self.tilts.append((time.monotonic(), tilt))

    def _on_command(self, data: bytes) -> None:
        self.commands.append((time.monotonic(), any(decode_float64s(data)), len(self.tilts)))

    def start(self, *nodes: str) -> None:
        """Start the processes of these nodes."""
        for node in nodes:
            given = [f"{name}:={value}" for name, value in PARAMETERS[node].items()]
            command = [sys.executable, "-c", PROGRAM.format(node), "--ros-args"]
            command += ["--log-level", "fatal"]
            for each in given:
                command += ["-p", each]
            self.running[node] = subprocess.Popen(command, stderr=subprocess.DEVNULL)

    def send(self, node: str, number: signal.Signals) -> None:
        """Send a signal to a node's process; SIGKILL is waited for."""
        self.running[node].send_signal(number)
        if number is signal.SIGKILL:
            self.running.pop(node).wait(10.0)

    def close(self) -> None:
        """End all processes."""
        for process in self.running.values():
            process.kill()
        for process in self.running.values():
            process.wait(10.0)

    def spin(self, seconds: float) -> None:
        """Let messages come for this long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.graph.executor.spin_once(timeout_sec=0.01)

    def balances(self) -> bool:
        """Whether it has been driven and upright for the last 50 commands and tilts."""
        driven = self.commands[-50:]
        upright = all(abs(tilt) < UPRIGHT for _, tilt in self.tilts[-50:])
        return len(driven) == 50 and all(each[1] for each in driven) and upright

    def wait_for(self, condition: Callable[[], bool], limit: float = 60.0) -> float:
        """Spin until the condition holds; return how long that took [s].

        Raises:
            TimeoutError: it does not.
        """
        begin = time.monotonic()
        while not condition():
            if time.monotonic() > begin + limit:
                raise TimeoutError(f"condition not met within {limit:g} s")
            self.graph.executor.spin_once(timeout_sec=0.01)
        return time.monotonic() - begin

    def balance(self, attempts: int = 20) -> int:
        """Stand the robot up until it balances; return how often that took.

        A machine with other work can let the robot fall, which runs in real time.

        Raises:
            TimeoutError: it does not.
        """
        for attempt in range(attempts):
            self.stand_up()
            with contextlib.suppress(TimeoutError):
                self.wait_for(self.balances, 3.0)
                return attempt + 1
        raise TimeoutError(f"stood up {attempts} times, it has not balanced")

    def stand_up(self, attempts: int = 20) -> None:
        """Stand the simulated robot up; a request to a killed simulator is never answered.

        Raises:
            TimeoutError: no node answers.
        """
        for _ in range(attempts):
            future = self._standing.call_async(Trigger.Request())
            with contextlib.suppress(TimeoutError):
                self.wait_for(future.done, ANSWER)
                return
            self._standing.remove_pending_request(future)
        raise TimeoutError(f"asked {attempts} times, simulator_node has not answered")

    def silenced(self, node: str, number: signal.Signals, wait: float = 1.0) -> Outcome:
        """Kill or stop a node upstream of the controller; return what came out of it."""
        self.send(node, number)
        self.spin(wait)
        last, count = self.tilts[-1][0], len(self.tilts)
        after = [(at - last, drives) for at, drives, tilts in self.commands if tilts >= count]
        driven = [at for at, drives in after if drives]
        zeros = [at for at, drives in after if not drives]
        return Outcome(
            len(driven),
            len(zeros),
            max(driven, default=-math.inf),
            min(zeros, default=math.inf),
        )

    def recovered(self, node: str, number: signal.Signals) -> tuple[int, int]:
        """Undo `silenced`, and stand the robot up where it has fallen.

        Returns:
            Commands that drive before it was near upright, and how often that took.
        """
        before = len(self.commands)
        if number is signal.SIGSTOP:
            self.send(node, signal.SIGCONT)
        else:
            self.start(node)
        early = 0
        if (node, number) != ("simulator_node", signal.SIGKILL):  # a new robot stands by itself
            known = len(self.tilts)
            self.wait_for(lambda: len(self.tilts) > known + 100)
            early = self._driven_while_down(before)
        return early, self.balance()

    def _driven_while_down(self, first: int) -> int:
        """Return how many commands from the first one drive before the robot is near upright."""
        count = 0
        for _, drives, tilts in self.commands[first:]:
            if abs(self.tilts[tilts - 1][1]) < RECOVERY:
                break
            count += drives
        return count


@contextlib.contextmanager
def live_robot(graph: Any) -> Iterator[LiveRobot]:
    """Yield a robot that balances; end its processes afterwards."""
    robot = LiveRobot(graph)
    try:
        robot.start(*PARAMETERS)
        robot.wait_for(lambda: bool(robot.commands and robot.tilts))
        robot.balance()
        yield robot
    finally:
        robot.close()
