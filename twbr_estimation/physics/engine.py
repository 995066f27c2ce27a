"""One robot in the engine: steps under voltages, pushes and a hand that can hold the body."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ConfigurationError
from ..recording import FloatArray
from ..robot import Robot
from .library import mujoco
from .model import BAR_RADIUS, Surroundings, description
from .state import COLUMNS, Moving, moving, quaternion

PUSH_HEIGHT = 0.18
"""Distance of the pushes from the axle, along the body [m]."""
BAR_DISTANCE, BAR_HEIGHT = 0.1, 0.005
"""Distance and height of a bar that is put on the ground on demand [m]."""
Pose = tuple[float, float, float, float, float, float]
"""x, y, z of the axle's middle [m]; heading, roll, tilt [rad]."""


class Engine:
    """Robot and surroundings that move on step by step."""

    def __init__(self, robot: Robot, surroundings: Surroundings, step: float) -> None:
        """Set the robot down, motionless.

        Raises:
            ConfigurationError: MuJoCo is missing, or cannot have this robot.
        """
        library = mujoco()
        text = description(robot, surroundings, step)
        try:
            self._model: Any = library.MjModel.from_xml_string(text)
        except ValueError as error:
            raise ConfigurationError(f"robot: MuJoCo cannot simulate it: {error}") from None
        self._data: Any = library.MjData(self._model)
        self._step = library.mj_step
        geom = library.mjtObj.mjOBJ_GEOM
        self._body = library.mj_name2id(self._model, geom, "body")
        self._ground = library.mj_name2id(self._model, geom, "ground")
        self._link = library.mj_name2id(self._model, library.mjtObj.mjOBJ_BODY, "body")
        self._height = robot.body_height
        self._data.qpos[3:7] = quaternion(0.0, 0.0, surroundings.tilt)
        self._moving: Moving | None = None
        self._pushes = [(0.0, 0.0), (0.0, 0.0)]
        self.grip: Pose | None = None
        """Pose in which the hand holds the body; None where it does not."""

    def row(self) -> FloatArray:
        """Return the present state, (COLUMNS,)."""
        return np.concatenate([self._data.qpos, self._data.qvel])

    def moving(self) -> Moving:
        """Return how the robot moves."""
        if self._moving is None:
            self._moving = moving([*self._data.qpos.tolist(), *self._data.qvel.tolist()])
        return self._moving

    def pose(self) -> Pose:
        """Return where the robot is."""
        x, y, z = self._data.qpos[:3].tolist()
        now = self.moving()
        return x, y, z, now.heading, now.roll, now.tilt

    def touches(self) -> bool:
        """Return whether the body, not its wheels, touches something."""
        return bool(self._data.ncon and np.any(self._data.contact.geom == self._body))

    def set_friction(self, friction: float) -> None:
        """Change the friction of the treads on the ground."""
        self._model.geom_friction[self._ground, 0] = friction

    def push(self, forward: float, left: float = 0.0, *, outside: bool = False) -> None:
        """Push the body horizontally from now on [N], along and across its heading.

        Args:
            forward: along the heading.
            left: across it.
            outside: whether the push is not the scene's; the two add up.
        """
        self._pushes[outside] = (forward, left)
        forward, left = (sum(each) for each in zip(*self._pushes, strict=True))
        force = self._data.xfrc_applied[self._link]
        force[:] = 0.0
        if forward == left == 0.0:
            return
        now = self.moving()
        cosine, sine = np.cos(now.heading), np.sin(now.heading)
        force[:3] = forward * cosine - left * sine, forward * sine + left * cosine, 0.0
        arm = self._data.xmat[self._link].reshape(3, 3)[:, 2] * (PUSH_HEIGHT - self._height)
        force[3:] = np.cross(arm, force[:3])

    def lay_bar(self, direction: float) -> None:
        """Lay a bar across the way, `direction` 1 before the robot, -1 behind it."""
        x, y, _, heading, _, _ = self.pose()
        ahead = direction * BAR_DISTANCE
        bar = x + ahead * np.cos(heading), y + ahead * np.sin(heading), BAR_HEIGHT - BAR_RADIUS
        self._data.mocap_pos[1] = bar
        half = 0.5 * heading
        self._data.mocap_quat[1] = np.cos(half), 0.0, 0.0, np.sin(half)

    def grasp(self) -> None:
        """Let the hand take the body as it is."""
        self._move_hand(self.pose())
        self._data.eq_active[0] = 1

    def release(self) -> None:
        """Let the hand go."""
        self._data.eq_active[0] = 0
        self.grip = None

    def place(self, pose: Pose) -> None:
        """Put the robot somewhere, motionless; the wheels keep their angles against the body."""
        self._data.qpos[:3] = pose[:3]
        self._data.qpos[3:7] = quaternion(*pose[3:])
        self._data.qvel[:] = 0.0
        self._moving = None

    def advance(
        self, voltages: tuple[float, float], rows: FloatArray, grip: Pose | None = None
    ) -> None:
        """Take n steps.

        Args:
            voltages: of the left and the right motor [V].
            rows: receives the state after each step, (n, COLUMNS).
            grip: where the hand is at the end, for a body that is held.
        """
        data, model, step = self._data, self._model, self._step
        data.ctrl[:] = voltages
        self._moving = None
        positions, rates = rows[:, :9], rows[:, 9:]
        begin, count = self.grip, rows.shape[0]
        for i in range(count):
            if grip is not None and begin is not None:
                share = (i + 1) / count
                between = [b + share * (e - b) for b, e in zip(begin, grip, strict=True)]
                self._move_hand((*between,))
            step(model, data)
            positions[i] = data.qpos
            rates[i] = data.qvel

    def _move_hand(self, pose: Pose) -> None:
        self.grip = pose
        self._data.mocap_pos[0] = pose[:3]
        self._data.mocap_quat[0] = quaternion(*pose[3:])


def empty(count: int) -> FloatArray:
    """Return room for the states of `count` steps."""
    return np.empty((count, COLUMNS))
