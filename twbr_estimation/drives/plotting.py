"""Estimates of one recording as a plot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ConfigurationError
from ..parameters.argument_checks import shown
from ..printing.text import literal

if TYPE_CHECKING:
    from .runs import Runs


def plot(runs: Runs, axes: Any | None) -> Any:
    """Draw tilt [deg] over time [s] since the first sample, the reference in black.

    Args:
        runs: what to draw.
        axes: where to draw; None makes a new figure.

    Returns:
        The matplotlib axes.

    Raises:
        ConfigurationError: matplotlib is not installed, or `axes` cannot be drawn on.
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ConfigurationError(
            "a plot needs matplotlib: pip install 'twbr_estimation[report]'"
        ) from error
    if axes is not None and not callable(getattr(axes, "plot", None)):
        raise ConfigurationError(f"`axes`: {shown(axes)} are no matplotlib axes")
    if axes is None:
        _, axes = plt.subplots(figsize=(9.0, 4.0), layout="constrained")
    recording = runs.recording
    start = int(recording.imu.stamps[0])
    tracks = dict(runs.tracks)
    if recording.reference is not None:
        tracks["reference"] = recording.reference
    for name, track in tracks.items():
        style = {"color": "black", "linewidth": 1.0} if name == "reference" else {"linewidth": 0.8}
        axes.plot(
            (track.stamps - start) * 1e-9, np.degrees(track.tilt), label=literal(name), **style
        )
    axes.set(xlabel="time [s]", ylabel="tilt [deg]", title=literal(runs.drive.source))
    axes.grid(visible=True, alpha=0.3)
    axes.legend(loc="best")
    return axes
