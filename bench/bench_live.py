"""Measure the live system beside a bare relay node, in turns and in one run, as ratios.

Latency is the time from publishing a raw sample to hearing its tilt; CPU time, memory and
start are those of the measured process. Every message is counted. The machine should be
quiet: p99 and the maximum are its own as much as ours.
"""

from __future__ import annotations

import argparse
import os
import random
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

try:
    import rclpy
except ImportError:
    print("live system: no ROS 2 here, so there is nothing to measure")
    sys.exit(0)

from rows import row
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from twbr_estimation import simulate
from twbr_estimation.live_code.files import CORRECTION
from twbr_estimation.live_code.loading import loaded
from twbr_estimation.nodes.spin import make_executor
from twbr_estimation.streams.messages import JointStateEncoder, RawImuEncoder

HERE = Path(__file__).parent
SUBJECT = HERE / "live_subject.py"
DEPTH = 1000
"""Messages a queue holds, the relay's too: a second in which others have the machine."""
QOS = [
    argument
    for topic in ("imu/data_raw", "joint_states")
    for policy in ("reliability:=reliable", f"depth:={DEPTH}")
    for argument in ("-p", f"qos_overrides./{topic}.subscription.{policy}")
]
for topic in ("tilt", "imu/data", "tilt/compare"):
    QOS += ["-p", f"qos_overrides./{topic}.publisher.depth:={DEPTH}"]
OURS = ["--ros-args", "-p", "drivers:=false", *QOS]
ALL_FILTERS = [*OURS, "-p", "compare:=[all]"]
INTERPRETED = [*OURS, "-p", "machine_code:=false"]
ALONE, BESIDE = "correction + filter", "  all filters beside it"
REQUIRED = {500.0: "1 / 1.1 / 1", 1000.0: "1 / 1.2 / 1"}
"""Of correction and filter in one process: p50, p99 and CPU over those of the bare relay."""
WARM_UP = 0.3
DRIVEN, PERIOD = 20.0, 1_000_000
"""Length [s] of the simulated drive whose sensors are published in turn, and its period [ns]."""
PREPARED = (CORRECTION, "ins_odometer")


def quiet_domain() -> int:
    """Return a ROS domain that nobody on this machine uses."""
    while True:
        domain = random.randint(1, 101)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as discovery:
            try:
                discovery.bind(("", 7400 + 250 * domain))
            except OSError:
                continue
            return domain


class Figures(NamedTuple):
    """One run of one subject."""

    p50: float
    """Median latency [us]."""
    p99: float
    cpu: float
    """User and system time for each sample that came back [us]."""
    lost: int
    grown: float
    """Memory at the end minus memory in the middle [kB]."""


class Subject:
    """A measured process."""

    def __init__(self, name: str, arguments: list[str]) -> None:
        began = time.perf_counter()
        self.process = subprocess.Popen(
            [sys.executable, str(SUBJECT), name, *arguments],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONDONTWRITEBYTECODE": ""},  # modules are translated once
        )
        assert self.process.stdout is not None
        self.process.stdout.readline()
        self.start = time.perf_counter() - began
        self.start_cpu = self.cpu_seconds()

    def cpu_seconds(self) -> float:
        """Return user and system time so far [s]."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory(self) -> int:
        """Return the resident memory [kB]."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.partition("VmRSS:")[2].split()[0])

    def stop(self) -> None:
        """End the process."""
        self.process.terminate()
        self.process.wait(10)


class Probe:
    """Publishes sensors at a steady rate and listens to the tilt."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("probe")
        self.executor = make_executor()
        self.executor.add_node(self.node)
        self.imu = self.node.create_publisher(Imu, "imu/data_raw", DEPTH)
        self.joints = self.node.create_publisher(JointState, "joint_states", DEPTH)
        self.heard: list[int] = []
        now, heard = time.perf_counter_ns, self.heard
        listen = self.node.create_subscription
        listen(Float64, "tilt", lambda data: heard.append(now()), DEPTH, raw=True)
        listen(Imu, "imu/data", lambda data: None, DEPTH, raw=True)
        listen(JointState, "tilt/compare", lambda data: None, DEPTH, raw=True)
        self._imu_encoder = RawImuEncoder("imu_link", 0.0, 0.0)
        self._joint_encoder = JointStateEncoder(["left_wheel_joint", "right_wheel_joint"])
        drive = simulate("W2", seed=1, dt=1e-9 * PERIOD, duration=DRIVEN).recording
        assert drive.wheels is not None
        self._sensors = np.hstack([drive.imu.gyro, drive.imu.accel, drive.wheels.angle]).tolist()

    def spin_until(self, condition: Callable[[], bool], limit: float = 30.0) -> None:
        """Spin until the condition holds, or the time is up."""
        end = time.monotonic() + limit
        while not condition() and time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.005)

    def shake_hands(self) -> None:
        """Wait until ten samples in a row came back, and nothing more is on the way."""
        answered = 0
        for _ in range(1000):
            self.heard.clear()
            self.publish(time.time_ns())
            self.spin_until(lambda: bool(self.heard), 0.05)
            answered = answered + 1 if self.heard else 0
            if answered == 10:
                break
        self.spin_until(lambda: False, WARM_UP)
        self.heard.clear()

    def publish(self, stamp: int) -> int:
        """Publish wheels and IMU of one instant; return when the IMU's message left [ns]."""
        sensors = self._sensors[stamp // PERIOD % len(self._sensors)]
        wheel = sensors[6]
        self.joints.publish(self._joint_encoder.encode(stamp, [wheel, wheel], [0.0, 0.0]))
        message = self._imu_encoder.encode(stamp, sensors[:3], sensors[3:6])
        sent = time.perf_counter_ns()
        self.imu.publish(message)
        return sent

    def drive(self, rate: float, duration: float, at_half: Callable[[], None]) -> np.ndarray:
        """Publish for a while; return when each sample left [ns]."""
        count, period = round(rate * duration), 1.0 / rate
        sent = np.zeros(count, dtype=np.int64)
        first = time.time_ns()
        begin = time.perf_counter()
        for index in range(count):
            due = begin + index * period
            while (left := due - time.perf_counter()) > 0.0:
                self.executor.spin_once(timeout_sec=left)
            if index == count // 2:
                at_half()
            sent[index] = self.publish(first + round(index * period * 1e9))
        return sent


def measure(probe: Probe, name: str, arguments: list[str], rate: float, duration: float) -> Figures:
    """Run one subject at one rate."""
    subject = Subject(name, arguments)
    try:
        probe.shake_hands()
        halfway: list[float] = []
        cpu = subject.cpu_seconds()
        sent = probe.drive(rate, duration, lambda: halfway.append(subject.memory()))
        probe.spin_until(lambda: len(probe.heard) >= sent.size, 3.0)
        cpu = (subject.cpu_seconds() - cpu) * 1e6 / max(len(probe.heard), 1)
        lost = sent.size - len(probe.heard)
        latency = (np.array(probe.heard) - sent) * 1e-3 if lost == 0 else np.array([np.nan])
        p50, p99 = np.percentile(latency, [50, 99])
        return Figures(float(p50), float(p99), cpu, lost, subject.memory() - halfway[0])
    finally:
        subject.stop()
        probe.spin_until(lambda: not probe.imu.get_subscription_count(), 5.0)


def compare_running(probe: Probe, rounds: int, duration: float) -> None:
    """Print latency and CPU of each subject, and their ratios to the relay's."""
    subjects = (
        ("bare relay", "relay", []),
        ("bare relay, raw bytes", "raw_relay", []),
        (ALONE, "ours", OURS),
        ("  the same interpreted", "ours", INTERPRETED),
        (BESIDE, "ours", ALL_FILTERS),
    )
    print(f"machine code of {CORRECTION}, ins_odometer: {', '.join(map(prepared, PREPARED))}")
    print(
        f"{'':24}{'p50 us':>9}{'ratio':>7}{'p99 us':>9}{'ratio':>7}{'CPU us':>8}{'ratio':>7}  lost"
    )
    for rate in (500.0, 1000.0):
        found: dict[str, list[Figures]] = {label: [] for label, *_ in subjects}
        for _ in range(rounds):
            for label, name, arguments in subjects:
                found[label].append(measure(probe, name, arguments, rate, duration))
        print(f"{rate:.0f} Hz")
        base = np.nanmedian(np.array(found["bare relay"]), axis=0)
        ratios = {
            label: np.nanmedian(np.array(figures), axis=0)[:3] / base[:3]
            for label, figures in found.items()
        }
        shown = " / ".join(f"{ratio:.2f}" for ratio in ratios[ALONE])
        row(f"correction + filter at {rate:.0f} Hz: p50 / p99 / CPU", shown, REQUIRED[rate])
        row(f"all filters beside it at {rate:.0f} Hz: CPU", f"{ratios[BESIDE][2]:.2f}", "1.5")
        for label, figures in found.items():
            p50, p99, cpu, *_ = np.nanmedian(np.array(figures), axis=0)
            lost = sum(each.lost for each in figures)
            print(
                f"{label:24}{p50:9.0f}{p50 / base[0]:7.2f}{p99:9.0f}{p99 / base[1]:7.2f}"
                f"{cpu:8.0f}{cpu / base[2]:7.2f}{lost:6d}"
            )


def prepared(name: str) -> str:
    """Return whether nodes find machine code for a step, made of the present sources."""
    return "prepared" if loaded(name) else "not prepared"


def compare_starts(rounds: int) -> None:
    """Print start-up time and memory of the filter node beside an empty one and a relay."""
    names = ("empty", "relay", "filter_node")
    found: dict[str, list[tuple[float, float, int]]] = {name: [] for name in names}
    for name in found:
        Subject(name, []).stop()
    for _ in range(rounds):
        for name, figures in found.items():
            subject = Subject(name, [])
            time.sleep(1.0)
            figures.append((subject.start, subject.start_cpu, subject.memory()))
            subject.stop()
    empty, relay, ours = (np.median(np.array(found[name]), axis=0) for name in found)
    units = (("start", "s", 1.0), ("CPU time of the start", "s", 1.0), ("memory", "MB", 1 / 1024))
    for (what, unit, scale), bare, node in zip(units, empty, ours, strict=True):
        print(
            f"{what}: empty node {scale * bare:.3g} {unit}, filter_node {scale * node:.3g} {unit}, "
            f"ratio {node / bare:.2f}"
        )
    shown, least = (
        " / ".join(f"{each:.2f}" for each in (node / empty)[:2]) for node in (ours, relay)
    )
    row(
        "start of filter_node over an empty node: clock / CPU",
        f"{shown}; the relay of rclpy alone {least}",
        "1.2 / 1.3",
    )


def endure(probe: Probe, rate: float, duration: float) -> None:
    """Print losses and the growth of memory of a long run."""
    figures = measure(probe, "ours", OURS, rate, duration)
    print(
        f"{duration:.0f} s at {rate:.0f} Hz through correction and filter: {figures.lost} of "
        f"{round(rate * duration)} samples lost, "
        f"memory grew by {figures.grown:.0f} kB in the second half"
    )


def main(arguments: list[str] | None = None) -> int:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="turns of each subject")
    parser.add_argument("--duration", type=float, default=4.0, help="of one turn [s]")
    parser.add_argument("--only", choices=["running", "starts", "endurance"])
    parser.add_argument("--long", action="store_true", help="also 10 minutes at 500 Hz")
    chosen: Any = parser.parse_args(arguments)
    os.environ["ROS_DOMAIN_ID"] = str(quiet_domain())
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    if chosen.only in (None, "starts"):
        compare_starts(2 * chosen.rounds + 1)
    rclpy.init()
    probe = Probe()
    if chosen.only in (None, "running"):
        compare_running(probe, chosen.rounds, chosen.duration)
    if chosen.only in (None, "endurance"):
        endure(probe, 1000.0, 60.0)
    if chosen.long:
        endure(probe, 500.0, 600.0)
    probe.node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
