"""Filters on the scenes in MuJoCo, by event; the table of docs/physics.md.

    pip install .[physics,peers]
    python bench/physics_accuracy.py --first 701 --seeds 5

A row is a scene, or the samples of one event in it, over all seeds: mean square errors
against the truth [deg^2] of the filter, of the filter without wheels, of `complementary` and
of VQF with its default time constant; then of the filter NEES, the share of its samples that
are more than 5 deg wrong while `tilt/valid` is true [%], and its largest error [deg].
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from twbr_estimation.batch.judging import trusted
from twbr_estimation.drives import Drive
from twbr_estimation.filters import filter_named
from twbr_estimation.peers.comparison import inertial, peer_tilt
from twbr_estimation.peers.compiled import PEERS
from twbr_estimation.physics import SCENES, simulate
from twbr_estimation.recording import FloatArray
from twbr_estimation.robot import Robot
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.simulation.simulate import Simulated

WRONG = 5.0
"""[deg]."""
HEAD = "| scene | event | s | {} | blind | complementary | VQF 3 s | NEES | wrong yet valid | max |"


def errors_of(simulated: Simulated, name: str) -> FloatArray:
    """Return the errors of all four [deg], the filter's variance [deg^2], and 1 where it is valid.

    The shape is (6, n).
    """
    recording, truth = simulated.recording, simulated.recording.truth
    assert truth is not None
    drive = Drive(recording, simulated.setup)
    blind = replace(drive, recording=replace(recording, wheels=None))
    runs = [each.run(name)[name] for each in (drive, blind)]
    vqf = peer_tilt(PEERS[0], inertial(blind.corrected))
    tilts = [each.tilt for each in runs]
    tilts += [drive.run("complementary")["complementary"].tilt, vqf]
    turn = 2.0 * math.pi
    wrapped = (np.array(tilts) - truth.tilt + math.pi) % turn - math.pi
    valid = trusted(filter_named(name), drive.corrected, runs[0])
    return np.vstack(
        [np.degrees(wrapped), np.degrees(np.degrees(runs[0].tilt_variance)), valid.astype(float)]
    )


def parts(simulated: Simulated) -> Iterator[tuple[str, FloatArray]]:
    """Yield names of events with the samples that belong to them, the whole first."""
    stamps = simulated.recording.imu.stamps
    yield "all", np.ones(stamps.size, dtype=bool)
    for name in dict.fromkeys(event.name for event in simulated.events):
        inside = np.zeros(stamps.size, dtype=bool)
        for event in simulated.events:
            if event.name == name:
                inside |= (stamps >= event.begin) & (stamps < event.end)
        yield name, inside


def rows(scene: str, arguments: argparse.Namespace, robot: Robot) -> Iterator[str]:
    """Yield the rows of a scene."""
    found: dict[str, list[FloatArray]] = {}
    for seed in range(arguments.first, arguments.first + arguments.seeds):
        simulated = simulate(
            scene,
            arguments.dt,
            arguments.duration,
            seed,
            world=arguments.world,
            robot=robot,
            clipped_first=arguments.clip_first,
        )
        columns = errors_of(simulated, arguments.filter)
        for event, inside in parts(simulated):
            found.setdefault(event, []).append(columns[:, inside])
    for event, pieces in found.items():
        columns = np.hstack(pieces)
        errors, variance, valid = columns[:4], columns[4], columns[5]
        own = errors[0]
        known = np.maximum(variance, 1e-12)
        believed = (np.abs(own) > WRONG) & (valid > 0.0)
        cells = [f"{own.size * arguments.dt:.0f}"]
        cells += [f"{figure:.3g}" for figure in np.mean(errors**2, axis=1)]
        cells += [f"{np.mean(own**2 / known):.2f}", f"{100.0 * np.mean(believed):.2f}"]
        yield f"| {scene} | {event} | {' | '.join(cells)} | {np.abs(own).max():.1f} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", nargs="+", choices=list(SCENES), default=list(SCENES))
    parser.add_argument("--filter", default="ins_odometer")
    parser.add_argument("--world", default="W1")
    parser.add_argument("--dt", type=float, default=0.005)
    parser.add_argument("--duration", type=float, default=20.0)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=701, help="first seed")
    parser.add_argument("--gyro-range", type=float, default=1000.0, help="[deg/s]")
    parser.add_argument("--accel-range", type=float, default=8.0, help="[g]")
    parser.add_argument("--clip-first", action="store_true", help="clip before the low-pass")
    arguments = parser.parse_args()
    filter_named(arguments.filter)
    robot = Robot(
        gyro_range=math.radians(arguments.gyro_range),
        accel_range=arguments.accel_range * STANDARD_GRAVITY,
    )
    print(HEAD.format(arguments.filter) + "\n" + "|---" * 10 + "|")
    for scene in arguments.scene:
        for row in rows(scene, arguments, robot):
            print(row, flush=True)


if __name__ == "__main__":
    main()
