"""A scene in execution: the engine advances one control period after the other."""

from __future__ import annotations

import numpy as np

from ..errors import ConfigurationError
from ..recording import FloatArray
from ..robot import Robot
from ..simulation.disturbances import stream
from .balance import CONTROL_PERIOD, Balance
from .engine import Engine, empty
from .scenes import SCENES, Scene
from .stage import STOPPED, Order, Stage, count

SETTLING = 0.5
"""Time for which the robot balances before a scene begins, so that it stands on its wheels [s]."""


def scene_named(name: str) -> Scene:
    """Return the scene of that name.

    Raises:
        ConfigurationError: no such scene; the message lists those there are.
    """
    try:
        return SCENES[name]
    except KeyError:
        known = ", ".join(SCENES)
        raise ConfigurationError(
            f"there is no scene {name!r} of the physics engine; there are: {known}"
        ) from None


class Performance:
    """One robot in one scene."""

    def __init__(self, name: str, robot: Robot, seed: int, step: float) -> None:
        """Set the robot down.

        Args:
            name: of the scene.
            robot: as it is.
            seed: of the scene's draw.
            step: of the integration [s]; the control period is a multiple of it.

        Raises:
            ConfigurationError: no such scene, no MuJoCo, or a robot it cannot have.
        """
        scene, random = scene_named(name), stream(seed, f"physics {name}")
        self.engine = Engine(robot, scene.surroundings(random), step)
        self.stage = Stage(self.engine, Balance(robot, stream(seed, f"balance {name}")), random)
        self.steps = round(CONTROL_PERIOD / step)
        if scene.prelude > 0.0:
            push = self.stage.side()
            self.engine.push(push)
            self.engine.advance(STOPPED, empty(round(0.5 / step)))
            self.engine.push(0.0)
            self.engine.advance(STOPPED, empty(round(scene.prelude / step)))
        self.voltage = 0.0
        """Mean of the motors in the latest period [V]."""
        self.script = self.stage.balanced(SETTLING)
        for _ in range(0 if scene.prelude > 0.0 else count(SETTLING)):
            self.advance(empty(self.steps))
        self.stage.periods = 0
        self.script = scene.script(self.stage)

    def advance(self, rows: FloatArray) -> None:
        """Take one control period; `rows` receives the states after each step."""
        stage, order = self.stage, self.order()
        voltages = order.voltages
        if voltages is None:
            voltages = stage.balance.voltages(self.engine.moving(), order.speed, order.yaw_rate)
        self.engine.advance(voltages, rows, order.grip)
        self.voltage = 0.5 * (voltages[0] + voltages[1])
        stage.periods += 1

    def order(self) -> Order:
        """Return the scene's order for the next control period."""
        order = next(self.script)
        self.stage.watch()
        return order


def performed(
    name: str, robot: Robot, seed: int, step: float, steps: int
) -> tuple[FloatArray, FloatArray, Performance]:
    """Return the states of a whole scene.

    Args:
        name: of the scene.
        robot: as it is.
        seed: of the scene's draw.
        step: of the integration [s].
        steps: how many.

    Returns:
        The states, (steps + 1, COLUMNS); the motors' mean voltage in each step [V], (steps,);
        and the performance with its diary.
    """
    performance = Performance(name, robot, seed, step)
    each = performance.steps
    periods = -(-steps // each)
    rows, volts = empty(periods * each + 1), np.empty(periods * each)
    rows[0] = performance.engine.row()
    for i in range(periods):
        part = slice(i * each, (i + 1) * each)
        performance.advance(rows[1:][part])
        volts[part] = performance.voltage
    return rows[: steps + 1], volts[:steps], performance
