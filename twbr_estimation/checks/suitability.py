"""Which filters have what they need in a recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..filters import Filter, filters
from ..recording import Recording
from .finding import Finding, Severity, passed

DT_TOLERANCE = 0.05
"""Relative difference of sampling periods above which a filter's defaults do not fit."""


def suitability(recording: Recording, others: Sequence[Finding]) -> Iterator[Finding]:
    """Yield which filters will work.

    Args:
        recording: the data.
        others: what the other checks found.
    """
    wheels = recording.wheels is not None and not any(
        each.subject == "wheels" and each.severity is Severity.FAIL for each in others
    )
    lacking = {name: _lacks(entry, recording, wheels) for name, entry in filters().items()}
    ready = [name for name, reason in lacking.items() if not reason]
    yield passed("filters", "ready", f"work as they are: {', '.join(ready) or 'none'}")
    for reason in dict.fromkeys(lacking.values()):
        if reason:
            names = [name for name, each in lacking.items() if each == reason]
            yield Finding(Severity.SKIP, "filters", "needs", f"{', '.join(names)}: {reason}")


def _lacks(entry: Filter, recording: Recording, wheels: bool) -> str:
    if entry.uses_motors and recording.motors is None:
        return "without the motors' voltage it uses less than it could"
    if entry.uses_wheels and not wheels:
        return "without good wheels it uses less than it could"
    dt, tuned = recording.dt, entry.tuned_dt or 0.0
    if tuned > 0.0 and dt > 0.0 and abs(dt / tuned - 1.0) > DT_TOLERANCE:
        return f"the defaults are tuned for {1e3 * tuned:g} ms; tune them for {1e3 * dt:.3g} ms"
    return ""
