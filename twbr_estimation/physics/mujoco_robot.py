"""A scene one step at a time, with the motors' command from outside.

It is the counterpart of `simulation.simulated_robot.SimulatedRobot` in MuJoCo: hands, pushes and
grounds follow the scene, and where the scene lets the robot balance, the caller commands it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from ..recording import FloatArray
from ..robot import Robot
from ..simulation.disturbances import STEP
from ..simulation.simulate import FIRST_STAMP, setups_of
from ..simulation.simulated_robot import SensorReading, Truth, limited_voltages, steps_of
from ..simulation.worlds import World, world_named
from .balance import CONTROL_PERIOD
from .engine import Pose, empty
from .model import Surroundings
from .performance import Performance
from .readings import Readings
from .simulate import COARSE_STEP, spatial
from .stage import Order

SLIPPERY = 0.02
"""Friction of the ground while the treads slip on demand."""


class PhysicsRobot:
    """One robot in one scene, moved on by commands; deterministic for a seed."""

    def __init__(
        self,
        scene: str,
        world: World | str,
        seed: int,
        imu_period: float = 0.002,
        *,
        duration: float = 60.0,
        robot: Robot | None = None,
        command_delay: float = 0.0,
        stay_down: bool = False,
    ) -> None:
        """Set the robot down.

        Args:
            scene: one of `SCENES`.
            world: what is wrong with sensors and geometry.
            seed: number of the random draw.
            imu_period: between two readings [s], a multiple of `STEP`.
            duration: for which noise is drawn [s]; then it comes again.
            robot: the robot's parameters as the estimator gets them; the defaults where None.
            command_delay: from a command to the motors [s], a multiple of `STEP`.
            stay_down: whether a robot that fell is left lying until `place`.

        Raises:
            ConfigurationError: MuJoCo is missing, an unknown scene or world, or a time that
                cannot be simulated.
        """
        assumed = robot or Robot()
        self.world = spatial(world_named(world) if isinstance(world, str) else world, assumed)
        self.setup, self.true_setup = setups_of(self.world, seed, assumed)
        self.plant = self.true_setup.robot.plant()
        times = (imu_period, command_delay or COARSE_STEP)
        coarse = all(abs(t / COARSE_STEP - round(t / COARSE_STEP)) < 1e-6 for t in times)
        self._dt = COARSE_STEP if coarse and imu_period >= COARSE_STEP else STEP
        self._every = steps_of("imu_period", imu_period, self._dt)
        self._delay = steps_of("command_delay", command_delay, self._dt) if command_delay else 0
        self._performance = Performance(scene, self.true_setup.robot, seed, self._dt)
        self._engine, self._stage = self._performance.engine, self._performance.stage
        self._stage.stays_down = stay_down
        count = math.ceil(duration / imu_period) + 1
        self._readings = Readings(
            self.true_setup.robot, self.world, seed, self._dt, self._every, count
        )
        self._step = 0
        self._position = 0.0
        self._order, self._from = Order(), self._engine.grip
        self._voltages = (0.0, 0.0)
        self._commands: deque[tuple[int, tuple[float, float]]] = deque()
        self._waves: list[tuple[int, int, float]] = []
        self._slippery = 0
        self._down = False
        self.falls = 0
        """Number of falls."""
        self._row = self._engine.row()
        self._readings.follow(np.array([self._row, self._row]), self._engine.moving(), 0.0)
        self.reading = self._read()
        """The latest reading; at first the one at rest."""

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._step * self._dt

    @property
    def stamp(self) -> int:
        """The same as a stamp [ns]."""
        return FIRST_STAMP + self._step * round(self._dt * 1e9)

    @property
    def held(self) -> bool:
        """Whether the robot is on the ground, or a hand holds it."""
        return self._down or self._engine.grip is not None

    @property
    def truth(self) -> Truth:
        """Present motion of the robot."""
        now = self._engine.moving()
        return Truth(now.tilt, now.rate, self._position, now.velocity, now.heading, now.yaw_rate)

    @property
    def commanded(self) -> tuple[float, float]:
        """Speed [m/s] and yaw rate [rad/s] that the scene commands now."""
        return self._order.speed, self._order.yaw_rate

    def push(self, force: float, duration: float = 0.2) -> None:
        """Push the body forward with a half sine of `force` [N] for `duration` [s], from now."""
        self._waves.append((self._step, steps_of("duration", duration, self._dt), force))

    def slip(self, speed: float, duration: float = 0.1) -> None:
        """Let the ground be slippery for `duration` [s]; how fast treads slip, physics decides."""
        del speed
        self._slippery = self._step + steps_of("duration", duration, self._dt)
        self._engine.set_friction(SLIPPERY)

    def obstacle(self) -> None:
        """Lay a bar before the wheels."""
        now = self._engine.moving()
        self._engine.lay_bar(math.copysign(1.0, now.velocity))

    def place(self, tilt: float = 0.0) -> None:
        """Hold the robot still at `tilt` [rad] where it is, and let go."""
        x, y, _, heading, _, _ = self._engine.pose()
        self._stage.let_go()
        self._engine.place((x, y, self._stage.height, heading, 0.0, tilt))
        self._order, self._from, self._down = Order(), None, False
        self._row = self._engine.row()

    def advance(self, voltages: Sequence[float], duration: float) -> list[SensorReading]:
        """Move on under one command.

        Args:
            voltages: of the left and the right motor [V], limited to the supply.
            duration: for how long [s], a multiple of the integration's step.

        Returns:
            The readings that fall due, the one at the end included.

        Raises:
            ConfigurationError: not two finite voltages, or a time that cannot be simulated.
        """
        limited = limited_voltages(voltages, self.plant.supply_voltage)
        self._commands.append((self._step + self._delay, limited))
        end = self._step + steps_of("duration", duration, self._dt)
        period = round(CONTROL_PERIOD / self._dt)
        readings = []
        while self._step < end:
            while self._commands and self._commands[0][0] <= self._step:
                self._voltages = self._commands.popleft()[1]
            if self._step % period == 0:
                self._begin_period()
            sample = (self._step // self._every + 1) * self._every
            change = self._commands[0][0] if self._commands else end
            self._go(min(sample, change, end, (self._step // period + 1) * period), period)
            if self._step == sample:
                self.reading = self._read()
                readings.append(self.reading)
        return readings

    def _begin_period(self) -> None:
        """Ask the scene what happens in the next control period."""
        if self._slippery and self._step >= self._slippery:
            self._engine.set_friction(Surroundings().friction)
            self._slippery = 0
        self._order = self._performance.order()
        self._from = self._engine.grip
        self._stage.periods += 1
        down = self._stage.fallen and self._engine.grip is None
        self.falls += down and not self._down
        self._down = down

    def _go(self, end: int, period: int) -> None:
        """Take the steps up to `end`, within one control period."""
        count = end - self._step
        rows = empty(count + 1)
        rows[0] = self._row
        self._engine.push(self._pushing(), outside=True)
        voltages = self._order.voltages or self._voltages
        self._engine.advance(voltages, rows[1:], self._grip(end, period))
        now = self._engine.moving()
        self._readings.follow(rows, now, 0.5 * (voltages[0] + voltages[1]))
        self._position += now.velocity * count * self._dt
        self._step, self._row = end, rows[-1]

    def _grip(self, end: int, period: int) -> Pose | None:
        """Return where the hand is at a step of the present control period."""
        to, begin = self._order.grip, self._from
        if to is None or begin is None or end % period == 0:
            return to
        share = (end % period) / period
        x, y, z, heading, roll, tilt = (b + share * (e - b) for b, e in zip(begin, to, strict=True))
        return x, y, z, heading, roll, tilt

    def _pushing(self) -> float:
        """Return the force of the pushes on demand [N]."""
        self._waves = [wave for wave in self._waves if wave[0] + wave[1] > self._step]
        return sum(
            force * math.sin(math.pi * (self._step - begin + 0.5) / length)
            for begin, length, force in self._waves
        )

    def _read(self) -> SensorReading:
        """Read all sensors now."""
        row: FloatArray = self._row
        truth = self.truth
        return SensorReading(
            self.stamp,
            self._readings.imu(self._step // self._every),
            self._readings.wheels(row),
            self._readings.reference(truth.tilt),
            truth,
        )
