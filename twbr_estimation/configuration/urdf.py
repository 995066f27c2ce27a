"""The robot of `robot.yaml` as URDF, for robot_state_publisher, RViz and simulators.

The frames are those of the nodes: `base_link` is the body with its origin in the middle of the
axle, which `filter_node` tilts about +y below `base_footprint` where `publish_tf` is set;
`imu_link` is the frame of the Imu messages, with lever arm and mounting; the wheels turn by the
joints of `joint_states`. The root link has no inertia, because KDL allows none there: the body's
mass is that of `body_link`, fixed to it at the centre of mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ..errors import ConfigurationError
from ..robot import EncoderPlacement, Robot

BODY = "body_link"
"""Link at the body's centre of mass."""
NOMINAL_TRACK = 4.0
"""Distance between the wheels, in wheel radii, where the robot's is unknown."""
TYRE_WIDTH = 0.5
"""Width of a wheel in the picture, in wheel radii."""
THINNEST = 0.005
"""Least edge of the body in the picture [m]."""
ROUNDING = 1e-9
"""Part of a moment of inertia by which rounding may break the triangle inequality."""
COLOURS = {"body": "0.15 0.45 0.75 1", "wheel": "0.2 0.2 0.2 1", "mark": "0.9 0.9 0.9 1"}

Vector = tuple[float, float, float]
Shape = tuple[str, dict[str, str]]
"""Tag and attributes of a geometry."""
IMU_BOARD: Vector = (0.02, 0.015, 0.003)
"""Edges of the sensor's board in the picture [m]."""


@dataclass(frozen=True, slots=True)
class FrameNames:
    """Names that nodes publish; the defaults are the nodes' own."""

    base: str = "base_link"
    """`tf_child` of the filter node."""
    imu: str = "imu_link"
    """`frame_id` of the nodes that publish Imu messages."""
    wheels: tuple[str, str] = ("left_wheel_joint", "right_wheel_joint")
    """Left and right joint of `joint_states`."""


def urdf(robot: Robot, name: str = "robot", frames: FrameNames | None = None) -> str:
    """Return the URDF document of a robot.

    Args:
        robot: Geometry and mechanics.
        name: Name of the robot in the document.
        frames: Names of frames and joints; the nodes' defaults where None.

    Raises:
        ConfigurationError: moments of inertia that no rigid body has.
    """
    frames = frames or FrameNames()
    require_possible(robot)
    require_distinct(frames)
    root = Element("robot", name=name)
    for remark in _remarks(robot):
        root.append(ElementTree.Comment(f" {remark} "))
    for colour, rgba in COLOURS.items():
        SubElement(SubElement(root, "material", name=colour), "color", rgba=rgba)
    SubElement(root, "link", name=frames.base)
    _add_body(root, robot, frames.base)
    _fix(root, frames.base, frames.imu, robot.lever_arm, robot.mounting)
    _add_shape(SubElement(root, "link", name=frames.imu), "mark", _box(IMU_BOARD))
    for joint, side in zip(frames.wheels, (0.5, -0.5), strict=True):
        _add_wheel(root, robot, frames.base, joint, side * _track(robot))
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def require_possible(robot: Robot) -> None:
    """Check that no moment of inertia is above the sum of the two others.

    Raises:
        ConfigurationError: one is.
    """
    wheel = ("wheel_inertia", "wheel_inertia_across", "wheel_inertia_across")
    for names in (("body_inertia", "body_inertia_roll", "body_inertia_yaw"), wheel):
        values = {name: getattr(robot, name) for name in names}
        largest = max(values, key=values.__getitem__)
        others = [each for each in names if each != largest]
        limit = sum(getattr(robot, each) for each in others)
        if values[largest] > limit * (1.0 + ROUNDING):
            raise ConfigurationError(
                f"robot.{largest}: {values[largest]:g} kg m^2 is above "
                f"{' + '.join(f'robot.{each}' for each in others)} = {limit:g} kg m^2: "
                "no rigid body has such moments of inertia"
            )


def require_distinct(frames: FrameNames) -> None:
    """Check that every link and joint gets a name of its own.

    Raises:
        ConfigurationError: a name is empty, or two are the same.
    """
    links = [frames.base, BODY, frames.imu, *(_link_of(joint) for joint in frames.wheels)]
    for name in links:
        if not name.strip() or links.count(name) > 1:
            raise ConfigurationError(
                f"frame {name!r}: links are {', '.join(links)}; each needs a name of its own"
            )


def _remarks(robot: Robot) -> list[str]:
    """Return remarks for the reader of the document."""
    remarks = ["Written by twbr urdf from robot.yaml. Metres, kilograms, radians."]
    if robot.track_width <= 0.0:
        remarks.append(f"robot.track_width is unknown: the wheels are {_track(robot):g} m apart.")
    if robot.encoder_placement is EncoderPlacement.GROUND:
        remarks.append(
            "robot.encoder_placement is ground: in pictures the wheels turn with the tilt as well."
        )
    return remarks


def _track(robot: Robot) -> float:
    return robot.track_width or NOMINAL_TRACK * robot.wheel_radius


def _add_body(root: Element, robot: Robot, base: str) -> None:
    moments = (robot.body_inertia_roll, robot.body_inertia, robot.body_inertia_yaw)
    _fix(root, base, BODY, (0.0, 0.0, robot.body_height))
    link = SubElement(root, "link", name=BODY)
    _add_inertia(link, robot.body_mass, moments)
    _add_shape(link, "body", _box(edges(robot.body_mass, moments)), collides=True)


def edges(mass: float, moments: Vector) -> Vector:
    """Return the edges [m] of the solid box of this mass [kg] with these moments [kg m^2]."""
    total = sum(moments)
    x, y, z = (math.sqrt(max(0.0, 6.0 * (total - 2.0 * each) / mass)) for each in moments)
    return (max(THINNEST, x), max(THINNEST, y), max(THINNEST, z))


def _add_wheel(root: Element, robot: Robot, base: str, joint: str, y: float) -> None:
    child = _link_of(joint)
    _join(root, "continuous", joint, base, child, (0.0, y, 0.0))
    SubElement(root[-1], "axis", xyz="0 1 0")
    link = SubElement(root, "link", name=child)
    across = robot.wheel_inertia_across
    _add_inertia(link, robot.wheel_mass, (across, robot.wheel_inertia, across))
    radius, width = robot.wheel_radius, TYRE_WIDTH * robot.wheel_radius
    _add_shape(link, "wheel", _cylinder(radius, width), (0.5 * math.pi, 0.0, 0.0), True)
    _add_shape(link, "mark", _box((1.6 * radius, 1.1 * width, 0.2 * radius)))


def _link_of(joint: str) -> str:
    return f"{joint.removesuffix('_joint')}_link"


def _fix(
    root: Element, parent: str, child: str, xyz: Vector, rpy: Vector = (0.0, 0.0, 0.0)
) -> None:
    _join(root, "fixed", f"{child.removesuffix('_link')}_joint", parent, child, xyz, rpy)


def _join(
    root: Element,
    kind: str,
    name: str,
    parent: str,
    child: str,
    xyz: Vector,
    rpy: Vector = (0.0, 0.0, 0.0),
) -> None:
    joint = SubElement(root, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    SubElement(joint, "origin", xyz=_text(xyz), rpy=_text(rpy))


def _add_inertia(link: Element, mass: float, moments: Vector) -> None:
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "mass", value=_number(mass))
    names = {f"i{2 * axis}": _number(each) for axis, each in zip("xyz", moments, strict=True)}
    SubElement(inertial, "inertia", {**names, "ixy": "0", "ixz": "0", "iyz": "0"})


def _add_shape(
    link: Element,
    colour: str,
    shape: Shape,
    rpy: Vector = (0.0, 0.0, 0.0),
    collides: bool = False,
) -> None:
    for kind in ("visual", "collision") if collides else ("visual",):
        element = SubElement(link, kind)
        SubElement(element, "origin", xyz="0 0 0", rpy=_text(rpy))
        SubElement(SubElement(element, "geometry"), *shape)
        if kind == "visual":
            SubElement(element, "material", name=colour)


def _box(edges: Vector) -> Shape:
    return "box", {"size": _text(edges)}


def _cylinder(radius: float, length: float) -> Shape:
    return "cylinder", {"radius": _number(radius), "length": _number(length)}


def _text(values: Vector) -> str:
    return " ".join(_number(each) for each in values)


def _number(value: float) -> str:
    return f"{value:.9g}"
