"""Errors in the callbacks of a node: counted, described in one line, logged from time to time."""

from __future__ import annotations

import traceback
from collections import Counter
from pathlib import Path

from ..errors import TwbrError

LOG_PERIOD = 10.0
"""Time between two log lines about the same callback [s]."""
REPORTED_FOR = 10.0
"""Time for which the report names the latest error [s]."""
_MOST_NAMES = 100
_LONGEST = 300


class CallbackErrors:
    """Errors in callbacks after which the node continued; the caller passes the time."""

    def __init__(self) -> None:
        """Start without any."""
        self.counts: Counter[str] = Counter()
        """Errors by the name of the callback."""
        self.defects = 0
        """Those among them that are not of this package: nobody expected them."""
        self._logged: dict[str, float] = {}
        self._latest, self._at = "", float("-inf")

    def note(self, where: str, error: BaseException, now: float) -> str:
        """Count an error of the callback `where`; return the line to log, empty where none is due.

        Args:
            where: The callback: its topic, service or timer.
            error: What it raised.
            now: Time on a steady clock [s].
        """
        if where not in self.counts and len(self.counts) >= _MOST_NAMES:
            where = "others"
        self.counts[where] += 1
        self.defects += not isinstance(error, TwbrError)
        self._latest, self._at = f"{where}: {described(error)}", now
        last = self._logged.get(where)
        if last is not None and now - last < LOG_PERIOD:
            return ""
        self._logged[where] = now
        count = self.counts[where]
        return self._latest if count == 1 else f"{self._latest} ({count} errors so far)"

    def recent(self, now: float) -> str:
        """Return the latest error where it is at most `REPORTED_FOR` old at `now` [s]."""
        return self._latest if now - self._at <= REPORTED_FOR else ""


def described(error: BaseException) -> str:
    """Return an error in one line: its text, and for a defect its type and place."""
    text = " ".join(str(error).split())[:_LONGEST]
    if isinstance(error, TwbrError):
        return text
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {text}{place}"
