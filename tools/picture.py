"""Draw the moving picture of README: a robot, its true tilt, and what two filters make of it.

    python tools/picture.py docs/pictures/tilt.gif

The robot is simulated (world W2, seed 7, not a recording that anything was tuned on). Both filters
run with their defaults; times, angles and errors are those of the recording.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.patches import Circle, Polygon

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import twbr_estimation as twbr  # noqa: E402
from twbr_estimation.recording import FloatArray  # noqa: E402

WORLD, SEED, BEGIN, SECONDS, PICTURES = "W2", 7, 8.0, 8.0, 12
COLORS = {"ins_odometer": "#1976d2", "complementary": "#ef6c00"}
BODY, RADIUS = 1.0, 0.28
"""Of the drawn robot, in lengths of its body."""


def outline(tilt: float) -> FloatArray:
    """Return the corners of the body that leans by `tilt` [rad], (4, 2)."""
    corners = np.array([[-0.16, 0.0], [0.16, 0.0], [0.16, BODY], [-0.16, BODY]])
    turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
    moved: FloatArray = corners @ turn.T + [0.0, RADIUS]
    return moved


def main(target: Path) -> None:
    """Run the filters and write the picture."""
    drive = twbr.simulate(WORLD, seed=SEED, dt=0.005, duration=BEGIN + SECONDS)
    runs = drive.run(*COLORS)
    columns = runs.to_columns()
    time, truth = columns["time"], np.degrees(columns["reference"])
    tilts = {name: np.degrees(columns[f"{name}.tilt"]) for name in COLORS}

    figure, (left, right) = plt.subplots(
        1, 2, figsize=(7.2, 2.6), width_ratios=(1, 2.4), layout="constrained"
    )
    left.set(xlim=(-1, 1), ylim=(0, 1.5), aspect="equal", xticks=[], yticks=[])
    left.add_patch(Circle((0, RADIUS), RADIUS, color="#424242"))
    ghost = left.add_patch(Polygon(outline(0.0), color="#bdbdbd", label="true"))
    body = left.add_patch(Polygon(outline(0.0), fill=False, color=COLORS["ins_odometer"], lw=2))
    right.set(xlim=(BEGIN, BEGIN + SECONDS), xlabel="time [s]", ylabel="tilt [deg]")
    window = (time >= BEGIN) & (time <= BEGIN + SECONDS)
    shown = np.concatenate([truth[window], *(tilt[window] for tilt in tilts.values())])
    right.set_ylim(np.nanmin(shown) - 0.5, np.nanmax(shown) + 0.5)
    right.plot([], [], color="#bdbdbd", lw=4, label="true")
    lines = {"true": right.lines[0]}
    for name, color in COLORS.items():
        (lines[name],) = right.plot([], [], color=color, lw=1.5, label=name)
    right.legend(loc="upper left", fontsize=8, ncols=3)

    def draw(index: int) -> None:
        now = BEGIN + index / PICTURES
        known = (time >= BEGIN) & (time <= now)
        for name, line in lines.items():
            line.set_data(time[known], truth[known] if name == "true" else tilts[name][known])
        ghost.set_xy(outline(np.radians(np.interp(now, time, truth))))
        body.set_xy(outline(np.radians(np.interp(now, time, tilts["ins_odometer"]))))

    target.parent.mkdir(parents=True, exist_ok=True)
    moving = FuncAnimation(figure, draw, frames=int(SECONDS * PICTURES))
    moving.save(target, writer=PillowWriter(fps=PICTURES), dpi=90)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
