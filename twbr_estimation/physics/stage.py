"""Parts of every scene: balancing, falling, hands that lift the robot and put it down.

A script is a generator: it yields one `Order` a control period, and may change friction, push
and take hold in between. Times are in seconds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..controllers.steering import clamped
from .balance import CONTROL_PERIOD, FALLEN, Balance
from .engine import Engine, Pose
from .events import LYING, Diary
from .hand import Reach, added, swaying, way

STOPPED = (0.0, 0.0)
ACCELERATION, YAW_ACCELERATION = 1.0, 15.0
"""Rates of change of commanded speed and yaw rate [m/s^2], [rad/s^2]."""
ROOM = 0.06
"""Height by which a fallen robot is lifted while it is stood up [m]."""


class Order(NamedTuple):
    """Forces and commands of one control period."""

    voltages: tuple[float, float] | None = None
    """Of left and right motor [V]; None lets the balance controller choose."""
    speed: float = 0.0
    """Commanded to the controller [m/s]."""
    yaw_rate: float = 0.0
    """Commanded to the controller [rad/s]."""
    grip: Pose | None = None
    """Pose of the hand at the end of the period."""


Script = Iterator[Order]


class Stage:
    """The robot, what is written down of it, and the scene's random draw."""

    def __init__(self, engine: Engine, balance: Balance, random: np.random.Generator) -> None:
        """Begin at time 0."""
        self.engine, self.balance, self.random = engine, balance, random
        self.diary = Diary()
        self.periods = 0
        self.falls = 0
        self._speed = self._yaw_rate = 0.0
        self._lies = False
        self.stays_down = False
        """Whether a robot that falls while it balances is left lying."""
        self.height = engine.pose()[2]
        """Of the axle above the ground [m]."""
        self.home: tuple[float, float] | None = None
        """Position at which a fallen robot is stood up again [m]; None for its present one."""

    @property
    def stamp(self) -> int:
        """Time since the start [ns]."""
        return self.periods * round(CONTROL_PERIOD * 1e9)

    def mark(self, name: str, present: bool) -> None:
        """Write down that something begins or ends."""
        self.diary.mark(name, present, self.stamp)

    def between(self, low: float, high: float) -> float:
        """Draw a number."""
        return float(self.random.uniform(low, high))

    def side(self) -> float:
        """Draw 1 or -1."""
        return float(self.random.choice([-1.0, 1.0]))

    @property
    def fallen(self) -> bool:
        """Whether the robot leans too far to be balanced."""
        now = self.engine.moving()
        return abs(now.tilt) > FALLEN or abs(now.roll) > FALLEN

    def balanced(
        self,
        seconds: float,
        speed: float = 0.0,
        yaw_rate: float = 0.0,
        acceleration: float = ACCELERATION,
    ) -> Script:
        """Balance; a robot that falls is left lying for a while and stood up.

        Args:
            seconds: how long.
            speed: to reach and keep [m/s].
            yaw_rate: to reach and keep [rad/s].
            acceleration: of the commanded speed [m/s^2].
        """
        change, turn = acceleration * CONTROL_PERIOD, YAW_ACCELERATION * CONTROL_PERIOD
        for _ in range(count(seconds)):
            if self.fallen and not self.stays_down:
                yield from self.lain(self.between(1.0, 2.0))
                yield from self.stood_up()
            self._speed += clamped(speed - self._speed, -change, change)
            self._yaw_rate += clamped(yaw_rate - self._yaw_rate, -turn, turn)
            yield Order(speed=self._speed, yaw_rate=self._yaw_rate)

    def driven(self, seconds: float, voltage: float, name: str) -> Script:
        """Give both motors a voltage, whatever comes of it; `name` is that of the event."""
        self.mark(name, True)
        for _ in range(count(seconds)):
            yield Order(voltages=(voltage, voltage))
        self.mark(name, False)

    def pushed(self, force: float, seconds: float, left: float = 0.0) -> Script:
        """Balance against a half sine of a force [N], forward and to the left."""
        steps = count(seconds)
        for i in range(steps):
            share = math.sin(math.pi * (i + 0.5) / steps)
            self.engine.push(share * force, share * left)
            yield Order(voltages=STOPPED if self.fallen else None)
        self.engine.push(0.0)

    def lain(self, seconds: float) -> Script:
        """Apply nothing to a robot that falls or has fallen, its motors shorted."""
        self.falls += 1
        for _ in range(count(seconds)):
            yield Order(voltages=STOPPED)

    def stood_up(self) -> Script:
        """Take the robot, stand it upright and let go."""
        x, y, _, heading, roll, tilt = self.taken()
        if self.home is not None:
            x, y = self.home
        over = (x, y, self.height + ROOM, heading, 0.5 * roll, 0.5 * tilt)
        yield from self.moved("held", over, self.between(0.5, 0.8))
        yield from self.put_down("held", (x, y), heading)

    def taken(self) -> Pose:
        """Let the hand take hold; return where."""
        self.engine.grasp()
        return self.engine.pose()

    def moved(
        self,
        name: str,
        end: Pose,
        seconds: float,
        reach: Reach | None = None,
        voltages: tuple[float, float] | None = STOPPED,
    ) -> Script:
        """Move the robot by hand.

        Args:
            name: of the event.
            end: where to.
            seconds: how long.
            reach: how the hand sways.
            voltages: of the motors; None leaves the balance controller on.
        """
        begin, steps = self.engine.grip, count(seconds)
        assert begin is not None, "the hand holds nothing"
        sway = swaying(reach or Reach(), seconds, self.random)
        self.mark(name, True)
        for i in range(1, steps + 1):
            pose = way(begin, end, i / steps)
            yield Order(voltages, grip=added(pose, sway(i * CONTROL_PERIOD)) if reach else pose)
        self.mark(name, False)

    def put_down(
        self, name: str, at: tuple[float, float], heading: float, seconds: float = 0.7
    ) -> Script:
        """Put the robot down upright, let go and begin to balance."""
        pose = (*at, self.height, heading, 0.0, 0.0)
        yield from self.moved(name, pose, seconds)
        yield from self.moved(name, pose, 0.3)
        self.let_go()

    def let_go(self) -> None:
        """Let the hand go and begin to balance."""
        self.engine.release()
        self.balance.begin()
        self._speed = self._yaw_rate = 0.0

    def watch(self) -> None:
        """Record a fall, from the first contact with the ground."""
        loose = self.fallen and self.engine.grip is None
        self._lies = loose and (self._lies or self.engine.touches())
        self.mark(LYING, self._lies)


def count(seconds: float) -> int:
    """Return a time in control periods, one at least."""
    return max(round(seconds / CONTROL_PERIOD), 1)
