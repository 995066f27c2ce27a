"""What `tools/balance.py` shows of a balancing robot: a page for a terminal, or a line."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

COLUMNS, ROWS = 70, 9
"""Size of the plot, so that all fits into 80 x 24."""
SECONDS_A_COLUMN = 0.1
"""Also the time between two pages [s]."""
SMALLEST_SCALE = 5.0
"""Of the plot [deg]."""
FALLEN_DEG = 34.0
"""Beyond this tilt the robot counts as fallen; its motors are cut there [deg]."""
KEYS = "a/← d/→ push   w/↑ s/↓ drive   space stop   f/F filter   c/C controller   q quit"
NONE = math.nan


@dataclass
class Shown:
    """The robot's state as far as it is known; angles in [deg]."""

    time: float = 0.0
    """Since the first estimate [s]."""
    reference: float = NONE
    estimate: float = NONE
    speed: float = NONE
    """Of the axle [m/s]."""
    target: float = 0.0
    """Commanded speed [m/s]."""
    voltage: float = NONE
    """Mean of the motors [V]."""
    filter: str = ""
    controller: str = ""
    mse: float = NONE
    """Of the chosen filter since it was chosen [deg^2]."""
    standing: str = "starting"
    upright_since: float | None = None
    """Since when it stands [s]; None while it lies."""
    upright: float = 0.0
    """Time upright in all [s]."""
    falls: int = 0
    message: str = ""
    """What the last key did."""
    history: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=COLUMNS))
    """Reference and estimate, one pair a column of the plot."""

    def take_time(self, time: float) -> None:
        """Go on to `time` [s]: count upright time and falls."""
        passed, self.time = time - self.time, time
        if abs(self.reference) > FALLEN_DEG:
            self.falls += self.upright_since is not None
            self.upright_since = None
        else:
            if self.upright_since is None:
                self.upright_since = time
            self.upright += passed

    def line(self) -> str:
        """Return all in one line, for where there is no terminal."""
        return (
            f"{self.time:6.1f} s  upright {self.upright:6.1f} s  falls {self.falls}  "
            f"tilt {_number(self.reference, 2)} deg  estimate {_number(self.estimate, 2)} deg  "
            f"{self.filter} MSE {_number(self.mse, 4)} deg^2  {self.controller}: {self.standing}"
        )


def page(shown: Shown) -> RenderableType:
    """Return the page, at most 80 x 24."""
    table = Table.grid(padding=(0, 2))
    for width in (10, 22, 7, 34):
        table.add_column(width=width, no_wrap=True)
    for row in _rows(shown):
        table.add_row(*row)
    waiting = math.isnan(shown.reference)
    title = "the nodes are starting" if waiting else f"last {COLUMNS * SECONDS_A_COLUMN:g} s"
    plot = Panel(_plot(shown), title=title, width=80)
    keys = Text(KEYS, style="dim")
    return Group(table, plot, Text(shown.message[:78], style="yellow"), keys)


def _rows(shown: Shown) -> list[tuple[RenderableType, ...]]:
    now = 0.0 if shown.upright_since is None else shown.time - shown.upright_since
    standing = Text(
        shown.standing.removeprefix("motors "),
        style="green" if shown.standing == "balancing" else "red",
    )
    error = shown.estimate - shown.reference
    return [
        ("upright", f"{now:.1f} s", "in all", f"{shown.upright:.1f} of {shown.time:.1f} s"),
        ("falls", str(shown.falls), "motors", standing),
        ("tilt", _deg(shown.reference), "speed", f"{_number(shown.speed, 2)} m/s"),
        ("estimate", _deg(shown.estimate), "wanted", f"{_number(shown.target, 2)} m/s"),
        ("error", _deg(error), "voltage", f"{_number(shown.voltage, 1)} V"),
        (
            "filter",
            Text(shown.filter, style="bold cyan"),
            "MSE",
            f"{_number(shown.mse, 4)} deg²",
        ),
        ("controller", Text(shown.controller, style="bold cyan"), "", ""),
    ]


def _plot(shown: Shown) -> Text:
    """Return tilt and estimate over time, as rows of characters."""
    known = [abs(v) for pair in shown.history for v in pair if not math.isnan(v)]
    scale = max(SMALLEST_SCALE, *known) if known else SMALLEST_SCALE
    cells = [[" "] * COLUMNS for _ in range(ROWS)]
    cells[ROWS // 2] = ["·"] * COLUMNS
    begin = COLUMNS - len(shown.history)
    for column, (reference, estimate) in enumerate(shown.history, begin):
        for value, mark in ((reference, "○"), (estimate, "●")):
            if not math.isnan(value):
                row = round((ROWS - 1) / 2 * (1.0 - value / scale))
                cells[row][column] = mark
    text = Text(no_wrap=True)
    for index, row_cells in enumerate(cells):
        labels = {0: scale, ROWS // 2: 0.0, ROWS - 1: -scale}
        label = f"{labels[index]:+5.0f}" if index in labels else "     "
        text.append(f"{label} ", style="dim")
        for cell in row_cells:
            text.append(cell, style={"●": "cyan", "○": "white"}.get(cell, "dim"))
        text.append("\n")
    text.append("      ● estimate  ○ reference encoder [deg]", style="dim")
    return text


def _deg(value: float) -> str:
    return f"{_number(value, 2)}°"


def _number(value: float, digits: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}"
