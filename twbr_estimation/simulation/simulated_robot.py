"""The rig one step at a time, with the motors' command from outside.

Functions and random streams are those of the compiled drive: a robot that receives the drive's
own commands gives the same recording as `simulate`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..errors import ConfigurationError
from ..plants.laddach2022 import PlantState
from ..recording import FloatArray
from ..robot import Robot
from ..sensors.error_model import Sextuple, read
from .disturbances import STEP, disturb, gyro_drift, stream
from .planar_sensing import PlanarMotion, gyro_cross, imu_errors, mount_of, quantised
from .rig import BALANCING, LYING, LYING_SECONDS, STOP_TILT, Inputs, RigState, stretch
from .simulate import FIRST_STAMP, WHEEL_COUNTS, setups_of
from .stepped_sensing import PlanarSenses, Senses, SpatialSenses
from .turning import Turning, straight, turning
from .worlds import World, world_named

_PUSH, _SLIP = Inputs._fields.index("push"), Inputs._fields.index("slip")
_CLOSING_STEPS = round(1.0 / STEP)


class Truth(NamedTuple):
    """True motion of the robot."""

    tilt: float
    """[rad]."""
    rate: float
    """[rad/s]."""
    position: float
    """Of the axle along its way [m]."""
    velocity: float
    """[m/s]."""
    heading: float
    """[rad]."""
    yaw_rate: float
    """[rad/s]."""


class SensorReading(NamedTuple):
    """All sensors at one instant."""

    stamp: int
    """[ns]."""
    imu: Sextuple
    """Gyro x, y, z [rad/s] and accelerometer x, y, z [m/s^2], in the sensor's axes."""
    wheels: tuple[float, ...]
    """Encoder angles [rad]: one, or left and right."""
    reference: float
    """Tilt by the reference encoder [rad]."""
    truth: Truth


class SimulatedRobot:
    """One robot in one world, moved on by commands; deterministic for a seed."""

    def __init__(
        self,
        world: World | str,
        seed: int,
        imu_period: float = 0.002,
        *,
        duration: float = 60.0,
        robot: Robot | None = None,
        disturbed: bool = True,
        command_delay: float = 0.0,
        stay_down: bool = False,
        compiled: bool = False,
    ) -> None:
        """Stand upright at rest, all disturbances drawn.

        Args:
            world: one of `WORLDS`, or its name.
            seed: number of the random draw.
            imu_period: between two readings [s], a multiple of `STEP`.
            duration: for which disturbances are drawn [s]; then they come again, after a second
                in which what changes slowly goes back to where it began.
            robot: the robot's parameters as the estimator gets them; the defaults where None.
            disturbed: whether pushes, obstacles, slips, slopes and turns come by themselves;
                vibration and the sensors' errors stay.
            command_delay: from a command to the motors [s], a multiple of `STEP`.
            stay_down: whether the robot is left lying where it fell, until `place`; by default
                it is stood up again as on the rig.
            compiled: whether to use compiled loops. They are faster, but import numba, and the
                first call compiles; see docs/balancing.md.

        Raises:
            ConfigurationError: unknown world, or a time that cannot be simulated.
        """
        self.world = world_named(world) if isinstance(world, str) else world
        self.setup, self.true_setup = setups_of(self.world, seed, robot)
        self._every = steps_of("imu_period", imu_period)
        self._delay = steps_of("command_delay", command_delay) if command_delay else 0
        self._stay_down = stay_down
        self.plant = self.true_setup.robot.plant()
        self._errors = imu_errors(self.world, self.world.calibration, seed, self.true_setup.robot)
        self._count = steps_of("duration", duration) + _CLOSING_STEPS + 1
        self._senses = self._draw(seed, disturbed=disturbed, compiled=compiled)
        self._compiled, self._stretch, self._read_imu = compiled, stretch, read
        if compiled:
            from .kernels import read_kernel, stretch_kernel

            self._stretch, self._read_imu = stretch_kernel(), read_kernel()
        self._step = 0
        self._state = RigState()
        self._voltages = (0.0, 0.0)
        self._commands: deque[tuple[int, tuple[float, float]]] = deque()
        self._waves: list[tuple[int, int, int, float]] = []
        self._senses.begin(PlanarMotion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0)
        self.reading = self._read()
        """The latest reading; at first the one at rest."""

    def _draw(self, seed: int, *, disturbed: bool, compiled: bool) -> Senses:
        """Draw what the world does to the robot and its sensors; return the sensing elements."""
        world, steps = self.world, self._count
        spatial = world.track_width > 0.0
        if not disturbed:
            world = replace(world, push_factor=0.0, impacts=False, slips_per_second=0.0)
        drawn = disturb(world, steps, seed)
        if not disturbed:
            drawn = replace(drawn, slope=np.zeros(steps))
        if spatial:  # each wheel slips independently
            drawn = replace(drawn, slip=np.zeros(steps))
        drawn = replace(
            drawn,
            slope=_closed(drawn.slope),
            target=_closed(drawn.target),
            target_speed=_closed(drawn.target_speed),
        )
        self._inputs, self._vibration = drawn.inputs(), drawn.vibration
        samples = (steps - 1) // self._every + 1
        self._drift = gyro_drift(world, samples, self._every * STEP, seed).tolist()
        self._noise = stream(seed, "noise").standard_normal((samples, 6)).tolist()
        self._zeros = stream(seed, "encoders").uniform(0.0, 1.0, 2 if spatial else 1)
        robot = self.true_setup.robot
        mount = mount_of(robot, world)
        if not spatial:
            return PlanarSenses(robot, mount, compiled=compiled)
        turns = _closed_turns(turning(world, steps, seed)) if disturbed else straight(steps)
        return SpatialSenses(robot, mount, turns, gyro_cross(world, seed))

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._step * STEP

    @property
    def stamp(self) -> int:
        """The same as a stamp [ns]."""
        return FIRST_STAMP + self._step * round(STEP * 1e9)

    @property
    def falls(self) -> int:
        """Number of falls to the stops while the robot balanced."""
        return self._state.falls

    @property
    def held(self) -> bool:
        """Whether the robot is on the ground or being stood up: the motors have no effect then."""
        return self._state.mode != BALANCING

    @property
    def truth(self) -> Truth:
        """Present motion of the robot."""
        plant, senses = self._state.plant, self._senses
        return Truth(
            plant.tilt, plant.rate, plant.position, plant.velocity, senses.heading, senses.yaw_rate
        )

    @property
    def commanded_target(self) -> tuple[float, float]:
        """Position [m] and speed [m/s] that the rig's own drive would be commanded now."""
        row = self._inputs[self._step % self._count]
        return self._state.origin + float(row[3]), float(row[4])

    def push(self, force: float, duration: float = 0.2) -> None:
        """Push the body forward with a half sine of `force` [N] for `duration` [s], from now."""
        self._waves.append((_PUSH, self._step, steps_of("duration", duration), force))

    def slip(self, speed: float, duration: float = 0.1) -> None:
        """Let the treads slip by a half sine of `speed` [m/s] for `duration` [s], from now."""
        self._waves.append((_SLIP, self._step, steps_of("duration", duration), speed))

    def obstacle(self) -> None:
        """Put an obstacle before the wheels; it takes effect as soon as they are fast enough."""
        self._state = self._state._replace(obstacle=True)

    def place(self, tilt: float = 0.0) -> None:
        """Hold the robot still at `tilt` [rad] where it is, and let go."""
        at = self._state.plant.position
        self._state = self._state._replace(
            plant=PlantState(at, 0.0, tilt, 0.0), mode=BALANCING, timer=0.0, origin=at
        )
        still = PlanarMotion(0.0, tilt, 0.0, 0.0, 0.0, 0.0, 0.0, self._state.wheel_travel)
        self._senses.begin(still, self._step)

    def advance(self, voltages: Sequence[float], duration: float) -> list[SensorReading]:
        """Move on under one command.

        Args:
            voltages: of the left and the right motor [V], limited to the supply; where the world
                prescribes the turns, their mean counts.
            duration: for how long [s], a multiple of `STEP`.

        Returns:
            The readings that fall due, the one at the end included.

        Raises:
            ConfigurationError: not two finite voltages, or a time that cannot be simulated.
        """
        limited = limited_voltages(voltages, self.plant.supply_voltage)
        self._commands.append((self._step + self._delay, limited))
        end = self._step + steps_of("duration", duration)
        readings = []
        while self._step < end:
            while self._commands and self._commands[0][0] <= self._step:
                self._voltages = self._commands.popleft()[1]
            sample = (self._step // self._every + 1) * self._every
            change = self._commands[0][0] if self._commands else end
            self._go(min(sample, change, end))
            if self._step == sample:
                self.reading = self._read()
                readings.append(self.reading)
        return readings

    def _go(self, end: int) -> None:
        """Take the steps up to `end`."""
        begin, count = self._step, end - self._step
        inputs, vibration = self._rows(begin, count)
        motion: Any = np.zeros((count, 8))
        if not self._compiled:  # lists are faster there
            inputs, vibration = inputs.tolist(), vibration.tolist()
            motion = motion.tolist()
        voltage = 0.0 if self.held else 0.5 * (self._voltages[0] + self._voltages[1])
        state = self._stretch(self._state, inputs, vibration, voltage, self.plant, motion)
        if self._stay_down and state.mode == LYING:
            state = state._replace(timer=LYING_SECONDS, plant=_at_rest_on_a_stop(state.plant))
        self._senses.follow(motion, begin)
        self._state, self._step = state, end

    def _rows(self, begin: int, count: int) -> tuple[Any, Any]:
        """Return the disturbances of steps, and the vibration after each."""
        rows = np.arange(begin, begin + count)
        inputs = self._inputs[rows % self._count]
        for column, start, length, height in self._waves:
            share = np.clip((rows - start) / length, 0.0, 1.0)
            inputs[:, column] += height * np.sin(np.pi * share)
        self._waves = [wave for wave in self._waves if wave[1] + wave[2] > begin]
        return inputs, self._vibration[(rows + 1) % self._count]

    def _read(self) -> SensorReading:
        """Read all sensors now."""
        index = (self._step // self._every) % len(self._noise)
        rate, force = self._senses.imu_input()
        imu = self._read_imu(
            rate, force, tuple(self._drift[index]), tuple(self._noise[index]), self._errors
        )
        wheels, truth = self._senses.wheels(), self.truth
        reference = truth.tilt
        if self.world.digital:
            wheels = quantised(wheels, WHEEL_COUNTS, self._zeros)
            reference = float(quantised(np.array(reference), self.world.reference_counts, 0.5))
        return SensorReading(self.stamp, imu, tuple(wheels.tolist()), reference, truth)


def _at_rest_on_a_stop(plant: PlantState) -> PlantState:
    """Return the plant no deeper than the stop: its small bounces let it sink in as time goes."""
    return plant._replace(tilt=min(max(plant.tilt, -STOP_TILT), STOP_TILT))


def _closed(values: FloatArray) -> FloatArray:
    """Return values that end where they begin, by changing their last second, (n,)."""
    share = np.linspace(0.0, 1.0, _CLOSING_STEPS)
    share = share * share * (3.0 - 2.0 * share)
    tail = values[-_CLOSING_STEPS:] * (1.0 - share) + values[0] * share
    return np.concatenate([values[:-_CLOSING_STEPS], tail])


def _closed_turns(turns: Turning) -> Turning:
    """Return turns that end where they begin, by changing their last second."""
    roll, last = _closed(turns.roll), slice(-_CLOSING_STEPS, None)
    roll_rate = turns.roll_rate.copy()
    roll_rate[last] = np.gradient(roll, STEP)[last]
    return replace(
        turns,
        yaw_rate=_closed(turns.yaw_rate),
        roll=roll,
        roll_rate=roll_rate,
        lift_speed=_closed(turns.lift_speed),
    )


def limited_voltages(voltages: Sequence[float], supply: float) -> tuple[float, float]:
    """Return the voltages of left and right motor, limited to that of the supply [V].

    Raises:
        ConfigurationError: not two finite numbers.
    """
    if len(voltages) != 2 or not all(map(math.isfinite, voltages)):
        raise ConfigurationError(f"motor command {voltages}: not two finite voltages")
    left, right = (min(max(float(each), -supply), supply) for each in voltages)
    return left, right


def steps_of(name: str, seconds: float, step: float = STEP) -> int:
    """Return a time as a number of steps.

    Raises:
        ConfigurationError: not a positive multiple of `step` [s].
    """
    steps = round(seconds / step) if math.isfinite(seconds) else 0
    if steps < 1 or abs(steps * step - seconds) > 1e-9:
        raise ConfigurationError(f"{name}: {seconds:g} s is not a multiple of {step:g} s above 0")
    return steps
