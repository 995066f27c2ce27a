"""Warnings about the figures of one recording with these settings."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from ..checks.finding import Severity, noteworthy
from ..filters import Filter

if TYPE_CHECKING:
    from .drive import Drive


def contradictions(
    drives: Iterable[Drive], besides: Collection[str | None] = ()
) -> tuple[str, ...]:
    """Return what fails in the checks of some drives, each with the name of its recording.

    Args:
        drives: recordings with their settings.
        besides: full names of parameters that may be wrong, since they are what is sought.
    """
    return tuple(
        f"{drive.source}: {each.sentence}"
        for drive in drives
        for each in drive.findings
        if each.severity is Severity.FAIL and each.parameter not in besides
    )


def warnings_for(
    drive: Drive, entries: Iterable[Filter], values: Mapping[str, Mapping[str, float]]
) -> Iterator[str]:
    """Yield the warnings about settings, and those of the checks.

    Args:
        drive: the recording with its settings.
        entries: the filters that run.
        values: parameter values in force by filter name.
    """
    chosen = list(entries)
    yield from drive.settings.warnings(drive.dt, chosen)
    for entry in chosen:
        yield from entry.warnings(entry.configure(values[entry.name]), drive.dt)
    yield from (finding.sentence for finding in noteworthy(drive.findings))
