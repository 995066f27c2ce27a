"""Interactive plots, described for BokehJS, which draws them in the reader's browser.

`plots.js` makes them of these descriptions. Bokeh's classes in Python would do the same at the
price of their import and of hundreds of objects, which takes longer than all else in a report.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..noise.analysis import MotionSpectra
from ..recording import FloatArray
from .data import RAW
from .decimation import thinned
from .palette import ERROR_COLOURS, MOTION
from .traces import REFERENCE, Trace, error_spectrum

BINS = 120
SPECTRUM_POINTS = 3_000
TILT_HEIGHT, OTHER_HEIGHT = 360, 280
"""[px]."""
PATTERNS = {"solid": [], "dashed": [6], "dotted": [2, 4], "dashdot": [6, 4, 2, 4]}
"""Lengths of strokes and gaps [px]."""
Plot = dict[str, Any]
"""Options of `Bokeh.Plotting.figure`, and what `plots.js` reads: zoom, lines, legend."""


class LineValues:
    """Values of all lines of a page; lines with the same times share them."""

    def __init__(self) -> None:
        """Begin without any."""
        self._places: dict[bytes, int] = {}

    def place(self, values: FloatArray) -> int:
        """Add values in single precision: seven digits are more than a screen shows."""
        content = np.asarray(values, dtype="<f4").tobytes()
        return self._places.setdefault(content, len(self._places))

    def encoded(self) -> list[str]:
        """Return the bytes of each in base64."""
        return [base64.b64encode(content).decode("ascii") for content in self._places]


def time_plots(
    traces: Sequence[Trace], points: int, name: str, values: LineValues
) -> dict[str, Plot]:
    """Return tilt and, where there is a reference, error over time, with one time axis.

    Args:
        traces: what to draw, the front last.
        points: about how many points a line may have.
        name: of the recording, which the page's switches ask for.
        values: where they go.
    """
    tilt = _plot(name, "time [s]", "tilt [deg]", height=TILT_HEIGHT)
    tilt["lines"] = [_line(values, each, each.times, each.tilt, points) for each in traces]
    scored = [trace for trace in traces if trace.error.size]
    if not scored:
        return {"tilt": tilt}
    error = _plot(name, "time [s]", "error [deg]", x_range_of=f"{name}-tilt")
    error["lines"] = [_line(values, each, each.error_times, each.error, points) for each in scored]
    return {"tilt": tilt, "error": error}


def histogram_plot(traces: Sequence[Trace], name: str, values: LineValues) -> Plot:
    """Return the distribution of the errors of each estimator."""
    plot = _plot(name, "error [deg]", "share of the samples per deg", zoom="both")
    scored = [trace for trace in traces if trace.error.size]
    visible = [trace.error for trace in scored if trace.visible] or [scored[-1].error]
    # Rare impacts must not flatten everything else; the outer bins take all beyond them.
    limit = max(1e-3, max(float(np.quantile(np.abs(error), 0.995)) for error in visible))
    edges = np.linspace(-limit, limit, BINS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    for trace in scored:
        inside = np.clip(trace.error, -limit, limit)
        density, _ = np.histogram(inside, BINS, (-limit, limit), density=True)
        plot["lines"].append(_line(values, trace, middle, density, middle.size))
    return plot


def spectrum_plot(
    motion: MotionSpectra, traces: Sequence[Trace], name: str, values: LineValues
) -> Plot:
    """Return the spectra of Laddach 2022, Fig. 11, and those of the estimators' errors."""
    logarithmic = {"x_axis_type": "log", "y_axis_type": "log"}
    plot = _plot(name, "frequency [Hz]", "power density [deg²/Hz]", zoom="both", **logarithmic)
    curves = [
        ("raw angle error", motion.raw.spectrum, ERROR_COLOURS[0], "dashed"),
        ("corrected angle error", motion.corrected.spectrum, ERROR_COLOURS[1], "solid"),
    ]
    if motion.band_hz > 0.0:
        curves.append(("tilt", motion.tilt, MOTION, "solid"))
    for trace in traces:
        estimated = error_spectrum(trace)
        if estimated is not None and trace.name != RAW:
            frequency, density = estimated.frequency[1:], estimated.density[1:]
            plot["lines"].append(_line(values, trace, frequency, density, SPECTRUM_POINTS))
    plot["legend"] = [
        {
            "label": label,
            "x": values.place(entry.frequency[1:]),
            "y": values.place(entry.density[1:]),
            "style": _style(colour, dash, 2.0),
        }
        for label, entry, colour, dash in curves
    ]
    return plot


def _plot(name: str, x_label: str, y_label: str, zoom: str = "width", **options: Any) -> Plot:
    """Return an empty plot."""
    labels = {"x_axis_label": x_label, "y_axis_label": y_label}
    common = {"name": name, "height": OTHER_HEIGHT, **labels, **options}
    return {"zoom": zoom, "options": common, "lines": [], "legend": []}


def _line(values: LineValues, trace: Trace, x: FloatArray, y: FloatArray, points: int) -> Plot:
    fewer_x, fewer_y = thinned(x, y, points)
    width = 2.0 if trace.name == REFERENCE else 1.5
    return {
        "name": trace.name,
        "visible": trace.visible,
        "x": values.place(fewer_x),
        "y": values.place(fewer_y),
        "style": _style(trace.colour, trace.dash, width),
    }


def _style(colour: str, dash: str, width: float) -> Plot:
    return {"line_color": colour, "line_dash": PATTERNS[dash], "line_width": width}
