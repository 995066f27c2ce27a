"""The IMU's mounting from frames: URDF, /tf_static, and back."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.bags.static_frames import decode_transforms
from twbr_estimation.configuration.frames import (
    Mounting,
    Transform,
    mounted,
    of_quaternion,
    urdf_frames,
)
from twbr_estimation.configuration.urdf import urdf
from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.robot import Robot

NAMES = Mounting("base_link", "imu_link", "base_link")
TURNED = Robot(mounting=(0.1, -0.2, 2.5), lever_arm=(0.01, -0.02, 0.07))


def test_the_urdf_of_a_robot_gives_its_mounting_back(tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(urdf(TURNED), encoding="utf-8")
    found = mounted(Robot(), urdf_frames(file), NAMES)
    assert found.mounting == pytest.approx(TURNED.mounting)
    assert found.lever_arm == pytest.approx(TURNED.lever_arm)


def test_frames_are_followed_over_common_parents() -> None:
    """The chip sits upside down on a board, the board beside the axle, both on a chassis."""
    half = math.pi / 2
    about_z = Robot(mounting=(0.0, 0.0, half)).rotation()
    over = Robot(mounting=(math.pi, 0.0, 0.0)).rotation()
    frames = [
        Transform("chassis", "base_link", about_z, np.array([1.0, 0.0, 0.0])),
        Transform("/chassis", "board", about_z, np.array([1.0, 0.1, 0.2])),
        Transform("board", "imu_link", over, np.array([0.0, 0.0, 0.01])),
        Transform("base_link", "axle", np.eye(3), np.array([0.0, 0.0, -0.03])),
    ]
    found = mounted(Robot(), frames, Mounting("base_link", "imu_link", "axle"))
    assert np.abs(found.mounting) == pytest.approx([math.pi, 0.0, 0.0])
    assert found.lever_arm == pytest.approx((0.1, 0.0, 0.24))
    kept = mounted(Robot(), frames, Mounting("base_link", "imu_link"))
    assert kept.lever_arm == Robot().lever_arm


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<robot/>", "no URDF: there is no joint"),
        ("no XML", "no URDF"),
        ("<!DOCTYPE x [<!ENTITY a 'b'>]><robot/>", "entities"),
        (
            '<robot><joint><parent link="a"/><child link="b"/><origin rpy="${pi} 0 0"/></joint>'
            "</robot>",
            "not three numbers; run xacro",
        ),
        ('<robot><joint><parent link="a"/><child link="b"/></joint></robot>', "not connected"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said):
        mounted(Robot(), urdf_frames(file), NAMES)


def test_circles_and_empty_quaternions_are_refused() -> None:
    circle = [
        Transform("a", "b", np.eye(3), np.zeros(3)),
        Transform("b", "a", np.eye(3), np.zeros(3)),
    ]
    with pytest.raises(ConfigurationError, match="its own parent"):
        mounted(Robot(), circle, Mounting("a", "b"))
    with pytest.raises(ConfigurationError, match="no rotation"):
        of_quaternion(0.0, 0.0, 0.0, 0.0)


def serialised(*frames: tuple[str, str, tuple[float, ...]]) -> bytes:
    """Return a TFMessage in XCDR version 1, written by hand."""
    data = bytearray(struct.pack("<I", len(frames)))
    for parent, child, values in frames:
        data += b"\0" * (-len(data) % 4) + struct.pack("<iI", 0, 0)
        for name in (parent, child):
            text = name.encode() + b"\0"
            data += b"\0" * (-len(data) % 4) + struct.pack("<I", len(text)) + text
        data += b"\0" * (-len(data) % 8) + struct.pack("<7d", *values)
    return b"\x00\x01\x00\x00" + bytes(data)


def test_recorded_transforms_are_read() -> None:
    half = math.sqrt(0.5)
    data = serialised(
        ("base_link", "plate", (0.0, 0.0, 0.05, 0.0, 0.0, 0.0, 1.0)),
        ("plate", "imu_link", (0.0, 0.0, 0.02, 0.0, 0.0, half, half)),
    )
    found = mounted(Robot(), decode_transforms(data), NAMES)
    assert found.mounting == pytest.approx((0.0, 0.0, math.pi / 2))
    assert found.lever_arm == pytest.approx((0.0, 0.0, 0.07))
    with pytest.raises(RecordingError, match="cannot be read"):
        decode_transforms(data[:-20])
