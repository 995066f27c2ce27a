"""Rates, jitter and gaps of every stream."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..printing.text import counted
from ..recording import Recording, StampArray
from .finding import Finding, Severity, passed

GAP_PERIODS = 5.0
"""Median sampling periods that make a gap."""
SHORTEST_PERIOD, LONGEST_PERIOD = 1e-4, 0.1
"""Periods of an IMU that are believed [s]."""
JITTER = 0.5
"""Standard deviation of the period, as a share of it, that is worth a warning."""
CLOCK_SET = 3600.0
"""A longer step between two samples is a clock that was set [s]."""
GAPS = 0.02
"""Share of the time in gaps that is worth a warning."""


@dataclass(frozen=True, slots=True)
class Timing:
    """When the samples of one stream come."""

    samples: int
    duration: float
    """From first to last sample [s]."""
    rate: float
    """Mean rate outside gaps [Hz]."""
    period: float
    """Median period [s]."""
    jitter: float
    """Standard deviation of the period without gaps [s]."""
    gaps: int
    """Steps above five median periods."""
    longest_step: float
    """[s]."""
    missing: float
    """Time in gaps [s]."""


def period_of(stamps: StampArray) -> float:
    """Return the median period [s]; 0 for fewer than two stamps."""
    return float(np.median(np.diff(stamps))) * 1e-9 if stamps.size > 1 else 0.0


def timing_of(stamps: StampArray) -> Timing:
    """Return when the samples of a stream come."""
    if stamps.size < 2:
        return Timing(int(stamps.size), 0.0, 0.0, 0.0, 0.0, 0, 0.0, 0.0)
    steps = np.diff(stamps) * 1e-9
    median, duration = float(np.median(steps)), float(steps.sum())
    gaps = steps > GAP_PERIODS * median
    return Timing(
        int(stamps.size),
        duration,
        steps[~gaps].size / max(float(steps[~gaps].sum()), 1e-9),
        median,
        float(steps[~gaps].std()) if not gaps.all() else 0.0,
        int(gaps.sum()),
        float(steps.max()),
        float(steps[gaps].sum()),
    )


def timing(recording: Recording) -> Iterator[Finding]:
    """Yield how regular the streams are."""
    streams = {
        "IMU": recording.imu,
        "wheels": recording.wheels,
        "reference": recording.reference,
    }
    for name, track in streams.items():
        if track is not None and track.stamps.size > 1:
            yield _judged(name, timing_of(track.stamps))
    yield from _believable(period_of(recording.imu.stamps))


def _judged(name: str, shown: Timing) -> Finding:
    text = (
        f"{shown.rate:.4g} Hz, period {1e3 * shown.period:.4g} ms +- {1e3 * shown.jitter:.2g} ms, "
        f"{counted(shown.gaps, 'gap')}, the longest {1e3 * shown.longest_step:.4g} ms"
    )
    if shown.longest_step > CLOCK_SET:
        return Finding(
            Severity.WARN,
            name,
            "clock",
            f"the stamps jump by {shown.longest_step / 86400.0:.4g} days: the clock was set during "
            "the recording; what is before and after is taken as two parts",
            shown.longest_step,
        )
    if shown.missing > GAPS * shown.duration:
        share = 100.0 * shown.missing / shown.duration
        return Finding(Severity.WARN, name, "gaps", f"{text}; {share:.3g} % of the time is missing")
    if shown.jitter > JITTER * shown.period:
        return Finding(
            Severity.WARN, name, "jitter", f"{text}; stamp readings where they are taken"
        )
    return passed(name, "rate", text)


def _believable(period: float) -> Iterator[Finding]:
    if period == 0.0 or SHORTEST_PERIOD <= period <= LONGEST_PERIOD:
        return
    yield Finding(
        Severity.FAIL,
        "IMU",
        "time unit",
        f"samples come every {1e3 * period:.4g} ms, an IMU's come every "
        f"{1e3 * SHORTEST_PERIOD:g} to {1e3 * LONGEST_PERIOD:g} ms: the unit of time is wrong "
        "(s, ms, us, ns), or the driver is too slow",
        period,
    )
