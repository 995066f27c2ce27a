"""Times of a log: numbers, dates with times, times of day."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import datetime, timezone

import numpy as np

from ..bags.cleaning import Repairs
from ..recording import FloatArray

DAY = 86400.0
WRAPS = (2.0**16, 2.0**32, 2.0**24, 2.0**31)
"""Sizes of counters that start again at 0."""
_CLOCK = re.compile(r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)")
_PERIODS = 100.0
"""A counter that started again goes on within this many median steps."""


def clock_seconds(texts: Sequence[str]) -> tuple[FloatArray, str] | None:
    """Return times [s] and what they are, of a column with dates or times of day.

    Args:
        texts: the column; fields that are neither give NaN.

    Returns:
        Seconds since 1970 for dates, which count as UTC where they name no zone; seconds that go
        on at midnight for times of day. None where most fields are neither.
    """
    for read, kind in ((_date, "date and time"), (_time_of_day, "time of day")):
        seconds = np.fromiter(map(read, texts), dtype=np.float64, count=len(texts))
        if 2 * np.count_nonzero(np.isfinite(seconds)) > seconds.size:
            known = np.isfinite(seconds)
            if kind == "time of day":
                seconds[known] = unwrapped(seconds[known], DAY)
            return seconds, kind
    return None


def _date(text: str) -> float:
    """Return the seconds since 1970 of an ISO 8601 date with time; NaN for anything else."""
    tidy = text.strip().replace(",", ".").replace("/", "-")
    tidy = re.sub(r"^(\d{1,2})\.(\d{1,2})\.(\d{4})", r"\3-\2-\1", tidy)
    if tidy.endswith(("Z", "z")):
        tidy = f"{tidy[:-1]}+00:00"
    match = re.match(r"(\d{4}-\d{1,2}-\d{1,2})[T ](\d{1,2}:\d{2}(?::\d{2})?)(\.\d+)?(.*)$", tidy)
    if match is None:
        return math.nan
    day, clock, fraction, zone = match.groups()
    whole = "-".join(part.zfill(2) for part in day.split("-"))
    tidy_clock = ":".join(part.zfill(2) for part in clock.split(":"))
    try:
        moment = datetime.fromisoformat(f"{whole}T{tidy_clock}{zone.strip()}")
    except ValueError:
        return math.nan
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=timezone.utc)
    return moment.timestamp() + float(f"0{fraction}" if fraction else 0.0)


def _time_of_day(text: str) -> float:
    match = _CLOCK.fullmatch(text.strip())
    if match is None:
        return math.nan
    hours, minutes, seconds = (float(part.replace(",", ".")) for part in match.groups())
    return 3600.0 * hours + 60.0 * minutes + seconds


def unwrapped(counter: FloatArray, modulus: float) -> FloatArray:
    """Return a counter that started again at `modulus` as one that went on; 0 means never.

    A step back by more than half the modulus counts as a new start.
    """
    if not modulus:
        return counter
    turns = np.cumsum(np.diff(counter, prepend=counter[0]) < -modulus / 2.0)
    return counter + modulus * turns


def counter_size(counter: FloatArray, repairs: Repairs) -> float:
    """Return the size of the counter that the times come from; 0 where none started again.

    Every large step back must be that of the same size, less about a usual step.
    """
    steps = np.diff(counter)
    back = steps[steps < 0.0]
    usual = float(np.median(np.abs(steps))) if steps.size else 0.0
    for size in WRAPS:
        if back.size and counter.max() < size and np.all(np.abs(back + size) < _PERIODS * usual):
            repairs[f"counter of the time starts again at {size:.0f}, gone on"] += back.size
            return size
    return 0.0
