"""Estimators of other projects beside ours; the tables of docs/comparisons.md.

    pip install .[peers,physics,import]
    python bench/bench_peers.py real DATA
    python bench/bench_peers.py worlds
    python bench/bench_peers.py scenes

Each row is the mean over its recordings of the mean square error against the reference
[deg^2], the smallest in bold; the last row is CPU time. `twbr peers` runs the same on one
recording. DATA holds `broad_translation` and `uiuc_mpu6050_encoder`.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from real_recordings import BROAD, UIUC, UIUC_SKIP, broad, setup_of, uiuc

from twbr_estimation.drives import Drive
from twbr_estimation.peers.comparison import Comparison, compare
from twbr_estimation.peers.table import markdown
from twbr_estimation.physics import SCENES
from twbr_estimation.physics import simulate as simulate_scene
from twbr_estimation.recording import Recording
from twbr_estimation.robot import Robot, Setup
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.scoring.score import ScoringOptions
from twbr_estimation.simulation import simulate

RECOMMENDED = Robot(gyro_range=math.radians(1000.0), accel_range=8.0 * STANDARD_GRAVITY)
"""The ranges that a robot should have that may fall; `Robot` has those of the paper."""


class Case(NamedTuple):
    """One recording to run everything on."""

    group: str
    recording: Recording
    setup: Setup
    skip: float = 0.0


def real(arguments: argparse.Namespace) -> Iterator[Case]:
    """Yield the measurements."""
    for trial in BROAD:
        for axis in "yx":
            log = broad(arguments.data, trial, axis)
            yield Case(f"BROAD {trial[:2]}:{axis}", log.recording, setup_of(log))
    for name in UIUC:
        log = uiuc(arguments.data, name)
        yield Case(f"UIUC {name.split('_')[-1]}", log.recording, setup_of(log), UIUC_SKIP)


def worlds(arguments: argparse.Namespace) -> Iterator[Case]:
    """Yield the rig's recordings."""
    for world in ("W1", "W2", "W3", "W4"):
        for seed in range(arguments.first, arguments.first + arguments.seeds):
            made = simulate(world, 0.005, 60.0, seed)
            yield Case(f"rig {world}", made.recording, made.setup)


def scenes(arguments: argparse.Namespace) -> Iterator[Case]:
    """Yield MuJoCo's scenes."""
    for scene in SCENES:
        for seed in range(arguments.first, arguments.first + arguments.seeds):
            made = simulate_scene(scene, 0.01, 20.0, seed, world="W1", robot=RECOMMENDED)
            yield Case(scene, made.recording, made.setup)


def main() -> None:
    """Print the table asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="?", choices=("real", "worlds", "scenes"), default="worlds")
    parser.add_argument("data", nargs="?", type=Path, help="folder of the measurements")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=601, help="first seed")
    arguments = parser.parse_args()
    if arguments.cases == "real" and arguments.data is None:
        parser.error("real: needs DATA")
    groups: dict[str, list[Comparison]] = {}
    missing: dict[str, None] = {}
    for case in {"real": real, "worlds": worlds, "scenes": scenes}[arguments.cases](arguments):
        print(case.recording.source, file=sys.stderr, flush=True)
        drive = Drive(case.recording, case.setup, options=ScoringOptions(skip=case.skip))
        found = compare(drive)
        groups.setdefault(case.group, []).append(found)
        missing |= dict.fromkeys(found.missing)
    print(markdown(groups))
    for text in missing:
        print(f"\nleft out: {text}")


if __name__ == "__main__":
    main()
