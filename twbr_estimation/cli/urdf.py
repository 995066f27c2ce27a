"""`twbr urdf [CONFIG]`: robot.yaml as URDF, for RViz and robot_state_publisher."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..configuration.files import read_setup
from ..configuration.of_recording import CONFIG_FOLDER
from ..configuration.urdf import FrameNames, urdf
from ..disk.reading import is_folder
from ..disk.writing import write_text
from ..errors import ConfigurationError
from ..printing.text import say
from ..robot import Robot

FILE = "robot.yaml"


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "urdf",
        description="Print the robot as URDF: body, wheels and IMU, in the frames and with the "
        "joints that the nodes publish.",
    )
    parser.add_argument(
        "config",
        nargs="?",
        type=Path,
        metavar="CONFIG",
        help="robot.yaml, a folder that holds it, or a recording; default: the default robot",
    )
    defaults = FrameNames()
    parser.add_argument("--name", default="robot", help="of the robot; default: %(default)s")
    parser.add_argument(
        "--base-frame",
        default=defaults.base,
        metavar="FRAME",
        help="tf_child of filter_node; default: %(default)s",
    )
    parser.add_argument(
        "--imu-frame",
        default=defaults.imu,
        metavar="FRAME",
        help="frame_id of the IMU; default: %(default)s",
    )
    parser.add_argument(
        "--wheel-joints",
        default=",".join(defaults.wheels),
        metavar="LEFT,RIGHT",
        help="joints of joint_states; default: %(default)s",
    )
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: print it")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print or write the document."""
    wheels = arguments.wheel_joints.split(",")
    if len(wheels) != 2:
        raise ConfigurationError(f"--wheel-joints {arguments.wheel_joints}: is not LEFT,RIGHT")
    frames = FrameNames(arguments.base_frame, arguments.imu_frame, (wheels[0], wheels[1]))
    text = urdf(_robot(arguments.config), arguments.name, frames)
    if arguments.output is None:
        say(text, end="")
        return 0
    if arguments.output.exists() and not arguments.overwrite:
        raise ConfigurationError(f"{arguments.output}: exists already; --overwrite replaces it")
    write_text(arguments.output, text)
    say(str(arguments.output))
    return 0


def _robot(path: Path | None) -> Robot:
    """Return the robot that a file, a folder or a recording describes."""
    if path is None:
        return Robot()
    if is_folder(path):
        found = [folder / FILE for folder in (path, path / CONFIG_FOLDER)]
        files = [file for file in found if file.is_file()]
        if not files:
            raise ConfigurationError(f"{path}: holds neither {FILE} nor {CONFIG_FOLDER}/{FILE}")
        path = files[0]
    return read_setup(path).robot
