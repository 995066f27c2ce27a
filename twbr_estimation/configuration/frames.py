"""How the IMU sits in the robot, from frames: a URDF, or the transforms of `/tf_static`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigurationError
from ..robot import Robot

LARGEST_URDF = 20_000_000
"""Larger files are no robot's description [bytes]."""
DEEPEST = 1000
"""Frames between a sensor and the root of its tree, at most."""
Matrix = NDArray[np.float64]


class Transform(NamedTuple):
    """Where a frame sits in its parent."""

    parent: str
    child: str
    rotation: Matrix
    """Turns coordinates of the child into those of the parent, (3, 3)."""
    translation: Matrix
    """Origin of the child in the parent [m], (3,)."""


class Mounting(NamedTuple):
    """The names of the frames that say how the IMU sits."""

    body: str
    """x forward, y left, z up, fixed to the body."""
    sensor: str
    """That of the IMU's axes."""
    axle: str = ""
    """Its origin is the middle of the axle; empty keeps the lever arm."""


def mounted(robot: Robot, frames: Iterable[Transform], names: Mounting) -> Robot:
    """Return the robot with the IMU as the frames have it.

    Args:
        robot: everything else.
        frames: any number of transforms; the last of a child counts.
        names: of the frames.

    Raises:
        ConfigurationError: a frame that is not there, or not connected to the others.
    """
    known = {_bare(each.child): each for each in frames}
    rotation, _ = _between(known, names.body, names.sensor)
    found = replace(robot, mounting=_angles(rotation))
    if not names.axle:
        return found
    _, arm = _between(known, names.axle, names.sensor)
    to_body, _ = _between(known, names.body, names.axle)
    x, y, z = (round(float(each), 9) for each in to_body @ arm)
    return replace(found, lever_arm=(x, y, z))


def _bare(name: str) -> str:
    return name.lstrip("/")


def _angles(rotation: Matrix) -> tuple[float, float, float]:
    """Return roll, pitch, yaw about fixed axes [rad]."""
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[2, 1], rotation[2, 2]))
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    return round(roll, 9), round(pitch, 9), round(yaw, 9)


def _between(known: Mapping[str, Transform], base: str, target: str) -> tuple[Matrix, Matrix]:
    """Return rotation and origin of `target` in `base`."""
    base_root, base_rotation, base_origin = _from_root(known, _bare(base))
    root, rotation, origin = _from_root(known, _bare(target))
    if root != base_root:
        there = ", ".join(sorted({*known, *(_bare(each.parent) for each in known.values())}))
        raise ConfigurationError(
            f"frame {target!r} is not connected to {base!r}; there are: {there or 'none'}"
        )
    return base_rotation.T @ rotation, base_rotation.T @ (origin - base_origin)


def _from_root(known: Mapping[str, Transform], name: str) -> tuple[str, Matrix, Matrix]:
    """Return the root of a frame's tree, and rotation and origin of the frame in it."""
    rotation, origin = np.eye(3), np.zeros(3)
    for _ in range(DEEPEST):
        if name not in known:
            return name, rotation, origin
        step = known[name]
        rotation = step.rotation @ rotation
        origin = step.rotation @ origin + step.translation
        name = _bare(step.parent)
    raise ConfigurationError(f"frame {name!r} is its own parent, some frames away")


def of_quaternion(x: float, y: float, z: float, w: float) -> Matrix:
    """Return the rotation of a quaternion; one without length is no rotation."""
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not math.isfinite(norm) or norm == 0.0:
        raise ConfigurationError(f"quaternion ({x:g}, {y:g}, {z:g}, {w:g}) is no rotation")
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def urdf_frames(path: Path) -> tuple[Transform, ...]:
    """Return the frames of a URDF file, its joints at 0.

    Raises:
        ConfigurationError: a file that cannot be read or is no URDF.
    """
    try:
        if path.stat().st_size > LARGEST_URDF:
            raise ConfigurationError(f"{path}: above {LARGEST_URDF} bytes, no robot description")
        text = path.read_bytes()
    except OSError as error:
        raise ConfigurationError(f"{path}: {error.strerror}") from None
    try:
        if b"<!ENTITY" in text:
            raise ConfigurationError(f"{path}: XML entities are not read")
        tree = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ConfigurationError(f"{path}: no URDF: {error}") from None
    frames = tuple(_joints(path, tree))
    if not frames:
        hint = "; run xacro on it first" if path.suffix == ".xacro" else ""
        raise ConfigurationError(f"{path}: no URDF: there is no joint{hint}")
    return frames


def _joints(path: Path, tree: ElementTree.Element) -> Iterator[Transform]:
    for joint in tree.iter("joint"):
        parent, child, origin = (joint.find(name) for name in ("parent", "child", "origin"))
        if parent is None or child is None:
            continue
        attributes: Mapping[str, str] = {} if origin is None else origin.attrib
        turn = Robot(mounting=_three(path, attributes, "rpy"))
        yield Transform(
            parent.get("link", ""),
            child.get("link", ""),
            turn.rotation(),
            np.array(_three(path, attributes, "xyz")),
        )


def _three(path: Path, attributes: Mapping[str, Any], name: str) -> tuple[float, float, float]:
    words: Sequence[str] = str(attributes.get(name, "0 0 0")).split()
    try:
        x, y, z = (float(word) for word in words)
    except ValueError:
        raise ConfigurationError(
            f"{path}: {name}={' '.join(words)!r} are not three numbers; run xacro on it first"
        ) from None
    return x, y, z
