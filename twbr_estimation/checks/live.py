"""The checks of a live stream: looked at beside the stream, and reported once they stay."""

from __future__ import annotations

import threading

from ..robot import Setup
from ..samples import Sample
from .finding import Finding, noteworthy
from .recent import Latest, RecentChecks

PERIOD = 5.0
"""Time between two looks [s]."""
LEAST = 8.0
"""Data that a look needs [s]."""
ELSEWHERE = ("rate", "jitter", "gaps", "presence", "saturation", "noise")
"""Checks whose findings a node reports by its own counters, or that come and go."""


class LiveChecks:
    """Takes raw samples; `look` returns what the last 20 s show, some seconds later.

    A look takes up to a tenth of a second of a processor, so it runs in a thread. A finding
    counts once two looks in a row have it.
    """

    def __init__(self, setup: Setup) -> None:
        """Start without a past, for this robot and calibration."""
        self.findings: tuple[Finding, ...] = ()
        """What two looks in a row have found, the worst first."""
        self._recent = RecentChecks(setup)
        self._before: tuple[Finding, ...] = ()
        self._thread: threading.Thread | None = None
        self._next = 0.0

    def add(self, stamp: int, sample: Sample) -> None:
        """Take a sample as the device reports it, with the wheels, stamped `stamp` [ns]."""
        self._recent.add(stamp, sample)

    def configure(self, setup: Setup) -> None:
        """Judge by another robot or calibration from the next look on."""
        if setup != self._recent.setup:
            self._recent.setup = setup
            self.findings = self._before = ()

    def look(self, now: float) -> tuple[Finding, ...]:
        """Return the findings; begin another look where it is time.

        Args:
            now: time of a steady clock [s].
        """
        if now >= self._next and (self._thread is None or not self._thread.is_alive()):
            self._next = now + PERIOD
            latest = self._recent.latest()
            if latest is not None and latest.duration > LEAST:
                arguments = (latest, self._recent.setup)
                self._thread = threading.Thread(target=self._check, args=arguments, daemon=True)
                self._thread.start()
        return self.findings

    def wait(self) -> None:
        """Wait for the end of the look that has begun."""
        if self._thread is not None:
            self._thread.join()

    def _check(self, latest: Latest, setup: Setup) -> None:
        from .check import check  # all checks; a node that filters starts without them

        found = tuple(
            each
            for each in noteworthy(check(latest.recording(), setup))
            if each.check not in ELSEWHERE
        )
        before = {(each.subject, each.check) for each in self._before}
        if setup is self._recent.setup:
            self.findings = tuple(each for each in found if (each.subject, each.check) in before)
            self._before = found
