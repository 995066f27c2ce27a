"""Serve the page for a robot that is made up: `fake_page.py PORT [read-only|everywhere|two]`."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Collection, Sequence
from typing import Any

from twbr_estimation.dashboard.server import ServerSettings, serve
from twbr_estimation.dashboard.source import (
    ParameterInfo,
    ShownOutcome,
    ShownRobot,
    Source,
    Status,
    StreamRate,
)
from twbr_estimation.dashboard.telemetry import ACTIVE, Telemetry
from twbr_estimation.errors import TwbrError

MARKUP = "<img src=x onerror=alert(1)>"


class RequestError(TwbrError):
    """A node does not answer."""


class FakeRobot(Source):
    """Swings; has one node with a filter, a bounded number, a switch and a list."""

    live = True
    on_request = ("raw",)
    wanted: Sequence[str] = ()

    def __init__(self, name: str = f"fake {MARKUP}") -> None:
        self.name, self.telemetry, self.lost = name, Telemetry(), False
        self.is_open, self.commands, self.changes = False, list[tuple[float, float]](), 0
        self._values: dict[str, Any] = {
            "filter": "kalman",
            "kalman.q1": 0.5,
            "kalman.on": True,
            "kalman.weights": [1.0, 2.0],
            "kalman.frame": "imu_link",
            "complementary.gain": 0.01,
            "compare": [],
        }

    def open(self) -> None:
        self.is_open = True

    def close(self) -> None:
        self.is_open = False

    def want(self, traces: Collection[str]) -> None:
        self.wanted = sorted(traces)

    def poll(self) -> None:
        now = time.time_ns()
        for stamp in range(now - 33_000_000, now, 5_000_000):
            tilt = 0.2 * math.sin(2e-9 * math.pi * (stamp % 10_000_000_000))
            self.telemetry.add_reference(stamp, tilt)
            self.telemetry.add_estimate(ACTIVE, stamp, tilt + 0.01, 0.01**2)

    def geometry(self) -> ShownRobot:
        return ShownRobot()

    def words(self) -> tuple[str, str]:
        driven = [f"driven {speed:g} {turn:g}" for speed, turn in self.commands[-1:]]
        wanted = [f"wanted {' '.join(self.wanted) or 'nothing'}"]
        return "; ".join([f"balancing, filter {self._values['filter']}", *driven, *wanted]), "OK"

    def statuses(self) -> Sequence[Status]:
        return [Status("filter_node", "WARN", MARKUP, {"samples": "1"})]

    def rates(self) -> Sequence[StreamRate]:
        return [StreamRate("imu/data", 200.0, 0.001, 0.1), StreamRate("never", 0.0, math.inf)]

    def nodes(self) -> Sequence[str]:
        return ["mute_node"] if self.lost else ["filter_node", "mute_node"]

    def revision(self, node: str) -> int:
        return self.changes

    async def parameters(self, node: str) -> Sequence[ParameterInfo]:
        if node == "mute_node":
            raise RequestError("mute_node: no answer for 3 s")
        value = self._values
        return [
            ParameterInfo("compare", value["compare"], "names"),
            ParameterInfo("filter", value["filter"], choices=("kalman", "complementary")),
            ParameterInfo("complementary.gain", value["complementary.gain"], "gain [1]", 0.0, 1.0),
            ParameterInfo("kalman.frame", value["kalman.frame"], "name"),
            ParameterInfo("kalman.weights", value["kalman.weights"], "weights"),
            ParameterInfo("kalman.on", value["kalman.on"], MARKUP),
            ParameterInfo("kalman.q1", value["kalman.q1"], "noise [rad]", 0.0, 1.0),
        ]

    async def set_parameter(self, node: str, name: str, value: Any) -> ShownOutcome:
        if name == "kalman.q1" and not 0.0 <= value <= 1.0:
            return ShownOutcome(False, f"{name}: {value} is not within 0 to 1")
        self._values[name] = value
        self.changes += 1
        return ShownOutcome(True, f"{name} is {value}")

    def actions(self) -> Sequence[str]:
        return ("calibrate", "find" if self.lost else "lose")

    async def act(self, action: str) -> ShownOutcome:
        self.lost = action == "lose"
        return ShownOutcome(True, f"{action} done")

    def drive(self, speed: float, yaw_rate: float) -> None:
        self.commands.append((speed, yaw_rate))

    def seek(self, time: float) -> None:
        raise AssertionError("live")

    def position(self) -> float:
        return 0.0

    def duration(self) -> float:
        return 0.0


if __name__ in {"__main__", "__mp_main__"}:
    host = "0.0.0.0" if "everywhere" in sys.argv else "127.0.0.1"
    settings = ServerSettings(host, int(sys.argv[1]), read_only="read-only" in sys.argv)
    robots = [FakeRobot(), FakeRobot("other")] if "two" in sys.argv else [FakeRobot()]
    serve(robots, settings.secured(), lambda at: print(at, flush=True))
