"""The robot and its surroundings in MuJoCo's description language (MJCF).

The body is free in space, with mass, centre of mass and inertia of `Robot`; each wheel turns
about a hinge along the axle. A motor is an actuator whose torque at the wheel is
n k_m / R (u - n k_e w): voltage u, gear n, wheel against body w. Friction of the gear is a
constant torque. Wheels touch the ground at one point each, in the middle of the tread.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..robot import Robot
from ..samples import STANDARD_GRAVITY

USUAL_TRACK_WIDTH = 0.16
"""Distance between the wheels of a robot that gives none [m]."""
GEAR_FRICTION = 0.03
"""Constant friction of one motor and gear, at the wheel [N m]."""
TREAD = 0.003
"""Torsional friction of a tread that turns on the spot, as a length [m]."""
CONTACT_TIME = 0.004
"""Time constant of contacts [s]: the ground gives way by some hundredths of a millimetre."""
GRIP_TIME = 0.04
"""Time constant of the hand's hold on the body [s]."""
DEPTH = 0.6
"""Half depth of the body per wheel radius."""
BELOW = 0.5
"""Distance that the body reaches below the axle, per wheel radius."""
BAR_RADIUS = 0.02
"""Of the bar that stays under the ground until it is needed [m]."""
BODY_FRICTION = 0.5
"""Friction of the body on the ground."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Surroundings of the robot."""

    friction: float = 0.9
    """Friction of the treads on the ground."""
    obstacles: tuple[str, ...] = ()
    """Further geometry, each an element `geom`."""
    tilt: float = 0.0
    """Tilt at which the robot is set down at the start [rad]."""


def track_width(robot: Robot) -> float:
    """Return the distance between the wheels [m]."""
    return robot.track_width or USUAL_TRACK_WIDTH


def body_top(robot: Robot) -> float:
    """Return how far the body reaches above the axle [m]."""
    return max(2.0 * robot.body_height, robot.lever_arm[2] + 0.02, 1.5 * robot.wheel_radius)


def description(robot: Robot, surroundings: Surroundings, step: float) -> str:
    """Return robot and surroundings as MJCF; `step` is that of the integration [s]."""
    ground = f"{surroundings.friction} {TREAD} 0.0001"
    return f"""
<mujoco model="balancing robot">
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="10"
          gravity="0 0 {-STANDARD_GRAVITY}"><flag island="disable" midphase="disable"/></option>
  <default><geom solref="{CONTACT_TIME} 1"/></default>
  <worldbody>
    <geom name="ground" type="plane" size="0 0 1" friction="{ground}" condim="4" priority="1"/>
    {" ".join(surroundings.obstacles)}
    <body name="hand" mocap="true"/>
    <body name="bar" mocap="true" pos="0 0 -1">
      <geom type="capsule" size="{BAR_RADIUS} 0.5" euler="{0.5 * math.pi} 0 0"
            friction="{ground}" condim="4" priority="1"/>
    </body>
    {_robot(robot)}
  </worldbody>
  <equality>
    <weld name="grip" body1="hand" body2="body" relpose="0 0 0 1 0 0 0" active="false"
          solref="{GRIP_TIME} 1"/>
  </equality>
  <actuator>{_motor("left", robot)}{_motor("right", robot)}</actuator>
</mujoco>"""


def _robot(robot: Robot) -> str:
    top, bottom = body_top(robot), -BELOW * robot.wheel_radius
    half = 0.5 * track_width(robot)
    size = (DEPTH * robot.wheel_radius, 0.7 * half, 0.5 * (top - bottom))
    inertia = f"{robot.body_inertia_roll} {robot.body_inertia} {robot.body_inertia_yaw}"
    return f"""
    <body name="body" pos="0 0 {robot.wheel_radius}">
      <freejoint/>
      <inertial pos="0 0 {robot.body_height}" mass="{robot.body_mass}" diaginertia="{inertia}"/>
      <geom name="body" type="box" size="{size[0]} {size[1]} {size[2]}"
            pos="0 0 {0.5 * (top + bottom)}" friction="{BODY_FRICTION} 0.005 0.0001"
            condim="3" priority="2"/>
      {_wheel("left", half, robot)}
      {_wheel("right", -half, robot)}
    </body>"""


def _wheel(name: str, side: float, robot: Robot) -> str:
    across = robot.wheel_inertia_across
    return f"""
      <body name="{name}" pos="0 {side} 0">
        <joint name="{name}" axis="0 1 0" frictionloss="{GEAR_FRICTION}"/>
        <inertial pos="0 0 0" mass="{robot.wheel_mass}"
                  diaginertia="{across} {robot.wheel_inertia} {across}"/>
        <geom name="{name}" type="sphere" size="{robot.wheel_radius}" condim="4"/>
      </body>"""


def _motor(joint: str, robot: Robot) -> str:
    per_volt = robot.torque_constant / robot.winding_resistance
    braking = per_volt * robot.back_emf_constant
    return (
        f'<general joint="{joint}" gear="{robot.gear_ratio}" gainprm="{per_volt}" '
        f'biastype="affine" biasprm="0 0 {-braking}"/>'
    )
