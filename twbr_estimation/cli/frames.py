"""Arguments that take the IMU's mounting from a URDF or from a recording's `/tf_static`."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..bags.static_frames import FrameSource
from ..configuration.frames import Mounting


def add_frames(parser: argparse.ArgumentParser, recorded: bool) -> None:
    """Add the arguments; `recorded` where the input may hold `/tf_static`."""
    group = parser.add_argument_group("mounting of the IMU")
    group.add_argument("--urdf", type=Path, metavar="FILE", help="take it from this URDF")
    if recorded:
        group.add_argument(
            "--tf-static", action="store_true", help="take it from the recording's /tf_static"
        )
    group.add_argument(
        "--body-frame", metavar="FRAME", default="base_link", help="default: %(default)s"
    )
    group.add_argument(
        "--imu-frame", metavar="FRAME", default="imu_link", help="default: %(default)s"
    )
    group.add_argument(
        "--axle-frame",
        metavar="FRAME",
        default="",
        help="frame in the middle of the axle, from which the lever arm is taken; default: none",
    )


def frames_of(arguments: argparse.Namespace) -> FrameSource | None:
    """Return where the mounting comes from; None where it stays as configured."""
    if arguments.urdf is None and not getattr(arguments, "tf_static", False):
        return None
    names = Mounting(arguments.body_frame, arguments.imu_frame, arguments.axle_frame)
    return FrameSource(names, arguments.urdf)
