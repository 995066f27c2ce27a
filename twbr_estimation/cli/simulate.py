"""`twbr simulate -o BAG`: a recording of the simulated rig, with its truth."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..bags import write_recording
from ..configuration.files import write_section
from ..simulation import SCENES, WORLDS, Simulated, simulate


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    worlds = "; ".join(f"{world.name}: {world.summary}" for world in WORLDS.values())
    parser = subparsers.add_parser(
        "simulate",
        help="make a recording of the simulated rig",
        description="Simulate a balancing robot with its sensors. The same arguments make the "
        f"same recording. Worlds: {worlds}.",
    )
    parser.add_argument("--world", choices=tuple(WORLDS), default="paper", help="default: paper")
    parser.add_argument(
        "--scene",
        choices=tuple(SCENES),
        default="drive",
        help="drive through disturbances, stand still, or be held at angles; or, without wheels, "
        "the stand of Chudzik 2021: static, vibrating, pendulum, jerking; default: drive",
    )
    parser.add_argument(
        "--dt", type=float, default=0.002, metavar="SECONDS", help="default: %(default)s"
    )
    parser.add_argument(
        "--duration", type=float, default=60.0, metavar="SECONDS", help="default: %(default)s"
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="default: %(default)s")
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="BAG", help="recording to write"
    )
    parser.add_argument(
        "--no-truth", action="store_true", help="leave the true tilt out, for a smaller recording"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace an existing recording")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, write the recording with the robot's description, and say what it holds."""
    simulated = simulate(
        arguments.world, arguments.dt, arguments.duration, arguments.seed, arguments.scene
    )
    stored = simulated
    if arguments.no_truth:
        stored = replace(simulated, recording=replace(simulated.recording, truth=None))
    write_simulated(arguments.output, stored, overwrite=arguments.overwrite)
    Console().print(_summary(arguments.output, simulated))
    return 0


def write_simulated(path: Path, simulated: Simulated, *, overwrite: bool = False) -> None:
    """Write a recording with `config/robot.yaml` and `config/calibration.yaml` beside it.

    Args:
        path: directory to create.
        simulated: what to write; the files hold what an estimator would be told.
        overwrite: whether an existing recording is replaced.

    Raises:
        RecordingError: something exists at `path`, or is no recording that may be replaced.
    """
    write_recording(path, simulated.recording, overwrite=overwrite)
    provenance = {"source": simulated.recording.source}
    setup = simulated.setup
    write_section(path / "config" / "robot.yaml", setup.robot, provenance, replace=True)
    write_section(path / "config" / "calibration.yaml", setup.calibration, provenance, replace=True)


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
