"""Pictures for slides, drawn by matplotlib without a screen."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from ..disk.writing import write_bytes
from ..errors import ConfigurationError
from ..noise import GYRO_UNIT
from ..noise.curves import ShownCurves
from ..printing.text import literal, safe
from ..recording import FloatArray
from .decimation import thinned
from .palette import AXES, MOTION
from .plotting_packages import import_matplotlib
from .traces import Trace

PICTURE_POINTS = 8_000
"""Points of a line in a picture."""
_PACKED = {"compress_type": zlib.Z_RLE}
"""Runs of equal pixels alone: of a drawing both quicker and smaller than the usual search."""

MARGINS = {"left": 0.065, "right": 0.985, "top": 0.94, "bottom": 0.08, "hspace": 0.13}
"""Of the picture of the tilt, as shares of it; to fit them to each picture takes longer than it."""


def canvas(
    rows: int, columns: int, size: tuple[float, float], layout: Any = "constrained"
) -> tuple[Any, Any]:
    """Return a figure of `size` [inch] and its axes, (rows, columns).

    Raises:
        ConfigurationError: matplotlib is missing.
    """
    try:
        import_matplotlib()
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ConfigurationError("pictures need matplotlib: pip install matplotlib") from error
    figure = Figure(figsize=size, layout=layout)
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)


def save(figure: Any, path: Path) -> None:
    """Write a figure as PNG.

    Raises:
        WritingError: the file cannot be written.
    """
    content = BytesIO()
    figure.savefig(content, format="png", dpi=150, pil_kwargs=_PACKED)
    write_bytes(path, content.getvalue())


class _Panel(NamedTuple):
    """How the curves of one kind are drawn."""

    across: str
    up: str
    colours: tuple[str, ...] = AXES
    logarithmic: bool = True


_PANELS = {
    "angle": _Panel("frequency [Hz]", "power density [deg²/Hz]", (AXES[1], AXES[0], MOTION)),
    "gyro": _Panel("frequency [Hz]", "power density at rest [(deg/s)²/Hz]"),
    "allan": _Panel("averaging time [s]", f"Allan deviation [{GYRO_UNIT}]"),
    "bias": _Panel("time [s]", f"bias minus its mean [{GYRO_UNIT}]", logarithmic=False),
}


def noise_picture(found: Sequence[tuple[str, ShownCurves]], path: Path) -> None:
    """Draw spectra, Allan deviations and bias, a row for each recording.

    Args:
        found: name and curves of each recording; one at least.
        path: file to write.

    Raises:
        ConfigurationError: matplotlib is missing.
        WritingError: the file cannot be written.
    """
    widest = max(len(curves) for _, curves in found)
    figure, axes = canvas(len(found), widest, (5.5 * widest, 4.2 * len(found)))
    for row, (source, curves) in zip(axes, found, strict=True):
        for cell in row[len(curves) :]:
            cell.set_axis_off()
        for cell, (kind, lines) in zip(row, curves.items(), strict=False):
            _draw_panel(cell, _PANELS[kind], lines)
        row[0].set_title(safe(source), loc="left", fontsize="small", parse_math=False)
    save(figure, path)


def _draw_panel(axes: Any, panel: _Panel, lines: Mapping[str, Sequence[Sequence[float]]]) -> None:
    for (label, (x, y)), colour in zip(lines.items(), panel.colours, strict=False):
        if panel.logarithmic:
            axes.loglog(x, y, color=colour, label=label)
        else:
            axes.plot(x, y, color=colour, marker=".", label=label)
    axes.set_xlabel(panel.across)
    axes.set_ylabel(panel.up)
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize="small")


def tilt_picture(traces: Sequence[Trace], title: str, path: Path) -> None:
    """Draw what the page shows unasked: reference, estimates, and their errors.

    Args:
        traces: what to draw, the front last.
        title: above the picture.
        path: file to write.

    Raises:
        ConfigurationError: matplotlib is missing.
        WritingError: the file cannot be written.
    """
    visible = [trace for trace in traces if trace.visible]
    scored = [trace for trace in visible if trace.error.size]
    height = 7.2 if scored else 4.2
    figure, axes = canvas(2 if scored else 1, 1, (12.8, height), layout="none")
    figure.subplots_adjust(**{**MARGINS, "bottom": MARGINS["bottom"] * 7.2 / height})
    for trace in visible:
        _draw_trace(axes[0][0], trace, trace.times, trace.tilt)
    axes[0][0].set_ylabel("tilt [deg]")
    # Without y=1.0 it is placed twice: the ticks are drawn to find out that they are not above.
    axes[0][0].set_title(safe(title), loc="left", y=1.0, parse_math=False)
    axes[0][0].legend(loc="upper right", ncols=len(visible))
    for trace in scored:
        _draw_trace(axes[1][0], trace, trace.error_times, trace.error)
    if scored:
        axes[1][0].set_ylabel("error [deg]")
    for row in axes:
        row[0].grid(True, alpha=0.3)
        row[0].margins(x=0.0)
    axes[-1][0].set_xlabel("time [s]")
    save(figure, path)


def _draw_trace(axes: Any, trace: Trace, times: FloatArray, values: FloatArray) -> None:
    fewer_times, fewer = thinned(times, values, PICTURE_POINTS)
    label = literal(trace.name.replace("_", " ")).lstrip()  # labels with a leading _ are hidden
    style = {"color": trace.colour, "linestyle": trace.dash, "label": label, "linewidth": 1.2}
    axes.plot(fewer_times, fewer, **style)
