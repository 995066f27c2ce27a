"""Close the loop in real time with one process a node, and measure rate, latency and CPU time.

Simulator, correction, filter and controller run as on a robot; this process only listens to
`imu/data` and `motor/command`. The latency is the time from the stamp of the sample that a
command answers to the arrival of the command, the simulator's own delay included. Periods and
latencies hold this process' delays, too. The machine should be quiet.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

try:
    import rclpy
except ImportError:
    print("closed loop: no ROS 2 here, so there is nothing to measure")
    sys.exit(0)

from bench_live import quiet_domain
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, Float64MultiArray

from twbr_estimation.configuration.files import write_section
from twbr_estimation.nodes.spin import make_executor
from twbr_estimation.ros_messages import stamp_of
from twbr_estimation.simulation import world_named
from twbr_estimation.simulation.simulate import setups_of

PERIOD = 5_000_000
"""Of the controller [ns]."""
IMU_PERIOD = 2_500_000
NODES = ("simulator", "correction", "filter", "controller")
DEPTH = 10_000
START = "import sys; from twbr_estimation.nodes.{0}_node import main; sys.exit(main())"


class Process:
    """One node in a process of its own."""

    def __init__(self, name: str, arguments: list[str]) -> None:
        self.name = name
        command = [sys.executable, "-c", START.format(name), "--ros-args", "--log-level", "error"]
        self._process = subprocess.Popen([*command, *arguments])

    def cpu_seconds(self) -> float:
        """Return user and system time so far [s]."""
        fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def stop(self) -> None:
        """End it."""
        self._process.terminate()
        self._process.wait(10)


class Listener:
    """Notes what is published, and when it was received."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("listener")
        self._executor = make_executor()
        self._executor.add_node(self.node)
        self.commands: list[tuple[int, int]] = []
        """Time of arrival, and how many estimates had arrived by then."""
        self.estimates: list[int] = []
        """Stamps [ns]."""
        self.falls = 0
        listen = self.node.create_subscription
        listen(Imu, "imu/data", lambda message: self.estimates.append(stamp_of(message)), DEPTH)
        listen(Float64MultiArray, "motor/command", self._on_command, DEPTH, raw=True)
        listen(Bool, "simulator_node/fallen", self._on_fallen, 10)

    def _on_command(self, data: bytes) -> None:
        del data
        self.commands.append((time.time_ns(), len(self.estimates)))

    def _on_fallen(self, message: Bool) -> None:
        self.falls += message.data

    def listen(self, seconds: float) -> None:
        """Spin for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.1)

    def forget(self) -> None:
        """Begin to count."""
        self.commands.clear()
        self.estimates.clear()
        self.falls = 0


def latencies(listener: Listener) -> np.ndarray:
    """Return from sample to command [ms]: steps fall on every other sample."""
    stamps = np.array(listener.estimates)
    times, heard = np.array([each for each in listener.commands if each[1] > 1]).T
    phases = np.round(stamps / IMU_PERIOD).astype(np.int64) % 2
    of_steps = int(np.median(phases[heard - 1]))
    last = heard - 1 - (phases[heard - 1] != of_steps)
    return (times - stamps[last]) * 1e-6


def start(folder: Path, world: str, name_of_filter: str, compiled: bool) -> list[Process]:
    """Start all nodes; the estimator gets the setup of the world."""
    setup, _ = setups_of(world_named(world), 1)
    write_section(folder / "robot.yaml", setup.robot, {}, replace=True)
    write_section(folder / "calibration.yaml", setup.calibration, {}, replace=True)
    files = [text for name in ("robot", "calibration") for text in
            ("--params-file", str(folder / f"{name}.yaml"))]  # fmt: skip
    simulated = ["-p", f"world:={world}", "-p", f"compiled:={str(compiled).lower()}"]
    arguments = dict.fromkeys(NODES, files) | {"simulator": simulated}
    if name_of_filter:
        arguments["filter"] = [*files, "-p", f"filter:={name_of_filter}"]
    return [Process(name, arguments[name]) for name in NODES]


def report(listener: Listener, cpu: list[float], duration: float) -> None:
    """Print the figures of a run."""
    periods = np.diff([each[0] for each in listener.commands]) * 1e-6
    delay = latencies(listener)
    late = float(np.mean(periods > 2e-6 * PERIOD))
    print(f"commands: {len(listener.commands) / duration:.2f} Hz, wanted {1e9 / PERIOD:.0f} Hz")
    for name, values in (("period", periods), ("sample to command", delay)):
        p50, p99, worst = np.percentile(values, [50, 99, 100])
        print(f"{name}: median {p50:.2f} ms, p99 {p99:.2f} ms, worst {worst:.2f} ms")
    print(f"periods above {2e-6 * PERIOD:g} ms: {100 * late:.2f} %; falls: {listener.falls}")
    shares = ", ".join(
        f"{name} {100 * each / duration:.0f} %" for name, each in zip(NODES, cpu, strict=True)
    )
    print(f"CPU of one core: {shares}; together {100 * sum(cpu) / duration:.0f} %")


def main(arguments: list[str] | None = None) -> int:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=30.0, help="[s]")
    parser.add_argument("--world", default="paper")
    parser.add_argument("--filter", default="", help="default: that of filter_node")
    parser.add_argument("--interpreted", action="store_true", help="do not compile the plant")
    chosen: Any = parser.parse_args(arguments)
    os.environ["ROS_DOMAIN_ID"] = str(quiet_domain())
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    rclpy.init()
    listener, processes = Listener(), []
    try:
        with tempfile.TemporaryDirectory() as folder:
            processes = start(Path(folder), chosen.world, chosen.filter, not chosen.interpreted)
            limit = time.monotonic() + 120.0
            while len(listener.commands) < 400 and time.monotonic() < limit:
                listener.listen(0.5)
            listener.listen(3.0)
        listener.forget()
        began = [each.cpu_seconds() for each in processes]
        load = os.getloadavg()[0]
        listener.listen(chosen.duration)
        cpu = [each.cpu_seconds() - first for each, first in zip(processes, began, strict=True)]
        where = f"{os.cpu_count()} cores, load before {load:.1f}"
        print(f"{chosen.duration:g} s in world {chosen.world}, {where}")
        report(listener, cpu, chosen.duration)
    finally:
        for each in processes:
            each.stop()
        listener.node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
