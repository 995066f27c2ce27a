"""One robot, one estimator, one controller: the live code in lockstep with the rig.

At every IMU sample the correction and the filter take a step, at every control period the
controller. The loop is closed: the estimated tilt and rate steer the robot, and the estimated tilt
turns the angle of an encoder on the body into a position.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..controllers.base import MotorVoltages
from ..errors import ConfigurationError
from ..physics.mujoco_robot import PhysicsRobot
from ..pipeline.correction import Corrector
from ..pipeline.pairing import WheelReading
from ..robot import CorrectionSettings
from ..samples import CorrectedSample, Sample
from ..simulation.simulated_robot import SensorReading, SimulatedRobot
from ..simulation.worlds import world_named
from ..streams.control.balance import (
    NO_VOLTAGE,
    BalanceConfiguration,
    BalanceSettings,
    BalanceStream,
    Standing,
)
from ..streams.filter_configuration import FilterConfiguration, FilterSettings
from ..streams.filtering import FilterStream

TRUTH = "truth"
"""The estimator that returns the true tilt and rate."""
SETTLING = 1.0
"""Without a fall, time at the start that does not count in the estimate's error [s]."""


@dataclass(frozen=True, slots=True)
class Trial:
    """Robot, estimator, controller and duration of a trial."""

    world: str
    estimator: str
    """Name of a filter, or `TRUTH`."""
    controller: str
    seed: int
    duration: float = 60.0
    """[s]."""
    dt: float = 0.005
    """Between two IMU samples [s]; the controller's period is a multiple of it."""
    pushes: float = 1.0
    """Factor on the world's pushes."""
    values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Parameter values by filter name."""
    correction: CorrectionSettings | None = None
    """None leaves the defaults."""
    controller_values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Parameter values by controller name."""
    scene: str | None = None
    """In MuJoCo: what happens to the robot; None for the rig."""
    balance: BalanceSettings = field(default_factory=BalanceSettings)
    """Limits and time-outs; its controller's name is replaced by `controller`."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of a trial."""

    upright: float
    """Share of the time in which the robot neither lay nor was being stood up."""
    first_fall: float
    """When it first fell, or the whole duration [s]."""
    falls: int
    rms_tilt: float
    """True tilt while upright [rad]."""
    rms_error: float
    """Estimated minus true tilt while upright [rad]."""
    effort: float
    """rms voltage while upright [V]."""
    rms_position: float
    """Distance from where the robot was last let go [m]."""
    cut: float
    """Share of the upright time in which the motors were cut: a false detection of a
    fall, or an estimate marked as not valid."""


class Loop:
    """A closed loop that moves on period by period."""

    def __init__(self, trial: Trial, *, compiled: bool = True) -> None:
        """Stand the robot up, at rest.

        Raises:
            ConfigurationError: something unknown in the trial, or out of bounds.
        """
        settings = replace(trial.balance, controller=trial.controller)
        self.robot = _robot_of(trial, compiled=compiled)
        setup = self.robot.setup
        if trial.correction is not None:
            setup = replace(setup, correction=trial.correction)
        self._period = settings.period
        if abs(self._period / trial.dt - round(self._period / trial.dt)) > 1e-6:
            raise ConfigurationError(
                f"control period {self._period:g} s is not a multiple of dt {trial.dt:g} s"
            )
        self._dt = trial.dt
        self._corrector = Corrector(setup)
        self.filters: FilterStream | None = None
        if trial.estimator != TRUTH:
            self.filters = FilterStream(
                FilterConfiguration(FilterSettings(trial.estimator), trial.values, setup.robot)
            )
        self.balance = BalanceStream(
            BalanceConfiguration(settings, trial.controller_values, setup.robot)
        )
        self.voltages: MotorVoltages = NO_VOLTAGE
        """Last voltages of the motors."""
        self.corrected: CorrectedSample
        """Last sample of the filter."""
        self.estimate = 0.0
        """Last tilt of the controller's input [rad]."""
        self._take(self.robot.reading, 0.0)

    def step(self) -> None:
        """Take one control period."""
        if isinstance(self.robot, PhysicsRobot):
            self.balance.command(self.robot.stamp, *self.robot.commanded)
        self.voltages = self.balance.step(self.robot.stamp)
        for reading in self.robot.advance(self.voltages, self._period):
            self._take(reading, self._dt)

    def _take(self, reading: SensorReading, dt: float) -> None:
        """Let the estimator and the odometry have a reading."""
        wheels = reading.wheels
        angle, difference = sum(wheels) / len(wheels), wheels[-1] - wheels[0]
        tilt, rate = reading.truth.tilt, reading.truth.rate
        if self.filters is not None:
            left, right = self.voltages
            motors = (0.5 * (left + right), right - left, 2.0)
            sample = Sample(*(dt, *reading.imu, angle, difference, float(len(wheels)), *motors))
            self.corrected = self._corrector.step(sample)
            estimate = self.filters.step(self.corrected)
            tilt, rate = estimate.tilt, estimate.rate
            self.balance.set_valid(self.filters.trusted)
        self.estimate = tilt
        self.balance.add_tilt(reading.stamp, tilt, rate)
        self.balance.add_wheels(WheelReading(reading.stamp, angle, difference, float(len(wheels))))


def _robot_of(trial: Trial, *, compiled: bool) -> SimulatedRobot | PhysicsRobot:
    """Return the robot of a trial."""
    world = world_named(trial.world)
    delay = world.control_period
    if trial.scene is not None:
        return PhysicsRobot(
            trial.scene, world, trial.seed, trial.dt, duration=trial.duration, command_delay=delay
        )
    return SimulatedRobot(
        replace(world, push_factor=trial.pushes * world.push_factor),
        trial.seed,
        trial.dt,
        duration=trial.duration,
        command_delay=delay,
        compiled=compiled,
    )


def run(trial: Trial) -> Outcome:
    """Let the robot balance through the trial.

    Raises:
        ConfigurationError: something unknown in the trial, or out of bounds.
    """
    loop = Loop(trial)
    robot = loop.robot
    steps = round(trial.duration / loop.balance.settings.period)
    rows = np.zeros((steps, 6))
    first_fall, home, was_held = trial.duration, 0.0, False
    for row in rows:
        before = robot.truth
        row[0] = before.tilt
        row[1] = math.remainder(loop.estimate - before.tilt, 2.0 * math.pi)
        loop.step()
        if robot.held or was_held:
            home = robot.truth.position
        was_held = robot.held
        row[2] = 0.5 * (loop.voltages[0] + loop.voltages[1])
        row[3] = robot.truth.position - home
        row[4] = robot.held
        row[5] = loop.balance.standing is not Standing.BALANCING
        if robot.falls and first_fall == trial.duration:
            first_fall = robot.time
    return _judged(rows, first_fall, robot.falls, loop.balance.settings.period)


def _judged(
    rows: np.ndarray[tuple[int, int], np.dtype[np.float64]],
    first_fall: float,
    falls: int,
    period: float,
) -> Outcome:
    """Return the figures of a run."""
    upright = rows[rows[:, 4] == 0.0]
    settled = rows[round(SETTLING / period) :]
    settled = settled[settled[:, 4] == 0.0]

    def rms(values: object) -> float:
        squares = np.square(np.asarray(values, dtype=np.float64))
        return math.sqrt(float(np.mean(squares))) if squares.size else 0.0

    return Outcome(
        upright=upright.shape[0] / rows.shape[0],
        first_fall=first_fall,
        falls=falls,
        rms_tilt=rms(upright[:, 0]),
        rms_error=rms(settled[:, 1]),
        effort=rms(upright[:, 2]),
        rms_position=rms(upright[:, 3]),
        cut=float(np.mean(upright[:, 5])) if upright.shape[0] else 1.0,
    )
