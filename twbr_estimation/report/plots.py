"""Interactive plots, drawn by Bokeh in the reader's browser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from bokeh.models import (
    BoxZoomTool,
    ColumnDataSource,
    DataRange1d,
    Line,
    PanTool,
    ResetTool,
    SaveTool,
    WheelZoomTool,
)
from bokeh.models.renderers import GlyphRenderer
from bokeh.plotting import figure

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


def time_plots(traces: Sequence[Trace], points: int, name: str) -> dict[str, figure]:
    """Return tilt and, where there is a reference, error over time, with one time axis.

    Args:
        traces: what to draw, the front last.
        points: about how many points a line may have.
        name: of the recording, which the page's switches ask for.
    """
    tilt = _figure(name, "time [s]", "tilt [deg]", height=TILT_HEIGHT)
    for trace in traces:
        _line(tilt, trace, trace.times, trace.tilt, points)
    if not any(trace.error.size for trace in traces):
        return {"tilt": tilt}
    error = _figure(name, "time [s]", "error [deg]", x_range=tilt.x_range)
    for trace in traces:
        if trace.error.size:
            _line(error, trace, trace.error_times, trace.error, points)
    return {"tilt": tilt, "error": error}


def histogram_plot(traces: Sequence[Trace], name: str) -> figure:
    """Return the distribution of the errors of each estimator."""
    plot = _figure(name, "error [deg]", "share of the samples per deg", zoom="both")
    scored = [trace for trace in traces if trace.error.size]
    visible = [trace.error for trace in scored if trace.visible] or [scored[-1].error]
    # Rare impacts must not flatten everything else; the outer bins take all beyond them.
    limit = max(1e-3, max(float(np.quantile(np.abs(error), 0.995)) for error in visible))
    edges = np.linspace(-limit, limit, BINS + 1)
    for trace in scored:
        inside = np.clip(trace.error, -limit, limit)
        density, _ = np.histogram(inside, edges, density=True)
        middle = 0.5 * (edges[1:] + edges[:-1])
        _line(plot, trace, middle, density, middle.size)
    return plot


def spectrum_plot(motion: MotionSpectra, traces: Sequence[Trace], name: str) -> figure:
    """Return the spectra of Laddach 2022, Fig. 11, and those of the estimators' errors."""
    plot = _figure(
        name,
        "frequency [Hz]",
        "power density [deg²/Hz]",
        zoom="both",
        x_axis_type="log",
        y_axis_type="log",
    )
    curves = [
        ("raw angle error", motion.raw.spectrum, ERROR_COLOURS[0], "dashed"),
        ("corrected angle error", motion.corrected.spectrum, ERROR_COLOURS[1], "solid"),
    ]
    if motion.band_hz > 0.0:
        curves.append(("tilt", motion.tilt, MOTION, "solid"))
    for trace in traces:
        estimated = error_spectrum(trace)
        if estimated is not None and trace.name != RAW:
            _line(plot, trace, estimated.frequency[1:], estimated.density[1:], SPECTRUM_POINTS)
    for label, entry, colour, dash in curves:
        plot.line(
            _compact(entry.frequency[1:]),
            _compact(entry.density[1:]),
            line_color=colour,
            line_dash=dash,
            line_width=2.0,
            legend_label=label,
        )
    plot.legend.location = "bottom_left"
    plot.legend.background_fill_alpha = 0.7
    return plot


def _figure(
    name: str, x_label: str, y_label: str, zoom: Literal["width", "both"] = "width", **options: Any
) -> figure:
    """Return an empty plot as wide as the page; on touch screens a drag scrolls the page."""
    box = BoxZoomTool(dimensions=zoom)
    tools = [PanTool(dimensions=zoom), box, WheelZoomTool(dimensions=zoom), ResetTool(), SaveTool()]
    plot = figure(
        name=name,
        x_axis_label=x_label,
        y_axis_label=y_label,
        tools=tools,
        active_drag=box,
        active_scroll=None,
        sizing_mode="stretch_width",
        toolbar_location="above",
        output_backend="canvas",
        **{"height": OTHER_HEIGHT, **options},
    )
    plot.toolbar.logo = None
    if isinstance(plot.y_range, DataRange1d):
        plot.y_range.only_visible = True
    plot.axis.axis_label_text_font_style = "normal"
    return plot


def _line(plot: figure, trace: Trace, x: FloatArray, y: FloatArray, points: int) -> None:
    fewer_x, fewer_y = thinned(x, y, points)
    source = ColumnDataSource({"x": _compact(fewer_x), "y": _compact(fewer_y)})
    width = 2.0 if trace.name == REFERENCE else 1.5
    line = Line(x="x", y="y", line_color=trace.colour, line_dash=trace.dash, line_width=width)
    # `plot.line` adds two more glyphs to each line, for selecting and muting, which no tool does.
    plot.renderers.append(
        GlyphRenderer(
            data_source=source,
            glyph=line,
            nonselection_glyph=None,
            muted_glyph=None,
            name=trace.name,
            visible=trace.visible,
        )
    )


def _compact(values: FloatArray) -> Any:
    """Return single precision: seven digits are more than a screen shows."""
    return np.asarray(values, dtype=np.float32)
