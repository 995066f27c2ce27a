"""`twbr simulate -o BAG`: a recording of a simulated robot, with its truth."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.markup import escape
from rich.table import Table

from ..bags import require_room, write_recording
from ..bags.events import write_events
from ..configuration.files import read_setup, write_section
from ..configuration.of_recording import CONFIG_FOLDER
from ..errors import ConfigurationError
from ..physics import SCENES as PHYSICS_SCENES
from ..physics import simulate as simulate_scene
from ..physics.simulate import USUAL_DURATION
from ..printing.console import SafeConsole
from ..robot import Robot
from ..simulation import WORLDS, Simulated, simulate

RIG, MUJOCO = "rig", "mujoco"
RIG_DURATION = 60.0
"""Length of a recording of the rig [s]."""


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    scenes = "; ".join(f"{name}: {scene.summary}" for name, scene in PHYSICS_SCENES.items())
    worlds = "; ".join(f"{world.name}: {world.summary}" for world in WORLDS.values())
    parser = subparsers.add_parser(
        "simulate",
        description="Simulate a balancing robot with its sensors. The same arguments make the "
        f"same recording. Worlds: {worlds}. Scenes of MuJoCo: {scenes}.",
    )
    parser.add_argument(
        "--physics",
        choices=(RIG, MUJOCO),
        default=RIG,
        help="the project's own rig, or the physics engine MuJoCo (extra `physics`), in which the "
        "world is that of the sensors and the scene that of the ground; default: rig",
    )
    parser.add_argument("--world", choices=tuple(WORLDS), default="paper", help="default: paper")
    parser.add_argument(
        "--scene",
        default="drive",
        metavar="NAME",
        help="of the rig: drive through disturbances, still, or poses, held at angles; or, without "
        "wheels, the stand of Chudzik 2021: static, vibrating, pendulum, jerking; of MuJoCo: "
        f"{', '.join(PHYSICS_SCENES)}; default: drive",
    )
    parser.add_argument(
        "--dt", type=float, default=0.002, metavar="SECONDS", help="default: %(default)s"
    )
    parser.add_argument(
        "--duration",
        type=float,
        metavar="SECONDS",
        help=f"default: {RIG_DURATION:g}, of a scene in MuJoCo {USUAL_DURATION:g}",
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="default: %(default)s")
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="BAG", help="recording to write"
    )
    parser.add_argument(
        "--no-truth", action="store_true", help="leave the true tilt out, for a smaller recording"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace an existing recording")
    group = parser.add_argument_group("in MuJoCo only")
    group.add_argument(
        "--config", type=Path, metavar="DIR", help="folder with the robot.yaml to simulate"
    )
    group.add_argument(
        "--clip-first",
        action="store_true",
        help="let the IMU clip before its low-pass, so that no reading stands at the limit",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, write the recording with the robot's description, and print a summary."""
    require_room(arguments.output, arguments.overwrite)
    simulated = simulated_by(arguments)
    stored = simulated
    if arguments.no_truth:
        stored = replace(simulated, recording=replace(simulated.recording, truth=None))
    write_simulated(arguments.output, stored, overwrite=arguments.overwrite)
    SafeConsole().print(_summary(arguments.output, simulated))
    return 0


def simulated_by(arguments: argparse.Namespace) -> Simulated:
    """Return the simulation of the command line.

    Raises:
        ConfigurationError: something that cannot be simulated.
    """
    world, dt, seed, scene = arguments.world, arguments.dt, arguments.seed, arguments.scene
    if arguments.physics == MUJOCO:
        robot = None if arguments.config is None else robot_of(arguments.config)
        length = USUAL_DURATION if arguments.duration is None else arguments.duration
        return simulate_scene(
            scene, dt, length, seed, world=world, robot=robot, clipped_first=arguments.clip_first
        )
    if arguments.config is not None or arguments.clip_first:
        raise ConfigurationError("--config and --clip-first: need --physics mujoco")
    length = RIG_DURATION if arguments.duration is None else arguments.duration
    return simulate(world, dt, length, seed, scene)


def robot_of(folder: Path) -> Robot:
    """Return the robot that a configuration folder describes.

    Raises:
        ConfigurationError: no such folder, or a file that cannot be used.
    """
    if not folder.is_dir():
        raise ConfigurationError(f"{folder}: there is no such configuration folder")
    return read_setup(folder).robot


def write_simulated(path: Path, simulated: Simulated, *, overwrite: bool = False) -> None:
    """Write a recording with `config/` (robot.yaml, calibration.yaml) and events beside it.

    Args:
        path: directory to create.
        simulated: what to write; the files hold the setup that an estimator gets.
        overwrite: whether an existing recording is replaced.

    Raises:
        RecordingError: something exists at `path`, or is no recording that may be replaced.
        WritingError: it cannot be written.
    """
    provenance = {"source": simulated.recording.source}
    setup = simulated.setup

    def describe(folder: Path) -> None:
        write_events(folder, simulated.events)
        write_section(folder / CONFIG_FOLDER / "robot.yaml", setup.robot, provenance)
        write_section(folder / CONFIG_FOLDER / "calibration.yaml", setup.calibration, provenance)

    write_recording(path, simulated.recording, overwrite=overwrite, beside=describe)


def _summary(path: Path, simulated: Simulated) -> Table:
    recording, truth = simulated.recording, simulated.recording.truth
    table = Table(title=escape(f"{path}: {recording.source}"), title_justify="left")
    table.add_column("property")
    table.add_column("value", justify="right")
    table.add_row(escape("duration [s]"), f"{recording.duration:.3f}")
    table.add_row("IMU samples", str(recording.imu.stamps.size))
    if truth is not None and truth.rate is not None:
        table.add_row(escape("rms tilt [deg]"), f"{math.degrees(_rms(truth.tilt)):.2f}")
        table.add_row(escape("rms tilt rate [deg/s]"), f"{math.degrees(_rms(truth.rate)):.1f}")
    table.add_row("falls", str(simulated.falls))
    table.add_row("gyro saturated [% of samples]", f"{100.0 * simulated.saturated:.2f}")
    return table


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
