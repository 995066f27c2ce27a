"""Speed of the MuJoCo scene with its sensors at 500 Hz, as a multiple of real time."""

from __future__ import annotations

import sys
import time

from rows import row

REQUIRED = 50.0
DURATION = 20.0
"""Simulated time [s]."""


def main() -> int:
    try:
        import mujoco  # noqa: F401
    except ImportError:
        print("physics: needs the package mujoco; left out")
        return 0
    from twbr_estimation.physics.scenes import SCENES
    from twbr_estimation.physics.simulate import simulate

    scene = next(iter(SCENES))
    simulate(scene, duration=2.0)
    begin = time.process_time()
    simulate(scene, duration=DURATION)
    speed = DURATION / (time.process_time() - begin)
    row("MuJoCo scene with sensors at 500 Hz", f"{speed:.0f} x real time", f"{REQUIRED:g} x")
    return 0


if __name__ == "__main__":
    sys.exit(main())
