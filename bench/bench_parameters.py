"""Measure how much later samples come at 1 kHz because a parameter of a node is set.

A process gets samples all the while. In one window of a pair a client sets a parameter, in the
other it does not; which comes first is random. The request goes out immediately before a sample,
which therefore waits for its end; this sample and the next are compared with those at the same
place of the other window, so that what else the machine does falls on both. A relay with the same
parameters, of rclpy alone, shows what rclpy itself takes, and what the request costs this process.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import time
from typing import Any, NamedTuple

import numpy as np
import rclpy
from bench_live import OURS, QOS, Probe, Subject, quiet_domain
from live_subject import PARAMETERS
from numpy.typing import NDArray
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rows import row

RATE = 1000.0
WINDOW = 0.2
"""Time between two windows' beginnings [s]; a request comes in the middle of one."""
CONCERNED = 5
"""Samples from a request on that are compared."""
SHARES = (10, 50, 99, 100)
"""Percentiles that are shown: the first is what the machine's other work touches least."""
LIMIT = 1000.0
"""Required of each sample [us]."""
RAW_INPUT = ["--ros-args", "-r", "imu/data_corrected:=imu/data_raw", *QOS]
RELAY = "relay of rclpy alone"
SUBJECTS = {
    RELAY: ("relay", [], "relay"),
    "filter_node": ("filter_node", RAW_INPUT, "filter_node"),
    "correction + filter": ("ours", OURS, "filter_node"),
}
"""Name and arguments of a subject, and the node whose parameters are set."""


class Setter:
    """A client that sets the parameters of a node in turns, each to a value it has not now."""

    def __init__(self, probe: Probe, node: str) -> None:
        self._probe, self._count = probe, 0
        self._client = probe.node.create_client(SetParameters, f"/{node}/set_parameters")
        self._answers: list[Any] = []

    def wait(self) -> None:
        """Wait until the node is there."""
        self._probe.spin_until(self._client.service_is_ready)

    def send(self, name: str | None = None) -> None:
        """Ask for a change of a parameter, by default of the next one."""
        turn, self._count = self._count, self._count + 1
        name = name or list(PARAMETERS)[turn % len(PARAMETERS)]
        value = PARAMETERS[name] * (1.0 + 0.01 * (turn % 7))
        typed = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        request = SetParameters.Request(parameters=[Parameter(name=name, value=typed)])
        self._answers.append(self._client.call_async(request))

    def settle(self) -> None:
        """Wait for the answers.

        Raises:
            RuntimeError: one is missing, or a request was refused.
        """
        self._probe.spin_until(lambda: all(each.done() for each in self._answers))
        for answer in self._answers:
            if not answer.done() or not answer.result().results[0].successful:
                raise RuntimeError(f"not set: {answer.result()}")
        self._answers.clear()

    def close(self) -> None:
        """Remove the client."""
        self._probe.node.destroy_client(self._client)


class Pairs(NamedTuple):
    """Latencies of the samples concerned [us], (pairs, CONCERNED), and the cost of a request."""

    meanwhile: NDArray[np.float64]
    """While a parameter is set."""
    usual: NDArray[np.float64]
    """In the window without a request."""
    cpu: dict[str, float]
    """CPU time of the process for one request without samples [us], by parameter."""

    def added(self) -> NDArray[np.float64]:
        """Return by how much the latest sample of each pair comes later with a request [us]."""
        later: NDArray[np.float64] = self.meanwhile.max(axis=1) - self.usual.max(axis=1)
        return later


def cpu_time(process: int) -> float:
    """Return the CPU time of a process [us], by the clock that Linux has for each."""
    return time.clock_gettime_ns(~process << 3 | 2) * 1e-3


def cost_of_requests(setter: Setter, process: int, count: int) -> dict[str, float]:
    """Return the CPU time that a process takes for one request of each parameter [us]."""
    found = {}
    for name in (*PARAMETERS, *PARAMETERS):  # the second time nothing else begins any more
        before = cpu_time(process)
        for _ in range(count):
            setter.send(name)
            setter.settle()
        found[name] = (cpu_time(process) - before) / count
    return found


def window(probe: Probe, setter: Setter | None) -> NDArray[np.float64] | None:
    """Return the latencies of the samples concerned [us]; None where one was lost."""
    probe.heard.clear()
    sent = probe.drive(RATE, WINDOW, setter.send if setter else lambda: None)
    probe.spin_until(lambda: len(probe.heard) >= sent.size, 3.0)
    if len(probe.heard) != sent.size:
        return None
    middle = sent.size // 2
    latency: NDArray[np.float64] = (np.array(probe.heard) - sent) * 1e-3
    return latency[middle : middle + CONCERNED]


def measure(probe: Probe, subject: str, count: int) -> Pairs:
    """Run one subject over so many pairs of windows."""
    name, arguments, node = SUBJECTS[subject]
    process, setter = Subject(name, arguments), Setter(probe, node)
    meanwhile, usual = [], []
    try:
        setter.wait()
        cpu = cost_of_requests(setter, process.process.pid, count)
        probe.shake_hands()
        for _ in range(count):
            found = {}
            for setting in random.sample((True, False), 2):
                found[setting] = window(probe, setter if setting else None)
                setter.settle()
            if found[True] is not None and found[False] is not None:
                meanwhile.append(found[True])
                usual.append(found[False])
    finally:
        process.stop()
        setter.close()
        probe.spin_until(lambda: not probe.imu.get_subscription_count(), 5.0)
    return Pairs(np.array(meanwhile), np.array(usual), cpu)


def show(subject: str, pairs: Pairs, floor: Pairs) -> None:
    """Print what was found of one subject, beside the relay."""
    print(f"{subject}, {len(pairs.usual)} pairs; the latest of {CONCERNED} samples")
    for title, latency in (("with a request", pairs.meanwhile), ("without", pairs.usual)):
        found = np.percentile(latency.max(axis=1), SHARES)
        shown = ", ".join(f"p{p} {each:.0f}" for p, each in zip(SHARES, found, strict=True))
        print(f"  {title:16}{shown} us")
    added = pairs.added()
    low, middle, high = np.percentile(added, [25, 50, 75])
    print(f"  later with a request by {middle:.0f} us (quartiles {low:.0f} and {high:.0f}),")
    later, earlier = np.sum(added > LIMIT), np.sum(added < -LIMIT)
    print(f"  by more than {LIMIT:g} us in {later} pairs; earlier by more than that in {earlier}")
    for name, cpu in pairs.cpu.items():
        ratio = cpu / floor.cpu[name]
        print(f"  CPU of a request, {name:28}{cpu:6.0f} us, {ratio:.2f} of the relay's")


def report(subject: str, pairs: Pairs, floor: Pairs) -> None:
    """Print the row of one subject."""
    beyond = max(cpu - floor.cpu[name] for name, cpu in pairs.cpu.items())
    row(
        f"a parameter of {subject} set at 1 kHz: latest sample later by (p10, median)",
        f"{_least(pairs):.0f} us, {np.median(pairs.added()):.0f} us ({RELAY}: "
        f"{_least(floor):.0f} us, {np.median(floor.added()):.0f} us); "
        f"CPU beyond it {beyond:.0f} us",
        f"{LIMIT:g} us",
    )


def _least(pairs: Pairs) -> float:
    """Return how much later the latest sample comes where the machine disturbs least [us]."""
    tenth = [np.percentile(each.max(axis=1), SHARES[0]) for each in (pairs.meanwhile, pairs.usual)]
    return float(tenth[0] - tenth[1])


def main(arguments: list[str] | None = None) -> int:
    """Measure every subject in turns and print the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=2, help="turns of each subject")
    parser.add_argument("--pairs", type=int, default=50, help="pairs of windows in a turn")
    chosen: Any = parser.parse_args(arguments)
    os.environ["ROS_DOMAIN_ID"] = str(quiet_domain())
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    rclpy.init()
    probe = Probe()
    turns: dict[str, list[Pairs]] = {subject: [] for subject in SUBJECTS}
    for _ in range(chosen.rounds):
        for subject, found in turns.items():
            found.append(measure(probe, subject, chosen.pairs))
    merged = {subject: _merged(found) for subject, found in turns.items()}
    floor = merged[RELAY]
    for subject, pairs in merged.items():
        show(subject, pairs, floor)
        if subject != RELAY:
            report(subject, pairs, floor)
    probe.node.destroy_node()
    rclpy.try_shutdown()
    return 0


def _merged(turns: list[Pairs]) -> Pairs:
    return Pairs(
        np.concatenate([each.meanwhile for each in turns]),
        np.concatenate([each.usual for each in turns]),
        {name: float(np.median([each.cpu[name] for each in turns])) for name in PARAMETERS},
    )


if __name__ == "__main__":
    sys.exit(main())
