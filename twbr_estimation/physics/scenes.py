"""The scenes: what happens to the robot, again and again with other numbers until time is up."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from .hand import Reach
from .model import Surroundings
from .stage import YAW_ACCELERATION, Order, Script, Stage

WALL = 0.4
"""Distance of the wall from the start [m]."""
RAMP_START, RAMP_LENGTH, RAMP_SLOPE = 0.4, 1.6, 8.0
"""[m], [m], [deg]."""
BUMPS = 12
CARRYING = Reach(along=0.1, up=0.04, turn=0.5, roll=0.15, tilt=0.18)


class Scene(NamedTuple):
    """One scene."""

    summary: str
    """One line for the command's help."""
    script: Callable[[Stage], Script]
    surroundings: Callable[[np.random.Generator], Surroundings] = lambda random: Surroundings()
    prelude: float = 0.0
    """Time before the recording in which the robot falls over [s]."""


def _stand(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(1.0)


def _drive(stage: Stage) -> Script:
    yield from stage.balanced(1.0)
    while True:
        speed, turn = stage.between(-0.6, 0.6), stage.between(-1.5, 1.5)
        yield from stage.balanced(stage.between(0.6, 2.0), speed, turn, acceleration=2.0)


def _pushes(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(1.0, 2.5))
        force = stage.side() * stage.between(1.5, 5.5)
        yield from stage.pushed(force, stage.between(0.08, 0.35), stage.between(-0.5, 0.5))


def _fall(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(3.0, 4.0))
        yield from stage.pushed(stage.side() * stage.between(12.0, 16.0), 0.25)
        yield from stage.lain(stage.between(2.0, 3.5))
        yield from stage.stood_up()
        yield from stage.balanced(stage.between(5.0, 6.0))


def _starts_lying(stage: Stage) -> Script:
    yield from stage.lain(stage.between(2.5, 4.0))
    yield from stage.stood_up()
    yield from _drive(stage)


def _lifted(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(3.0, 4.0), stage.between(-0.2, 0.2))
        x, y, z, heading, roll, tilt = stage.taken()
        x, y = x + stage.between(-0.2, 0.2), y + stage.between(-0.2, 0.2)
        over = (x, y, z + stage.between(0.1, 0.2), heading, roll, tilt)
        yield from stage.moved("lifted", over, 0.4, voltages=None)
        reach, time = Reach(0.02, 0.01, 0.1, 0.05, 0.05), stage.between(1.5, 2.5)
        yield from stage.moved("lifted", over, time, reach, voltages=None)
        yield from stage.put_down("lifted", (x, y), heading, 0.5)
        yield from stage.balanced(stage.between(5.0, 6.0))


def _carry(stage: Stage, running: bool) -> Script:
    x, y, z, heading, _, _ = stage.taken()
    up = (x, y, z + stage.between(0.3, 0.6), heading, 0.0, stage.between(-0.3, 0.3))
    yield from stage.moved("carried", up, 0.8)
    aim = (
        x + stage.between(-1.5, 1.5),
        y + stage.between(-1.5, 1.5),
        up[2],
        heading + stage.between(-1.5, 1.5),
        0.0,
        0.0,
    )
    turn, frequency = stage.between(2.0, 6.0), stage.between(0.1, 0.4)
    for i, order in enumerate(stage.moved("carried", aim, stage.between(7.0, 9.0), CARRYING)):
        wave = turn * math.sin(2.0 * math.pi * frequency * 0.005 * i) if running else 0.0
        yield order._replace(voltages=(wave, wave))
    yield from stage.put_down("carried", (aim[0], aim[1]), aim[3], 1.0)


def _carried(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(3.0, 4.0))
        yield from _carry(stage, running=False)
        yield from stage.balanced(stage.between(5.0, 6.0))


def _carried_running(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(3.0, 4.0))
        yield from _carry(stage, running=True)
        yield from stage.balanced(stage.between(5.0, 6.0))


def _wall(stage: Stage) -> Script:
    """Hold the robot against the wall by hand, its wheels turning over the ground."""
    while True:
        yield from stage.balanced(stage.between(2.0, 3.0))
        for order in stage.balanced(3.0, speed=0.3):
            if stage.engine.pose()[0] > WALL - 0.1:
                break
            yield order
        _, y, z, heading, _, _ = stage.taken()
        lean, voltage = stage.between(0.1, 0.35), stage.between(2.0, 4.0)
        held = (WALL - 0.15 * math.sin(lean) - 0.03, y, z, heading, 0.0, lean)
        yield from stage.moved("wall", held, 0.4)
        for _ in range(3):
            both, time = (voltage, voltage), stage.between(0.8, 1.5)
            yield from stage.moved("wall", held, time, voltages=both)
            voltage *= -1.0 if stage.random.random() < 0.5 else 1.0
        yield from _back(stage)
        yield from stage.balanced(stage.between(5.0, 6.0))


def _back(stage: Stage) -> Script:
    """Take the robot from where it is and stand it at the start."""
    heading = stage.taken()[3]
    yield from stage.moved("held", (0.0, 0.0, stage.height + 0.05, heading, 0.0, 0.0), 1.0)
    yield from stage.put_down("held", (0.0, 0.0), 0.0)


def _leaning(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(2.0, 3.0))
        near = stage.between(0.055, 0.075)
        for order in stage.balanced(6.0, speed=0.1):
            if stage.engine.pose()[0] > WALL - near:
                break
            yield order
        stage.mark("leaning", True)
        for _ in range(2000):
            if stage.fallen:
                break
            yield Order(voltages=(0.0, 0.0))
        stage.mark("leaning", False)
        yield from _back(stage)
        yield from stage.balanced(stage.between(4.0, 5.0))


def _wall_ahead(random: np.random.Generator) -> Surroundings:
    wall = (
        f'<geom type="box" size="0.05 2 0.5" pos="{WALL + 0.05} 0 0.5" friction="0.2 0.005 0.0001"'
        ' priority="3"/>'
    )
    return Surroundings(obstacles=(wall,))


def _ramp(stage: Stage) -> Script:
    stage.home = (0.0, 0.0)
    while True:
        yield from stage.balanced(stage.between(1.0, 2.0))
        time, speed = stage.between(3.0, 4.0), stage.between(0.25, 0.4)
        yield from stage.balanced(time, speed)
        yield from stage.balanced(stage.between(0.5, 1.5))
        yield from stage.balanced(time, -speed)


def _ramp_ahead(random: np.random.Generator) -> Surroundings:
    slope = math.radians(RAMP_SLOPE)
    half, thick = 0.5 * RAMP_LENGTH, 0.1
    x = RAMP_START + half * math.cos(slope) + thick * math.sin(slope)
    z = half * math.sin(slope) - thick * math.cos(slope)
    ramp = (
        f'<geom type="box" size="{half} 2 {thick}" pos="{x} 0 {z}" euler="0 {-slope} 0"'
        ' friction="0.9 0.003 0.0001" condim="4" priority="1"/>'
    )
    return Surroundings(obstacles=(ramp,))


def _bumps(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(0.5, 1.0))
        time, speed = stage.between(2.0, 3.0), stage.between(0.25, 0.5)
        yield from stage.balanced(time, speed)
        yield from stage.balanced(time, -speed)


def _bumps_around(random: np.random.Generator) -> Surroundings:
    """Return bars of 2 to 5 mm on the ground, under both wheels or one."""
    bars = []
    for _ in range(BUMPS):
        height, radius = random.uniform(0.002, 0.005), 0.02
        x, side = random.choice([-1.0, 1.0]) * random.uniform(0.1, 1.2), random.integers(-1, 2)
        length = 2.0 if side == 0 else 0.04
        bars.append(
            f'<geom type="capsule" size="{radius} {length}" pos="{x} {0.08 * side} '
            f'{height - radius}" euler="{0.5 * math.pi} 0 0" friction="0.9 0.003 0.0001" '
            'condim="4" priority="1"/>'
        )
    return Surroundings(obstacles=tuple(bars))


def _ice(stage: Stage) -> Script:
    while True:
        speed = stage.between(-0.5, 0.5)
        yield from stage.balanced(stage.between(1.0, 2.0), speed)
        stage.engine.set_friction(stage.between(0.03, 0.15))
        stage.mark("ice", True)
        for order in stage.balanced(stage.between(0.2, 0.6), -speed, acceleration=1.5):
            if stage.fallen:
                break
            yield order
        stage.engine.set_friction(Surroundings().friction)
        stage.mark("ice", False)
        yield from stage.balanced(stage.between(2.5, 4.0))


def _spin(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(2.0, 3.0))
        rate = stage.side() * stage.between(6.0, 10.0)
        stage.mark("spinning", True)
        yield from stage.balanced(stage.between(4.0, 5.0), yaw_rate=rate)
        yield from stage.balanced(abs(rate) / YAW_ACCELERATION)
        stage.mark("spinning", False)


def _acceleration(stage: Stage) -> Script:
    yield from stage.balanced(1.0)
    while True:
        speed = stage.side() * stage.between(0.6, 1.2)
        yield from stage.balanced(stage.between(0.6, 1.2), speed, acceleration=2.5)
        yield from stage.balanced(stage.between(0.6, 1.2), -speed, acceleration=2.5)
        yield from stage.balanced(stage.between(0.5, 1.0))


def _upside_down(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(2.0, 3.0))
        x, y, z, heading, _, _ = stage.taken()
        turned = stage.side() * math.pi
        yield from stage.moved("carried", (x, y, z + 0.4, heading, 0.0, turned), 1.5)
        yield from stage.moved("upside down", (x, y, z + 0.4, heading, 0.0, turned), 3.0)
        yield from stage.moved("carried", (x, y, z + 0.3, heading, 0.0, 0.0), 1.5)
        yield from stage.put_down("carried", (x, y), heading)
        yield from stage.balanced(stage.between(5.0, 6.0))


def _dropped(stage: Stage) -> Script:
    while True:
        yield from stage.balanced(stage.between(2.0, 3.0))
        x, y, z, heading, _, _ = stage.taken()
        up = (x, y, z + stage.between(0.03, 0.08), heading, 0.0, 0.0)
        yield from stage.moved("held", up, 0.6)
        yield from stage.moved("held", up, 0.3)
        stage.let_go()
        stage.mark("airborne", True)
        for _ in range(40):
            yield Order(voltages=(0.0, 0.0))
        stage.mark("airborne", False)
        yield from stage.balanced(stage.between(3.0, 4.0))


SCENES: Mapping[str, Scene] = MappingProxyType(
    {
        "stand": Scene("balances on the spot", _stand),
        "drive": Scene("drives and turns", _drive),
        "pushes": Scene("balances against pushes", _pushes),
        "fall": Scene("is pushed over, lies, is stood up by hand", _fall),
        "starts_lying": Scene("lies at the start and is stood up", _starts_lying, prelude=2.5),
        "lifted": Scene("is lifted for 2 s while its wheels run, and put down", _lifted),
        "carried": Scene("is carried by hand with its motors off", _carried),
        "carried_running": Scene("is carried by hand while its wheels run", _carried_running),
        "wall": Scene("is held against a wall while its wheels turn", _wall, _wall_ahead),
        "leaning": Scene("leans motionless against a wall", _leaning, _wall_ahead),
        "ramp": Scene(f"drives up and down a ramp of {RAMP_SLOPE:g} deg", _ramp, _ramp_ahead),
        "bumps": Scene("drives over bars of 2 to 5 mm", _bumps, _bumps_around),
        "ice": Scene("drives over slippery patches", _ice),
        "spin": Scene("spins on the spot at 6 to 10 rad/s", _spin),
        "acceleration": Scene("accelerates as hard as it can", _acceleration),
        "upside_down": Scene("is held upside down", _upside_down),
        "dropped": Scene("is dropped from 3 to 8 cm", _dropped),
    }
)
"""Every scene by name."""
