"""Velocity commands of browsers, and what ends them."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from twbr_estimation.dashboard.driving import HOLD, SPEED, YAW_RATE, Driver


class Clock:
    """Calls what is due when time is let pass."""

    def __init__(self) -> None:
        self.now, self._calls = 0.0, list[tuple[float, Callable[[], None]]]()

    def call_later(self, delay: float, call: Callable[[], None]) -> Clock.Call:
        entry = (self.now + delay, call)
        self._calls.append(entry)
        return self.Call(self, entry)

    class Call:
        def __init__(self, clock: Clock, entry: tuple[float, Callable[[], None]]) -> None:
            self._clock, self._entry = clock, entry

        def cancel(self) -> None:
            if self._entry in self._clock._calls:
                self._clock._calls.remove(self._entry)

    def wait(self, seconds: float) -> None:
        self.now += seconds
        for due, call in list(self._calls):
            if due <= self.now:
                self._calls.remove((due, call))
                call()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def commands() -> list[tuple[float, float]]:
    return []


@pytest.fixture
def driver(clock: Clock, commands: list[tuple[float, float]]) -> Driver:
    return Driver(lambda *command: commands.append(command), clock.call_later)


def drive(forward: float, left: float = 0.0) -> list[float]:
    return [forward, left]


def test_a_command_lasts_while_it_is_repeated(
    driver: Driver, clock: Clock, commands: list[tuple[float, float]]
) -> None:
    for _ in range(20):
        driver.take("phone", drive(1.0))
        clock.wait(0.5 * HOLD)
    assert set(commands) == {(SPEED, 0.0)} and driver.moving
    clock.wait(0.6 * HOLD)
    assert commands[-1] == (0.0, 0.0) and not driver.moving
    count = len(commands)
    clock.wait(10.0 * HOLD)
    assert len(commands) == count, "a robot that stands is left to others"


def test_a_browser_that_leaves_stops_the_robot_at_once(
    driver: Driver, commands: list[tuple[float, float]]
) -> None:
    driver.take("phone", drive(0.5, -1.0))
    driver.leave("laptop")
    assert commands == [(0.5 * SPEED, -YAW_RATE)], "another browser has left"
    driver.leave("phone")
    assert commands[-1] == (0.0, 0.0)
    driver.leave("phone")
    assert len(commands) == 2


def test_a_command_to_stand_still_is_passed_on_at_once(
    driver: Driver, clock: Clock, commands: list[tuple[float, float]]
) -> None:
    driver.take("phone", drive(1.0))
    driver.take("phone", drive(0.0))
    assert commands == [(SPEED, 0.0), (0.0, 0.0)]
    clock.wait(2.0 * HOLD)
    assert len(commands) == 2


def test_commands_are_kept_within_their_limits(
    driver: Driver, commands: list[tuple[float, float]]
) -> None:
    driver.take("phone", drive(1e9, -1e9))
    assert commands == [(SPEED, -YAW_RATE)]


@pytest.mark.parametrize(
    "shares",
    [None, 3, "drive", [], [1], [1, "x"], [math.nan, 0], [math.inf, 0], [1, 2, 3], [10**400, 0],
     {"x": 1}, [[1], [2]]],
)  # fmt: skip
def test_what_is_no_command_is_ignored(
    driver: Driver, commands: list[tuple[float, float]], shares: object
) -> None:
    driver.take("phone", shares)
    assert commands == []
