"""Compare three filters on a recording, look at what they estimate, save a plot and a table.

    python examples/python/compare.py bags/verification

The recording's own folder `config` describes its robot.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import twbr_estimation as twbr


def main(bag: str, folder: str = ".") -> None:
    """Run the filters over `bag` and write `tilt.png` and `tilt.csv` into `folder`."""
    drive = twbr.load(bag)
    runs = drive.run("ins_odometer", "kalman", "complementary")
    print(runs.scores())

    best = runs["ins_odometer"]
    uncertainty = np.degrees(np.sqrt(best.tilt_variance[-1]))
    print(f"tilt at {best.time[-1]:.2f} s: {np.degrees(best.tilt[-1]):.2f} deg +-{uncertainty:.2f}")

    runs.plot().figure.savefig(Path(folder) / "tilt.png", dpi=150)
    table = runs.to_columns()
    np.savetxt(
        Path(folder) / "tilt.csv",
        np.column_stack(list(table.values())),
        delimiter=",",
        header=",".join(table),
        comments="",
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
