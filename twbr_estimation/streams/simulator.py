"""What simulator_node does, without ROS: a simulated robot that follows time and commands."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, NamedTuple

from ..bounds import Bounds, require_bounds
from ..errors import ConfigurationError
from ..plants.laddach2022 import PlantState, back_emf, motor_torque
from ..robot import Robot
from ..samples import SINGLE_WHEEL_JOINT
from ..sensors.motion import ImuMotion
from ..simulation.disturbances import STEP
from ..simulation.stepping import Reading, SimulatedRobot

STOPPED = (0.0, 0.0)
LARGEST_LAG = 0.1
"""A robot further behind real time [s] leaves the lost time out instead of catching up."""
REMEMBERED = 0.25
"""Time for which readings are kept for sensors that ask for the past [s]."""
VELOCITY_TIME = 0.02
"""Time over which the velocity of a wheel is its mean [s]."""


class CommandUnit(str, Enum):
    """What the numbers of a motor command are."""

    VOLTAGE = "voltage"
    """[V]."""
    TORQUE = "torque"
    """Of a wheel [N m]."""


class SensorPath(str, Enum):
    """How the sensors are read."""

    TOPICS = "topics"
    """Their messages are published."""
    REGISTERS = "registers"
    """By the drivers, from simulated chips."""


@dataclass(frozen=True, slots=True)
class SimulatorSettings:
    """What is simulated; fixed at the start.

    Raises:
        ConfigurationError: a number out of bounds, or choices that exclude each other.
    """

    world: str = "paper"
    """What is wrong with robot, sensors and ground: a world of `twbr simulate`."""
    seed: Annotated[int, Bounds(0, 2**31 - 1, "", "Number of the random draw")] = 1
    disturbed: bool = False
    """Whether the world's pushes, obstacles, slips, slopes and turns come by themselves."""
    duration: Annotated[
        float, Bounds(1.0, 3600.0, "s", "Disturbances and noise are drawn for; then they repeat")
    ] = 60.0
    imu_period: Annotated[
        float, Bounds(0.0005, 0.1, "s", "Of imu/data_raw and the joints, a multiple of 0.0005")
    ] = 0.0025
    control_period: Annotated[
        float,
        Bounds(0.0005, 0.1, "s", "In lockstep: a command is waited for after each, a multiple of "
               "imu_period and the `period` of the controller"),
    ] = 0.005  # fmt: skip
    lockstep: bool = False
    """Whether simulated time, on `/clock`, waits for the commands; otherwise it is the clock's."""
    lockstep_timeout: Annotated[
        float,
        Bounds(0.1, 3600.0, "s", "In lockstep: wall time after which a step is taken without its "
               "command, motors cut"),
    ] = 5.0  # fmt: skip
    paused: bool = False
    """Whether time stands still until `~/resume`."""
    sensors: SensorPath = SensorPath.TOPICS
    """`topics` publishes the sensors' messages; `registers` lets mpu6050_node and encoder_node, in
    this process, read simulated chips. Not in lockstep: a chip has a clock of its own."""
    command_unit: CommandUnit = CommandUnit.VOLTAGE
    """Unit of `motor/command`: `voltage` of a motor [V], or `torque` of a wheel [N m]."""
    command_timeout: Annotated[
        float, Bounds(0.01, 10.0, "s", "Without a command for this long the motors are cut")
    ] = 0.1
    wheel_joints: tuple[str, ...] = ()
    """Names of one or two wheel joints; two share the encoder of a world that has one. Empty for
    `wheel_joint`, or left_wheel_joint and right_wheel_joint in a world with two encoders."""
    reference_joint: str = "tilt"
    """Name of the joint in `reference/joint_states`."""
    frame_id: str = "imu_link"
    """Frame of `imu/data_raw`."""
    start_tilt: Annotated[
        float, Bounds(-0.6, 0.6, "rad", "Tilt at the start and after ~/stand_up and ~/reset")
    ] = 0.0
    held: bool = True
    """Whether a hand holds the robot, at the start and after ~/stand_up and ~/reset, until the
    first motor command that is not zero."""
    stay_down: bool = True
    """Whether a fallen robot lies until `~/stand_up`; otherwise it is lifted at once."""
    compiled: bool = False
    """Whether the plant is compiled: cheaper, after some seconds at the start."""

    def __post_init__(self) -> None:
        require_bounds(self)
        if len(self.wheel_joints) > 2:
            raise ConfigurationError(f"wheel_joints: {len(self.wheel_joints)} joints, not 1 or 2")
        if self.lockstep and self.sensors is SensorPath.REGISTERS:
            raise ConfigurationError("sensors: registers cannot be read in lockstep")
        samples = self.control_period / self.imu_period
        if self.lockstep and abs(samples - round(samples)) > 1e-6:
            raise ConfigurationError(
                f"control_period: {self.control_period:g} s is not a multiple of imu_period, "
                f"{self.imu_period:g} s"
            )


@dataclass(frozen=True, slots=True)
class Disturbance:
    """How strong the disturbances on demand are.

    Raises:
        ConfigurationError: a number out of bounds.
    """

    push_force: Annotated[
        float, Bounds(-100.0, 100.0, "N", "Of ~/push, a half sine on the body; forward")
    ] = 3.0
    push_duration: Annotated[float, Bounds(0.001, 5.0, "s", "Of ~/push")] = 0.2
    slip_speed: Annotated[
        float, Bounds(-3.0, 3.0, "m/s", "Of ~/slip, a half sine of the treads over the ground")
    ] = 0.3
    slip_duration: Annotated[float, Bounds(0.001, 5.0, "s", "Of ~/slip")] = 0.1

    def __post_init__(self) -> None:
        require_bounds(self)


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
        """How often something happened."""
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
        self.robot = SimulatedRobot(
            settings.world,
            settings.seed,
            settings.imu_period,
            duration=settings.duration,
            robot=self._given,
            disturbed=settings.disturbed,
            stay_down=settings.stay_down,
            compiled=settings.compiled,
        )
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
        """How far the simulation is [ns]."""
        return self.robot.stamp + self._shift

    @property
    def latest(self) -> Reading:
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
        self._held = self.settings.held

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

    def advance_to(self, now: int) -> list[Reading]:
        """Follow real time up to `now` [ns]; return the readings that fell due."""
        behind = (now - self.stamp) * 1e-9
        if behind > LARGEST_LAG:
            self.counts["late"] += 1
            self.begin_at(now - round(LARGEST_LAG * 1e9))
            behind = LARGEST_LAG
        periods = math.floor(behind / self.settings.imu_period + 1e-6)
        return self.advance(periods) if periods > 0 else []

    def advance(self, periods: int) -> list[Reading]:
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

    def _shifted(self, reading: Reading) -> Reading:
        return reading._replace(stamp=reading.stamp + self._shift)

    def wheels(self, reading: Reading) -> Wheels:
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

    def _efforts(self, reading: Reading) -> tuple[float, ...]:
        if self.robot.held:
            return STOPPED
        truth, limit = reading.truth, self.robot.plant.supply_voltage
        moving = PlantState(truth.position, truth.velocity, truth.tilt, truth.rate)
        return tuple(
            0.5 * motor_torque(moving, min(max(each, -limit), limit), self.robot.plant)
            for each in self._voltages()
        )

    def at(self, seconds: float) -> Reading:
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


def _whole(seconds: float) -> float:
    """Return a time of whole steps, one at least [s]."""
    return max(round(seconds / STEP), 1) * STEP
