"""Warnings about the figures of one recording with these settings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from ..checks.finding import noteworthy
from ..filters import Filter

if TYPE_CHECKING:
    from .drive import Drive


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
