"""Draw how a robot is held for each calibration: docs/pictures/hold_KIND.svg.

python tools/holding_pictures.py docs/pictures
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

WIDTH, HEIGHT = 150, 150
INK, FLOOR, ACCENT = "#333", "#999", "#c33"


def robot(x: float, tilt: float = 0.0, foot: float = 120.0) -> str:
    """Return a robot seen from its right side, its axle at (x, foot - 14), tilted clockwise."""
    return (
        f'<g transform="rotate({tilt} {x} {foot - 14})" fill="none" stroke="{INK}" '
        f'stroke-width="2"><rect x="{x - 13}" y="{foot - 92}" width="26" height="70"/>'
        f'<rect x="{x - 6}" y="{foot - 70}" width="12" height="8" fill="{ACCENT}"/>'
        f'<circle cx="{x}" cy="{foot - 14}" r="14"/></g>'
    )


def line(x1: float, y1: float, x2: float, y2: float, colour: str = FLOOR) -> str:
    """Return a line."""
    return f'<path d="M{x1} {y1}L{x2} {y2}" stroke="{colour}" stroke-width="3" fill="none"/>'


def text(x: float, y: float, words: str) -> str:
    """Return centred words."""
    return (
        f'<text x="{x}" y="{y}" font-family="sans-serif" font-size="11" text-anchor="middle" '
        f'fill="{INK}">{words}</text>'
    )


def turn(x: float, y: float) -> str:
    """Return an arrow that goes round."""
    return (
        f'<path d="M{x + 20} {y}A20 8 0 1 1 {x + 8} {y - 7}" stroke="{ACCENT}" stroke-width="2" '
        f'fill="none"/><path d="M{x + 14} {y - 12}l-6 5l7 3" stroke="{ACCENT}" stroke-width="2" '
        'fill="none"/>'
    )


def floor(left: float = 10.0, right: float = 140.0) -> str:
    """Return the floor of a panel."""
    return line(left, 121, right, 121)


def wall(x: float) -> str:
    """Return a wall on the floor."""
    return line(x, 20, x, 121)


def box(words: str, lying: float = 0.0, pointing: float = 0.0) -> str:
    """Return a sensor board and the axis that `words` name, both turned clockwise [deg]."""
    return (
        f'<rect x="45" y="65" width="60" height="30" fill="none" stroke="{INK}" '
        f'stroke-width="2" transform="rotate({lying} 75 80)"/><path d="M75 80V38m-6 10l6 -10l6 10" '
        f'stroke="{ACCENT}" stroke-width="2" fill="none" transform="rotate({pointing} 75 80)"/>'
        + text(75, 24, words)
    )


PANELS: dict[str, Sequence[str]] = {
    "still": (
        floor() + robot(75) + line(100, 60, 130, 121) + text(75, 142, "propped upright, 1 min"),
    ),
    "poses": tuple(
        floor() + robot(75, tilt) + text(75, 142, words)
        for tilt, words in ((-40, "2 s"), (-15, "2 s"), (0, "2 s, upright"), (40, "2 s, ..."))
    ),
    "geometry": (
        floor() + robot(40, -8) + robot(110, 8) + text(75, 142, "drive, brake, turn, 1 min"),
    ),
    "faces": (
        box("z up") + text(75, 142, "2 s"),
        box("z down", pointing=180) + text(75, 142, "2 s"),
        box("x up, ...", lying=90) + text(75, 142, "up to six faces"),
    ),
    "turns": (
        floor() + robot(75) + text(75, 142, "rest 2 s"),
        floor() + robot(75) + turn(75, 22) + text(75, 142, "whole turns by hand"),
        floor() + robot(75) + text(75, 142, "same place, rest 2 s"),
    ),
    "wall": (
        floor() + wall(115) + robot(68, 25) + text(75, 142, "leans forward, 2 s"),
        floor() + wall(35) + robot(82, -25) + text(75, 142, "turned round: backward"),
    ),
    "balance": (floor() + robot(75, 4) + text(75, 142, "balances, untouched, 20 s"),),
    "warmup": (
        floor() + robot(75) + text(75, 20, "20 degC") + text(75, 142, "cold, at rest"),
        floor() + robot(75) + text(75, 20, "35 degC") + text(75, 142, "10 min later, untouched"),
    ),
}
"""What is done, from left to right, by kind of calibration."""


def picture(kind: str) -> str:
    """Return the picture of one kind as SVG."""
    panels = "".join(
        f'<g transform="translate({WIDTH * index} 0)">{panel}</g>'
        for index, panel in enumerate(PANELS[kind])
    )
    width = WIDTH * len(PANELS[kind])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {HEIGHT}" width="{width}" '
        f'height="{HEIGHT}" role="img"><title>How to hold the robot: {kind}</title>'
        f'<rect width="100%" height="100%" fill="#fff"/>{panels}</svg>\n'
    )


def main(folder: Path) -> None:
    """Write all pictures into a folder."""
    for kind in PANELS:
        (folder / f"hold_{kind}.svg").write_text(picture(kind), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
