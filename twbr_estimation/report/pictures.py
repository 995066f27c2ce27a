"""Pictures for slides, drawn by matplotlib without a screen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.writing import write_bytes
from ..errors import ConfigurationError
from ..noise import GYRO_UNIT, RecordingNoise
from ..recording import FloatArray
from .decimation import thinned
from .palette import AXES, MOTION
from .plotting_packages import import_matplotlib
from .traces import Trace

PICTURE_POINTS = 8_000
"""Points of a line in a picture."""


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
    figure.savefig(content, format="png", dpi=150)
    write_bytes(path, content.getvalue())


def noise_picture(found: Sequence[RecordingNoise], path: Path) -> None:
    """Draw spectra, Allan deviations and bias, a row for each recording.

    Raises:
        ConfigurationError: matplotlib is missing.
        WritingError: the file cannot be written.
    """
    panels = [(noise, _panels(noise)) for noise in found]
    widest = max(len(row) for _, row in panels)
    figure, axes = canvas(len(found), widest, (5.5 * widest, 4.2 * len(found)))
    for row, (noise, drawers) in zip(axes, panels, strict=True):
        for cell in row[len(drawers) :]:
            cell.set_axis_off()
        for cell, draw in zip(row, drawers, strict=False):
            draw(cell, noise)
            cell.grid(True, which="major", alpha=0.3)
            cell.legend(fontsize="small")
        row[0].set_title(noise.source, loc="left", fontsize="small", parse_math=False)
    save(figure, path)


Drawer = Callable[[Any, RecordingNoise], None]


def _panels(noise: RecordingNoise) -> list[Drawer]:
    panels: list[Drawer] = []
    if noise.motion is not None:
        panels.append(_draw_angle)
    if noise.rest is not None:
        panels += [_draw_gyro, _draw_allan, _draw_bias]
    return panels


def _draw_angle(axes: Any, noise: RecordingNoise) -> None:
    motion = noise.motion
    assert motion is not None
    curves = [
        ("raw angle error", motion.raw.spectrum, AXES[1]),
        ("corrected angle error", motion.corrected.spectrum, AXES[0]),
    ]
    if motion.band_hz > 0.0:
        curves.append(("tilt", motion.tilt, MOTION))
    for label, entry, colour in curves:
        axes.loglog(entry.frequency[1:], entry.density[1:], color=colour, label=label)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("power density [deg²/Hz]")


def _draw_gyro(axes: Any, noise: RecordingNoise) -> None:
    assert noise.rest is not None
    for axis, colour in zip("xyz", AXES, strict=True):
        entry = noise.rest.gyro_spectra[axis]
        axes.loglog(entry.frequency[1:], entry.density[1:], color=colour, label=f"gyro {axis}")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("power density at rest [(deg/s)²/Hz]")


def _draw_allan(axes: Any, noise: RecordingNoise) -> None:
    assert noise.rest is not None
    curves = [curve for curve in noise.rest.allan if curve.unit == GYRO_UNIT]
    for curve, colour in zip(curves, AXES, strict=True):
        axes.loglog(curve.time, curve.deviation, color=colour, label=curve.axis)
    axes.set_xlabel("averaging time [s]")
    axes.set_ylabel(f"Allan deviation [{GYRO_UNIT}]")


def _draw_bias(axes: Any, noise: RecordingNoise) -> None:
    assert noise.rest is not None
    drift = noise.rest.gyro_drift
    for index, (axis, colour) in enumerate(zip("xyz", AXES, strict=True)):
        moved = drift.means[:, index] - np.mean(drift.means[:, index])
        axes.plot(drift.times, moved, color=colour, marker=".", label=f"gyro {axis}")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"bias minus its mean [{GYRO_UNIT}]")


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
    axes[0][0].set_title(title, loc="left", parse_math=False)
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
    label = trace.name.replace("_", " ").lstrip()  # matplotlib hides labels with a leading _
    style = {"color": trace.colour, "linestyle": trace.dash, "label": label, "linewidth": 1.2}
    axes.plot(fewer_times, fewer, **style)
