"""Two hosts with a cable between them, made of network namespaces.

`python tools/reliability/two_hosts.py CUTS` runs the sensors and the motors of a simulated robot on
one host, all other nodes on the other, pulls the cable, and prints what came of it as JSON. It has
to be started by `unshare -rn`.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import subprocess
import sys
import time
from bisect import bisect_left
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).resolve().parents[up]) for up in (1, 2)]

from sensor_msgs.msg import JointState
from std_msgs.msg import Bool

from reliability.graph import opened_graph
from reliability.live_robot import PARAMETERS, PROGRAM, LiveRobot
from twbr_estimation.ros_messages import tilt_of_quaternion
from twbr_estimation.streams.messages import JointStateDecoder, decode_imu

CUT = 5.0
"""Time without the cable [s]."""
AFTER = 5.0
"""Time that is looked at after it is back [s]."""
WRONG = math.radians(3.0)
CABLE, OTHER_END = "twbr0", "twbr1"
NODES = ("correction_node", "filter_node", "controller_node")
"""On the second host; `simulator_node` is on the first."""


class Seen(NamedTuple):
    """What the second host saw of one cut."""

    silent: float
    """From the cut to the last tilt before the return [s]."""
    driving: int
    """Commands that drive and came after the last tilt."""
    zeros: int
    """Commands of zeros while it was cut."""
    back: float
    """From the cable's return to the next tilt [s]."""
    valid_again: float
    """From the cable's return to the next tilt that is said to be valid [s]."""
    wrong: int
    """Tilts that were said to be valid and are wrong by more than 3 deg."""
    compared: int
    """Tilts after the return that were compared with the reference."""


class SecondHost:
    """A robot's nodes without its sensors and motors, and a client beside them."""

    def __init__(self, graph: Any) -> None:
        """Listen."""
        self.robot = LiveRobot(graph)
        self._valid = False
        self._tilts: list[tuple[float, int, float, bool]] = []
        self._references: list[tuple[int, float]] = []
        self._decoder = JointStateDecoder()
        probe, note = self.robot.probe, self.robot._on_tilt

        def on_tilt(data: bytes, about: Mapping[str, int]) -> None:
            note(data, about)
            stamp, values = decode_imu(data)
            tilt = float(tilt_of_quaternion(*values[:4]))
            self._tilts.append((time.monotonic(), stamp, tilt, self._valid))

        self.robot._on_tilt = on_tilt  # type: ignore[method-assign]
        for each in list(probe.subscriptions):
            if each.topic_name == "/imu/data":
                each.callback = on_tilt
        probe.create_subscription(Bool, "tilt/valid", self._on_valid, 10)
        probe.create_subscription(
            JointState, "reference/joint_states", self._on_reference, 1000, raw=True
        )

    def _on_valid(self, message: Bool) -> None:
        self._valid = message.data

    def _on_reference(self, data: bytes) -> None:
        stamp, _, positions = self._decoder.decode(data)[:3]
        self._references.append((stamp, positions[0]))

    def cut(self, cable: Any) -> Seen:
        """Let the robot balance, pull the cable, and put it back."""
        robot = self.robot
        robot.balance()
        cable.pull()
        pulled = time.monotonic()
        robot.spin(CUT)
        last = len(robot.tilts)
        after = [drives for _, drives in robot.after_last_tilt()]
        self._tilts.clear()
        self._references.clear()
        plugged = time.monotonic()
        cable.plug()
        robot.spin(AFTER)
        valid = [each for each in self._tilts if each[3]]
        return Seen(
            robot.tilts[last - 1][0] - pulled,
            sum(after),
            len(after) - sum(after),
            min((each[0] for each in self._tilts), default=math.inf) - plugged,
            min((each[0] for each in valid), default=math.inf) - plugged,
            *self._compared(valid),
        )

    def _compared(self, valid: list[tuple[float, int, float, bool]]) -> tuple[int, int]:
        known = sorted(self._references)
        wrong = compared = 0
        for _, stamp, tilt, _ in valid:
            at = bisect_left(known, (stamp, -math.inf))
            near = [each for each in known[max(at - 1, 0) : at + 1] if abs(each[0] - stamp) < 10**7]
            if near:
                compared += 1
                wrong += min(abs(each[1] - tilt) for each in near) > WRONG
        return wrong, compared


class Cable:
    """Asks the first host, by this process's output, to pull the cable or to put it back."""

    def pull(self) -> None:
        """Pull it."""
        self._ask("pull")

    def plug(self) -> None:
        """Put it back."""
        self._ask("plug")

    def _ask(self, what: str) -> None:
        print(what, flush=True)
        sys.stdin.readline()


def second_host(cuts: int) -> None:
    """Run the nodes of the second host; print what was seen."""
    with opened_graph() as graph:
        host = SecondHost(graph)
        try:
            host.robot.start(*NODES)
            host.robot.wait_for(lambda: bool(host.robot.commands and host.robot.tilts))
            found = [host.cut(Cable())._asdict() for _ in range(cuts)]
        finally:
            host.robot.close()
    print(json.dumps(found), flush=True)


@contextlib.contextmanager
def two_hosts() -> Iterator[int]:
    """Make this namespace the first host; yield the process in whose namespace the second is."""
    other = subprocess.Popen(["unshare", "-n", "sleep", "infinity"])
    try:
        own = Path("/proc/self/ns/net").readlink()
        namespace = Path(f"/proc/{other.pid}/ns/net")
        while namespace.readlink() == own:
            time.sleep(0.01)
        inside = ["nsenter", "-t", str(other.pid), "-n", "ip"]
        ip("link", "add", CABLE, "type", "veth", "peer", "name", OTHER_END, "netns", str(other.pid))
        for command, name, address in ((["ip"], CABLE, "1"), (inside, OTHER_END, "2")):
            subprocess.run([*command, "link", "set", "lo", "up"], check=True)
            subprocess.run([*command, "addr", "add", f"10.87.3.{address}/24", "dev", name])
            subprocess.run([*command, "link", "set", name, "up"], check=True)
            subprocess.run([*command, "route", "add", "224.0.0.0/4", "dev", name], check=True)
        yield other.pid
    finally:
        other.kill()
        other.wait()


def ip(*arguments: str) -> None:
    """Change the network of the first host."""
    subprocess.run(["ip", *arguments], check=True)


def first_host(cuts: int) -> None:
    """Run the simulator here, the rest there; pull the cable when asked to."""
    with two_hosts() as other:
        given = [f"{name}:={value}" for name, value in PARAMETERS["simulator_node"].items()]
        command = [sys.executable, "-c", PROGRAM.format("simulator_node"), "--ros-args"]
        for each in given:
            command += ["-p", each]
        silence = subprocess.DEVNULL
        simulator = subprocess.Popen(command, stdout=silence, stderr=silence)
        there = subprocess.Popen(
            ["nsenter", "-t", str(other), "-n", sys.executable, __file__, str(cuts), "second"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            _serve(there)
        finally:
            for process in (there, simulator):
                process.kill()
                process.wait()


def _serve(there: Any) -> None:
    for line in there.stdout:
        if line.strip() == "pull":
            ip("link", "set", CABLE, "down")
        elif line.strip() == "plug":
            ip("link", "set", CABLE, "up")
            ip("route", "add", "224.0.0.0/4", "dev", CABLE)
        else:
            print(line, end="", flush=True)
            continue
        there.stdin.write("done\n")
        there.stdin.flush()


if __name__ == "__main__":
    os.environ |= {
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",  # hosts share no memory
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
    }
    (second_host if "second" in sys.argv else first_host)(int(sys.argv[1]))
