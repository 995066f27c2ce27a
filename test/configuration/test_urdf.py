"""The URDF of a robot, read back by MuJoCo, which has a parser of its own."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from twbr_estimation.cli.main import main
from twbr_estimation.configuration.urdf import FrameNames, edges, urdf
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.robot import EncoderPlacement, Robot

ROBOT = Robot(
    wheel_radius=0.05,
    track_width=0.2,
    lever_arm=(0.01, -0.02, 0.11),
    mounting=(0.3, -0.4, 2.0),
    body_mass=1.7,
    body_height=0.12,
)


@pytest.fixture(scope="module")
def model() -> Any:
    """Return ROBOT as MuJoCo reads it, every link kept."""
    mujoco = pytest.importorskip("mujoco", reason="needs the extra physics")
    root = ElementTree.fromstring(urdf(ROBOT))
    ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler", fusestatic="false")
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))


def placed(model: Any, link: str, **angles: float) -> tuple[Any, Any]:
    """Return position and rotation of a link with the joints at these angles [rad]."""
    import mujoco

    data = mujoco.MjData(model)
    for joint, angle in angles.items():
        data.joint(joint).qpos[0] = angle
    mujoco.mj_kinematics(model, data)
    return data.body(link).xpos, data.body(link).xmat.reshape(3, 3)


def test_the_sensor_is_where_the_robot_has_it(model: Any) -> None:
    position, rotation = placed(model, "imu_link")
    np.testing.assert_allclose(position, ROBOT.lever_arm, atol=1e-9)
    np.testing.assert_allclose(rotation, ROBOT.rotation(), atol=1e-7)


def test_masses_and_moments_are_those_of_the_robot(model: Any) -> None:
    assert model.body("body_link").mass[0] == ROBOT.body_mass
    moments = sorted((ROBOT.body_inertia, ROBOT.body_inertia_roll, ROBOT.body_inertia_yaw))
    assert sorted(model.body("body_link").inertia) == pytest.approx(moments)
    wheel = model.body("left_wheel_link")
    assert wheel.mass[0] == ROBOT.wheel_mass
    across = ROBOT.wheel_inertia_across
    assert sorted(wheel.inertia) == pytest.approx([across, across, ROBOT.wheel_inertia])
    position, _ = placed(model, "body_link")
    np.testing.assert_allclose(position, (0.0, 0.0, ROBOT.body_height))


@pytest.mark.parametrize(("side", "y"), [("left", 0.1), ("right", -0.1)])
def test_a_positive_angle_rolls_a_wheel_forward(model: Any, side: str, y: float) -> None:
    position, rotation = placed(model, f"{side}_wheel_link", **{f"{side}_wheel_joint": 0.1})
    np.testing.assert_allclose(position, (0.0, y, 0.0))
    top = rotation @ (0.0, 0.0, 1.0)
    np.testing.assert_allclose(top, (math.sin(0.1), 0.0, math.cos(0.1)), atol=1e-9)


def test_the_root_has_no_inertia_and_every_other_link_one_parent() -> None:
    root = ElementTree.fromstring(urdf(Robot()))
    links = [link.get("name") for link in root.iter("link")]
    children = [joint.find("child").get("link") for joint in root.iter("joint")]
    assert links[0] == "base_link" and sorted(children) == sorted(links[1:])
    assert root.find("link[@name='base_link']/inertial") is None


def test_the_body_is_drawn_as_the_box_of_its_moments() -> None:
    x, y, z = edges(2.0, (2.0 / 12.0 * 0.13, 2.0 / 12.0 * 0.1, 2.0 / 12.0 * 0.05))
    assert (x * x, y * y, z * z) == pytest.approx((0.01, 0.04, 0.09))


def test_moments_that_no_body_has_are_refused() -> None:
    robot = Robot(body_inertia=0.02, body_inertia_roll=0.006, body_inertia_yaw=0.002)
    with pytest.raises(ConfigurationError, match=r"robot\.body_inertia: 0\.02 .* 0\.008"):
        urdf(robot)
    with pytest.raises(ConfigurationError, match=r"robot\.wheel_inertia: "):
        urdf(Robot(wheel_inertia=1e-3))


@pytest.mark.parametrize("frames", [FrameNames(base=""), FrameNames(wheels=("a_joint", "a"))])
def test_links_need_names_of_their_own(frames: FrameNames) -> None:
    with pytest.raises(ConfigurationError, match="name of its own"):
        urdf(Robot(), frames=frames)


def test_what_is_assumed_is_said() -> None:
    assert "0.15 m apart" in urdf(Robot())
    assert "apart" not in urdf(ROBOT)
    assert "ground" in urdf(replace(ROBOT, encoder_placement=EncoderPlacement.GROUND))


def test_the_names_are_those_of_the_nodes() -> None:
    from twbr_estimation.streams.inputs import InputSettings

    inputs, frames = InputSettings(), FrameNames()
    assert frames.wheels == (inputs.left_wheel_joint, inputs.right_wheel_joint)


def test_frames_are_those_of_the_nodes() -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    from twbr_estimation.nodes.inputs import IMU_FRAME
    from twbr_estimation.nodes.tilt_transform import DECLARATIONS

    defaults = {each.name: each.default for each in DECLARATIONS}
    assert FrameNames().base == defaults["tf_child"]
    assert FrameNames().imu == IMU_FRAME.default


def test_the_command_reads_a_file_a_folder_or_a_recording(tmp_path: Path, capsys: Any) -> None:
    bag = Path(__file__).resolve().parent.parent.parent / "bags" / "verification"
    printed = []
    for path in (bag / "config" / "robot.yaml", bag / "config", bag):
        assert main(["urdf", str(path)]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1] == printed[2] and "left_wheel_joint" in printed[0]
    target = tmp_path / "robot.urdf"
    assert main(["urdf", str(bag), "-o", str(target)]) == 0
    assert target.read_text() == printed[0]
    assert main(["urdf", "-o", str(target)]) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert target.read_text() == printed[0]


def test_the_command_needs_a_robot_and_two_wheels(tmp_path: Path, capsys: Any) -> None:
    assert main(["urdf", str(tmp_path)]) == 1
    assert "robot.yaml" in capsys.readouterr().err
    assert main(["urdf", "--wheel-joints", "wheel_joint"]) == 1
    assert "LEFT,RIGHT" in capsys.readouterr().err
