"""Data of the plots: tilt and error of every estimator over time, in degrees."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..drives import Runs
from ..errors import RecordingError
from ..noise import Spectrum, spectrum, uniform_stretch
from ..noise.analysis import SHORTEST_MOTION
from ..recording import FloatArray, TiltTrack
from ..scoring.score import Association, errors_of
from .data import RAW, RecordingReport
from .palette import ERROR_COLOURS, MOTION, style_of

REFERENCE = "reference"


@dataclass(frozen=True, slots=True)
class Trace:
    """One line over time, and its error where there is a reference."""

    name: str
    colour: str
    dash: str
    visible: bool
    times: FloatArray
    """[s] from the recording's first sample, (n,)."""
    tilt: FloatArray
    """[deg], (n,)."""
    error_times: FloatArray
    """[s], (m,)."""
    error: FloatArray
    """Estimate minus reference [deg], (m,); empty where it is not known."""


_Styles = Mapping[str, tuple[str, str]]
"""Colour and dash by name of the estimator."""


def traces_of(reports: Sequence[RecordingReport]) -> list[list[Trace]]:
    """Return raw angle, estimators and reference of each recording, those in front last."""
    styles = _styles_of(reports)
    return [list(_traces(report, styles)) for report in reports]


def _styles_of(reports: Sequence[RecordingReport]) -> _Styles:
    """Return one look for each estimator of all recordings; those shown unasked differ most."""
    shown = [name for report in reports for name in report.shown]
    names = dict.fromkeys([*shown, *(name for report in reports for name in report.ranked)])
    return {name: style_of(index) for index, name in enumerate(names)}


def _traces(report: RecordingReport, styles: _Styles) -> Iterator[Trace]:
    done = report.runs
    reference, association = done.recording.reference, done.compared.association
    options = done.compared.options
    yield _trace(done, RAW, report.raw, (ERROR_COLOURS[0], "solid"), False, association)
    shown = report.shown
    for name in reversed(report.ranked):
        yield _trace(done, name, done.tracks[name], styles[name], name in shown, association)
    if reference is not None:
        tilt = np.unwrap(reference.tilt) + options.reference_offset
        moved = TiltTrack(reference.stamps + round(options.reference_delay * 1e9), tilt)
        yield _trace(done, REFERENCE, moved, (MOTION, "solid"), True, None)


def _trace(
    done: Runs,
    name: str,
    track: TiltTrack,
    style: tuple[str, str],
    visible: bool,
    association: Association | None,
) -> Trace:
    start = int(done.recording.imu.stamps[0])
    times = np.asarray((track.stamps - start) * 1e-9, dtype=np.float64)
    tilt = np.asarray(np.degrees(track.tilt), dtype=np.float64)
    if association is None:
        return Trace(name, *style, visible, times, tilt, np.empty(0), np.empty(0))
    radians, known, _ = errors_of(track.stamps, track.tilt, association.at(track.stamps), start)
    error = np.asarray(np.degrees(radians), dtype=np.float64)
    return Trace(name, *style, visible, times, tilt, times[known], error)


def error_spectrum(trace: Trace) -> Spectrum | None:
    """Return the spectrum of a trace's error [deg^2/Hz], or None where there can be none."""
    stamps = np.round(trace.error_times * 1e9).astype(np.int64)
    try:
        stretch = uniform_stretch(stamps, trace.name, SHORTEST_MOTION)
    except RecordingError:
        return None
    return spectrum(trace.error[stretch.samples], stretch.period)
