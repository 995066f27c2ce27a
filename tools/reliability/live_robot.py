"""A whole robot as processes, what can be done to them, and a client that counts what comes out.

What a controller does after the last good tilt is counted in commands, whatever the load of the
machine. What came before what is judged by when it was published: a client that is late takes the
messages of two topics in any order.
"""

from __future__ import annotations

import contextlib
import math
import signal
import subprocess
import sys
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import rclpy
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, Float64MultiArray
from std_srvs.srv import Trigger

from twbr_estimation.ros_messages import tilt_of_quaternion
from twbr_estimation.streams.messages import decode_float64s, decode_imu

PROGRAM = "import sys; from twbr_estimation.nodes.{0} import main; sys.exit(main())"
Parameters = Mapping[str, Mapping[str, object]]
PARAMETERS: Parameters = {
    "simulator_node": {"world": "W1", "imu_period": 0.005, "start_tilt": 0.03},
    "correction_node": {},
    "filter_node": {},
    "controller_node": {"prepare_all": False},
}
"""The nodes of a robot; `PARAMETERS[node]` are those that differ from the defaults."""
UPRIGHT = 0.2
"""Largest tilt of a robot that balances [rad]."""
STEADY = 50
"""Commands and tilts in a row that show it."""

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

    def __init__(
        self, graph: Any, parameters: Parameters = PARAMETERS, steady: int = STEADY
    ) -> None:
        """Listen; `start` begins the processes.

        Args:
            graph: whose context the client's node uses.
            parameters: of each node, those that differ from the defaults.
            steady: commands in a row that drive an upright robot from which on it balances.
        """
        self._parameters, self._steady = parameters, steady
        self.probe = rclpy.create_node("client", context=graph.context)
        # The executor of events gives no callback the stamps of the middleware: a SystemError.
        self._executor = SingleThreadedExecutor(context=graph.context)
        self._executor.add_node(self.probe)
        self.running: dict[str, subprocess.Popen[bytes]] = {}
        self.tilts: list[tuple[float, float]] = []
        """When a tilt came [s], and how much it was [rad]."""
        self.commands: list[tuple[int, bool]] = []
        """When a command was published [ns], and whether it drives."""
        self._published: list[int] = []
        """When each tilt was published [ns]."""
        probe = self.probe
        probe.create_subscription(Imu, "imu/data", self._on_tilt, 1000, raw=True)
        probe.create_subscription(
            Float64MultiArray, "motor/command", self._on_command, 1000, raw=True
        )
        self.valid = probe.create_publisher(Bool, "tilt/valid", 10)
        self._standing = probe.create_client(Trigger, "simulator_node/stand_up")

    def _on_tilt(self, data: bytes, about: Mapping[str, int]) -> None:
        tilt = float(tilt_of_quaternion(*decode_imu(data)[1][:4]))
        self.tilts.append((time.monotonic(), tilt))
        self._published.append(about["source_timestamp"])

    def _on_command(self, data: bytes, about: Mapping[str, int]) -> None:
        self.commands.append((about["source_timestamp"], any(decode_float64s(data))))

    def after_last_tilt(self) -> list[tuple[float, bool]]:
        """Return the commands after the last tilt: how long after [s], and whether it drives."""
        last = self._published[-1]
        return [((at - last) * 1e-9, drives) for at, drives in self.commands if at >= last]

    def start(self, *nodes: str) -> None:
        """Start the processes of these nodes."""
        for node in nodes:
            given = [f"{name}:={value}" for name, value in self._parameters[node].items()]
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
        self._executor.shutdown()
        self.probe.destroy_node()

    def spin(self, seconds: float) -> None:
        """Let messages come for this long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.01)

    def balances(self) -> bool:
        """Whether it has been driven and upright for the last commands and tilts."""
        driven = self.commands[-self._steady :]
        upright = all(abs(tilt) < UPRIGHT for _, tilt in self.tilts[-self._steady :])
        return len(driven) == self._steady and all(each[1] for each in driven) and upright

    def wait_for(self, condition: Callable[[], bool], limit: float = 60.0) -> float:
        """Spin until the condition holds; return how long that took [s].

        Raises:
            TimeoutError: it does not.
        """
        begin = time.monotonic()
        while not condition():
            if time.monotonic() > begin + limit:
                raise TimeoutError(f"condition not met within {limit:g} s")
            self._executor.spin_once(timeout_sec=0.01)
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
        with contextlib.suppress(TimeoutError):  # the controller may be late with its zeros
            self.wait_for(lambda: not all(drives for _, drives in self.after_last_tilt()[-1:]))
        after = self.after_last_tilt()
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
        for at, drives in self.commands[first:]:
            if abs(self.tilts[bisect_left(self._published, at) - 1][1]) < RECOVERY:
                break
            count += drives
        return count


@contextlib.contextmanager
def live_robot(
    graph: Any, parameters: Parameters = PARAMETERS, steady: int = STEADY
) -> Iterator[LiveRobot]:
    """Yield a robot that balances; end its processes afterwards. Arguments as of `LiveRobot`."""
    robot = LiveRobot(graph, parameters, steady)
    try:
        robot.start(*parameters)
        robot.wait_for(lambda: bool(robot.commands and robot.tilts))
        robot.balance()
        yield robot
    finally:
        robot.close()
