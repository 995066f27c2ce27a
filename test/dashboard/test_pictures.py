"""The stream of pictures: it goes on whatever the source or a browser does."""

from __future__ import annotations

import asyncio
import json
import math
from typing import Any

import pytest

from twbr_estimation.dashboard.pictures import EMPTY, Pictures, text_of
from twbr_estimation.dashboard.telemetry import ACTIVE, Telemetry


class Robot:
    """A source that fails on request."""

    name = "robot"
    on_request = ("raw", "corrected")

    def __init__(self) -> None:
        self.telemetry, self.looked_at, self.fails = Telemetry(), False, False
        self.is_silent, self.silent_polls = False, 0
        self.wanted: list[str] = []
        self.commands: list[tuple[float, float]] = []
        self._stamp, self.failures = 0, 0

    def open(self) -> None:
        self.looked_at = True

    def close(self) -> None:
        self.looked_at = False

    def want(self, traces: Any) -> None:
        self.wanted = sorted(traces)

    def poll(self) -> None:
        if self.fails:
            self.failures += 1
            raise RuntimeError("a defect")
        if self.is_silent:
            self.silent_polls += 1
            return
        self._stamp += 33_000_000
        self.telemetry.add_estimate(ACTIVE, self._stamp, 0.1)

    def drive(self, speed: float, yaw_rate: float) -> None:
        self.commands.append((speed, yaw_rate))


class Socket:
    """A browser's end of the stream."""

    def __init__(self) -> None:
        self.pictures: list[dict[str, Any]] = []
        self.said: asyncio.Queue[str] = asyncio.Queue()
        self.takes = True

    async def accept(self) -> None:
        pass

    async def send_text(self, text: str) -> None:
        while not self.takes:
            await asyncio.sleep(0.01)
        self.pictures.append(json.loads(text))

    async def receive_text(self) -> str:
        text = await self.said.get()
        if text == "bye":
            raise ConnectionError
        return text


async def until(condition: Any) -> None:
    for _ in range(3000):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("never true")


def looking(scene: Any, read_only: bool = False) -> None:
    """Run a scene with a robot, a browser that looks, and the stream between them."""

    async def play() -> None:
        robot, socket = Robot(), Socket()
        pictures = Pictures(robot, read_only)  # type: ignore[arg-type]
        serving = asyncio.create_task(pictures.serve(socket))
        await until(lambda: len(socket.pictures) > 1)
        await scene(robot, socket, pictures)
        socket.said.put_nowait("bye")
        await until(serving.done)
        await until(lambda: not robot.looked_at)

    asyncio.run(play())


def test_pictures_come_again_after_a_defect(caplog: pytest.LogCaptureFixture) -> None:
    async def scene(robot: Robot, socket: Socket, pictures: Pictures) -> None:
        robot.fails = True
        await until(lambda: robot.failures > 3)
        robot.fails = False
        count = len(socket.pictures)
        await until(lambda: len(socket.pictures) > count + 3)

    looking(scene)
    assert caplog.text.count("a defect") == 1, "logged once, not 30 times a second"


def test_the_connection_is_seen_to_last_where_nothing_arrives() -> None:
    async def scene(robot: Robot, socket: Socket, pictures: Pictures) -> None:
        robot.is_silent = True
        count = len(socket.pictures)
        await until(lambda: len(socket.pictures) >= count + 3)
        assert socket.pictures[-1]["traces"] == {}
        assert robot.silent_polls >= 2 * EMPTY, "one a second, not 30"

    looking(scene)


def test_a_slow_browser_gets_everything_later_and_delays_no_other() -> None:
    async def scene(robot: Robot, socket: Socket, pictures: Pictures) -> None:
        other = Socket()
        serving = asyncio.create_task(pictures.serve(other))
        await until(lambda: other.pictures)
        socket.takes = False
        count = len(other.pictures)
        await until(lambda: len(other.pictures) > count + 6)
        socket.takes = True
        await until(lambda: max(len(p["traces"].get(ACTIVE, [])) for p in socket.pictures) >= 4)
        times = [time for p in socket.pictures[1:] for time, _ in p["traces"][ACTIVE]]
        assert times == sorted(times)
        other.said.put_nowait("bye")
        await until(serving.done)
        assert robot.looked_at, "one browser still looks"

    looking(scene)


def test_a_browser_that_leaves_or_falls_silent_stops_the_robot() -> None:
    async def scene(robot: Robot, socket: Socket, pictures: Pictures) -> None:
        socket.said.put_nowait('{"drive": [1, 0]}')
        await until(lambda: len(robot.commands) == 2)
        assert robot.commands[1] == (0.0, 0.0)
        other = Socket()
        serving = asyncio.create_task(pictures.serve(other))
        other.said.put_nowait('{"drive": [1, 0]}')
        other.said.put_nowait("bye")
        await until(serving.done)
        assert robot.commands[-1] == (0.0, 0.0)

    looking(scene)


def test_a_page_that_only_shows_drives_nothing() -> None:
    async def scene(robot: Robot, socket: Socket, pictures: Pictures) -> None:
        socket.said.put_nowait('{"drive": [1, 0]}')
        socket.said.put_nowait('{"show": ["raw"]}')
        await until(lambda: robot.wanted == ["raw"])  # what was sent before it has been read
        assert robot.commands == []

    looking(scene, read_only=True)


def test_a_source_draws_what_any_browser_asks_for() -> None:
    async def scene(robot: Robot, socket: Socket, pictures: Pictures) -> None:
        socket.said.put_nowait('{"show": ["raw", "unknown", 3]}')
        await until(lambda: robot.wanted == ["raw"])
        other = Socket()
        serving = asyncio.create_task(pictures.serve(other))
        other.said.put_nowait('{"show": ["corrected"]}')
        await until(lambda: robot.wanted == ["corrected", "raw"])
        other.said.put_nowait("bye")
        await until(serving.done)
        assert robot.wanted == ["raw"]
        for wrong in ("7", '{"show": 3}', "{", '{"show": null}'):
            socket.said.put_nowait(wrong)
        socket.said.put_nowait('{"show": []}')
        await until(lambda: robot.wanted == [])

    looking(scene)


def test_what_is_not_finite_is_null() -> None:
    frame = {"traces": {"a": [[0.0, math.nan]]}, "pose": {"tilt": math.inf}, "errors": ()}
    assert json.loads(text_of(frame)) == {
        "traces": {"a": [[0.0, None]]},
        "pose": {"tilt": None},
        "errors": [],
    }
