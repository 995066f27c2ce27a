"""The work of simulator_node without ROS: a simulated robot that follows time and commands."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Sequence
from typing import NamedTuple

from ...physics.mujoco_robot import PhysicsRobot
from ...plants.laddach2022 import PlantState, back_emf, motor_torque
from ...robot import Robot
from ...samples import SINGLE_WHEEL_JOINT
from ...sensors.motion import ImuMotion
from ...simulation.disturbances import STEP
from ...simulation.simulated_robot import SensorReading, SimulatedRobot
from .settings import CommandUnit, Disturbance, Physics, SimulatorSettings

STOPPED = (0.0, 0.0)
LARGEST_LAG = 0.1
"""A robot further behind real time [s] leaves the lost time out instead of catching up."""
REMEMBERED = 0.25
"""Time for which readings are kept for sensors that ask for the past [s]."""
VELOCITY_TIME = 0.02
"""Time over which the velocity of a wheel is its mean [s]."""


class Wheels(NamedTuple):
    """The wheel joints of one reading, one number a joint."""

    position: tuple[float, ...]
    """[rad]."""
    velocity: tuple[float, ...]
    """[rad/s]."""
    effort: tuple[float, ...]
    """Torque of the motor at the wheel [N m]."""


class Simulator:
    """One simulated robot and the command in force; stamps are [ns] of the caller's clock."""

    def __init__(self, settings: SimulatorSettings, robot: Robot | None = None) -> None:
        """Stand the robot up, at rest.

        Args:
            settings: What is simulated.
            robot: The true robot but for what the world changes; the defaults where None.

        Raises:
            ConfigurationError: an unknown world, or a period that cannot be simulated.
        """
        self.settings = settings
        self._given = robot
        self.counts: Counter[str] = Counter(commands=0, rejected=0, timeouts=0, late=0)
        """Numbers of events."""
        self.zeros_while_held = 0
        """Commands of zeros since a hand holds the robot."""
        self.rejection = ""
        """Why the latest bad command was rejected."""
        self._shift = 0
        self._begin()

    def reset(self) -> None:
        """Begin again: the same draw, the robot at the start; stamps go on."""
        stamp = self.stamp
        self._begin()
        self.begin_at(stamp)

    def _begin(self) -> None:
        settings = self.settings
        self.robot = robot_of(settings, self._given)
        self.stand_up()
        kept = math.ceil(REMEMBERED / settings.imu_period)
        self._readings = deque([self.robot.reading], kept)
        self._wheels: deque[tuple[int, tuple[float, ...]]] = deque(
            maxlen=1 + math.ceil(VELOCITY_TIME / settings.imu_period)
        )
        self._command, self._commanded = STOPPED, 0
        self._timed_out = True

    @property
    def stamp(self) -> int:
        """Present time of the simulation [ns]."""
        return self.robot.stamp + self._shift

    @property
    def latest(self) -> SensorReading:
        """The latest reading."""
        return self._readings[-1]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the wheel joints."""
        if self.settings.wheel_joints:
            return self.settings.wheel_joints
        if len(self.robot.reading.wheels) == 1:
            return (SINGLE_WHEEL_JOINT,)
        return "left_wheel_joint", "right_wheel_joint"

    @property
    def held(self) -> bool:
        """Whether a hand holds the robot until it is commanded."""
        return self._held

    @property
    def cut(self) -> bool:
        """Whether the motors are cut because no command comes."""
        return self._timed_out

    def stand_up(self) -> None:
        """Put the robot upright at rest where it is, at `start_tilt`, and hold it there."""
        self.robot.place(self.settings.start_tilt)
        self._held, self.zeros_while_held = self.settings.held, 0

    def push(self, disturbance: Disturbance) -> None:
        """Push the body from now on."""
        self.robot.push(disturbance.push_force, _whole(disturbance.push_duration))

    def slip(self, disturbance: Disturbance) -> None:
        """Let the treads slip from now on."""
        self.robot.slip(disturbance.slip_speed, _whole(disturbance.slip_duration))

    def begin_at(self, stamp: int) -> None:
        """Let the simulation be at `stamp` [ns] now; nothing is simulated."""
        self._shift = stamp - self.robot.stamp
        self._readings.clear()
        self._readings.append(self._shifted(self.robot.reading))
        self._wheels.clear()

    def command(self, values: Sequence[float]) -> bool:
        """Take a motor command, one number for both or left and right; False if rejected."""
        if len(values) not in (1, 2) or not all(map(math.isfinite, values)):
            self.reject(f"{[*values]} are not one or two finite numbers")
            return False
        self.counts["commands"] += 1
        self._held = self._held and not any(values)
        self.zeros_while_held = self.zeros_while_held + 1 if self._held else 0
        self._command = (float(values[0]), float(values[-1]))
        self._commanded, self._timed_out = self.stamp, False
        return True

    def reject(self, reason: str) -> None:
        """Count a command that cannot be used; the one before stays in force."""
        self.counts["rejected"] += 1
        self.rejection = f"motor command: {reason}"

    def cut_motors(self) -> None:
        """Switch the motors off until the next command."""
        self._command, self._timed_out = STOPPED, True

    def advance_to(self, now: int) -> list[SensorReading]:
        """Follow real time up to `now` [ns]; return the readings that fell due."""
        behind = (now - self.stamp) * 1e-9
        if behind > LARGEST_LAG:
            self.counts["late"] += 1
            self.begin_at(now - round(LARGEST_LAG * 1e9))
            behind = LARGEST_LAG
        periods = math.floor(behind / self.settings.imu_period + 1e-6)
        return self.advance(periods) if periods > 0 else []

    def advance(self, periods: int) -> list[SensorReading]:
        """Go on by IMU periods; return a reading for each."""
        found = []
        for _ in range(periods):
            self._watch_command()
            if self._held:
                self.robot.place(self.settings.start_tilt)
            for reading in self.robot.advance(self._voltages(), self.settings.imu_period):
                found.append(self._shifted(reading))
        self._readings.extend(found)
        return found

    def _watch_command(self) -> None:
        late = (self.stamp - self._commanded) * 1e-9 > self.settings.command_timeout
        if late and not self._timed_out:
            self.counts["timeouts"] += 1
            self.cut_motors()

    def _plant(self) -> PlantState:
        truth = self.robot.truth
        return PlantState(truth.position, truth.velocity, truth.tilt, truth.rate)

    def _voltages(self) -> tuple[float, float]:
        """Return the motors' voltages; a torque's are right at the beginning of the period."""
        if self._timed_out or self.settings.command_unit is CommandUnit.VOLTAGE:
            return self._command
        plant = self.robot.plant
        gain = plant.gear_ratio * plant.torque_constant / plant.winding_resistance
        turning = back_emf(self._plant(), plant)
        left, right = (torque / gain + turning for torque in self._command)
        return left, right

    def _shifted(self, reading: SensorReading) -> SensorReading:
        return reading._replace(stamp=reading.stamp + self._shift)

    def wheels(self, reading: SensorReading) -> Wheels:
        """Return the wheel joints of a new reading; call it once for each, in order."""
        count = len(self.joints)
        angle = reading.wheels
        if len(angle) > count:
            angle = (math.fsum(angle) / len(angle),)
        position = tuple(angle[min(index, len(angle) - 1)] for index in range(count))
        self._wheels.append((reading.stamp, position))
        first, before = self._wheels[0]
        dt = (reading.stamp - first) * 1e-9
        velocity = tuple(
            (now - then) / dt if dt > 0.0 else 0.0
            for now, then in zip(position, before, strict=True)
        )
        return Wheels(position, velocity, self._efforts(reading)[:count])

    def _efforts(self, reading: SensorReading) -> tuple[float, ...]:
        if self.robot.held:
            return STOPPED
        truth, limit = reading.truth, self.robot.plant.supply_voltage
        moving = PlantState(truth.position, truth.velocity, truth.tilt, truth.rate)
        return tuple(
            0.5 * motor_torque(moving, min(max(each, -limit), limit), self.robot.plant)
            for each in self._voltages()
        )

    def at(self, seconds: float) -> SensorReading:
        """Return the latest reading of that time or before, for sensors with their own clock."""
        stamp = round(seconds * 1e9)
        for reading in reversed(self._readings):
            if reading.stamp <= stamp:
                return reading
        return self._readings[0]

    def imu_motion(self, seconds: float) -> ImuMotion:
        """Return what a chip's registers show at that time, with all errors of the world."""
        return ImuMotion(*self.at(seconds).imu)

    def wheel_angle(self, index: int, seconds: float) -> float:
        """Return the angle of a wheel's encoder [rad] at that time."""
        wheels = self.at(seconds).wheels
        return wheels[min(index, len(wheels) - 1)]


def robot_of(settings: SimulatorSettings, given: Robot | None) -> SimulatedRobot | PhysicsRobot:
    """Return the robot that the settings ask for.

    Raises:
        ConfigurationError: an unknown world or scene, or a period that cannot be simulated.
    """
    if settings.physics is Physics.MUJOCO:
        return PhysicsRobot(
            settings.scene,
            settings.world,
            settings.seed,
            settings.imu_period,
            duration=settings.duration,
            robot=given,
            stay_down=settings.stay_down,
        )
    return SimulatedRobot(
        settings.world,
        settings.seed,
        settings.imu_period,
        duration=settings.duration,
        robot=given,
        disturbed=settings.disturbed,
        stay_down=settings.stay_down,
        compiled=settings.compiled,
    )


def _whole(seconds: float) -> float:
    """Return a time of whole steps, one at least [s]."""
    return max(round(seconds / STEP), 1) * STEP
