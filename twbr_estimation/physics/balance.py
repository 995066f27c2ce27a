"""The robot's own balance: the project's state feedback on the true state and some noise.

The gains are those of the simulated rig's regulator for the user's robot; a voltage acts one
control period after its command. The noise stands for the error of an estimate: without it a
robot would stand motionless.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..controllers.base import ControlInput
from ..controllers.state_feedback import Gains, State, reset, rolling_voltage, step
from ..robot import Robot
from ..simulation.rig_controller import balance_gains
from .state import Moving

CONTROL_PERIOD = 0.005
"""Of the balance controller, and the delay of its output [s]."""
YAW_GAIN, YAW_RATE_GAIN = 6.0, 0.6
"""Of the heading [V/rad] and of the yaw rate [V s/rad]."""
TILT_NOISE, RATE_NOISE = 0.003, 0.02
"""Standard deviations of what the controller gets [rad], [rad/s]."""
LEAN = 0.006
"""Standard deviation of a constant error of the tilt that it gets [rad]."""
FALLEN = 0.8
"""Tilt beyond which the motors are cut [rad]."""


class Balance:
    """Asks for voltages, one control period after the other."""

    def __init__(self, robot: Robot, random: np.random.Generator) -> None:
        """Compute the gains of the robot; `random` draws the noise."""
        self._lean = LEAN * float(random.standard_normal())
        self._random = random
        self._noise: Iterator[list[float]] = iter(())
        found = balance_gains(robot.plant(), CONTROL_PERIOD)
        self._gains = Gains(
            -found.position,
            -found.velocity,
            -found.tilt,
            -found.rate,
            rolling_voltage(robot),
            -found.voltage,
            YAW_GAIN,
            YAW_RATE_GAIN,
            robot.supply_voltage,
        )
        self._travel = self._heading = self._last_heading = 0.0
        self._state: State | None = None

    def begin(self) -> None:
        """Stay where the robot is from now on."""
        self._state = None

    def voltages(self, now: Moving, speed: float, yaw_rate: float) -> tuple[float, float]:
        """Return what the motors get for the next period [V]: what was asked for one ago.

        Args:
            now: how the robot moves.
            speed: commanded [m/s].
            yaw_rate: commanded [rad/s].
        """
        turn = now.heading - self._last_heading
        self._last_heading = now.heading
        self._heading += math.remainder(turn, 2.0 * math.pi)
        tilt_noise, rate_noise = self._drawn()
        self._travel += now.velocity * CONTROL_PERIOD
        given = ControlInput(
            CONTROL_PERIOD,
            now.tilt + self._lean + TILT_NOISE * tilt_noise,
            now.rate + RATE_NOISE * rate_noise,
            self._travel,
            now.velocity,
            self._heading,
            now.yaw_rate,
            speed,
            yaw_rate,
        )
        if self._state is None:
            self._state = reset(given, self._gains)
        asked = self._state
        self._state = step(asked, given, self._gains)
        return asked.left, asked.right

    def _drawn(self) -> list[float]:
        """Return two standard normal numbers."""
        numbers = next(self._noise, None)
        if numbers is None:
            self._noise = iter(self._random.standard_normal((1000, 2)).tolist())
            numbers = next(self._noise)
        return numbers
