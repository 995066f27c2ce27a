"""Dates with times, times of day and the days of a spreadsheet as seconds."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from functools import partial

import numpy as np

from ..recording import FloatArray
from .csv_numbers import few
from .csv_time import unwrapped

DAY, HOUR = 86400.0, 3600.0
_CLOCK = re.compile(
    r"(?:(\d{1,2}):)?(\d{1,2}):(\d{2}(?:[.,:]\d+)?)\s*([ap]\.?m\.?)?", re.IGNORECASE
)
_DAYS = re.compile(r"(\d+) days?,? +", re.IGNORECASE)
"""Days before the time of day of a duration, `1 days 02:03:04.5`."""
_DATES = (
    re.compile(r"(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})"),
    re.compile(r"(?P<year>\d{4})(?P<month>\d{2})(?P<day>\d{2})(?=[T_ ])"),
    re.compile(r"(?P<day>\d{1,2})\.(?P<month>\d{1,2})\.(?P<year>\d{4}|\d{2})"),
    re.compile(
        r"(?P<first>\d{1,2})(?P<sign>[/-])(?P<second>\d{1,2})(?P=sign)(?P<year>\d{4}|\d{2})"
    ),
    re.compile(r"(?P<day>\d{1,2})[ -](?P<name>[a-z]{3})[a-z]*[ -](?P<year>\d{4})", re.IGNORECASE),
    re.compile(r"(?P<name>[a-z]{3})[a-z]* (?P<day>\d{1,2}),? (?P<year>\d{4})", re.IGNORECASE),
)
"""Ways to write a date; `first` and `second` are day and month in one order or the other."""
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
_ZONE = re.compile(r"(Z|UTC|GMT|[+-]\d{2}:?(?:\d{2})?)$", re.IGNORECASE)
_COMPACT = re.compile(r"(\d{2})(\d{2})(\d{2}(?:\.\d+)?)")
_EPOCH_DAYS = 25569
"""Day of a spreadsheet's calendar that is 1970-01-01."""
_CENTURY = (36526.0, 73051.0)
"""Days of that calendar from 2000 to 2100."""
_SHORTEST = 1e-5
"""No sensor is read more often than once in this time [s]."""


def clock_seconds(texts: Sequence[str]) -> tuple[FloatArray, str] | None:
    """Return times [s] and what they are, of a column with dates or times of day.

    Args:
        texts: the column; fields that are neither give NaN.

    Returns:
        Seconds since 1970 for dates, which count as UTC where they name no zone; seconds that go
        on at midnight for times of day. None where most fields are neither.
    """
    month_first = not any(map(_begins_with_a_day, texts))
    for read, kind in (
        (partial(_date, month_first=month_first), "date and time"),
        (_time_of_day, "time of day"),
    ):
        if not _most(read, few(texts)):
            continue
        seconds = np.fromiter(map(read, texts), dtype=np.float64, count=len(texts))
        if 2 * np.count_nonzero(np.isfinite(seconds)) > seconds.size:
            known = np.isfinite(seconds)
            if kind == "time of day":
                seconds[known] = unwrapped(seconds[known], _round(texts))
            return seconds, kind
    return None


def days_as_seconds(numbers: FloatArray) -> tuple[FloatArray, str] | None:
    """Return the days of a spreadsheet's calendar as seconds since 1970; None for other numbers.

    Args:
        numbers: a column of times without a unit; as seconds they would be too close together.
    """
    known = numbers[np.isfinite(numbers)]
    if known.size < 2 or not (_CENTURY[0] < known[0] < _CENTURY[1]):
        return None
    steps = np.diff(known)
    if not 0.0 < np.median(steps) < _SHORTEST:
        return None
    return (numbers - _EPOCH_DAYS) * DAY, "date in days of a spreadsheet"


def _most(read: Callable[[str], float], texts: Sequence[str]) -> bool:
    """Whether a form suits half of the texts."""
    return 2 * sum(math.isfinite(read(text)) for text in texts) >= len(texts)


def _begins_with_a_day(text: str) -> bool:
    """Whether a date as 13/05/2024 cannot begin with the month."""
    match = _DATES[3].match(text.strip())
    return match is not None and int(match["first"]) > 12


def _date(text: str, month_first: bool) -> float:
    """Return the seconds since 1970 of a date with time; NaN for anything else."""
    tidy = text.strip()
    for form in _DATES:
        if match := form.match(tidy):
            day = _midnight(match.groupdict(), month_first)
            rest = tidy[match.end() :].lstrip("T_, ")
            zone = _ZONE.search(rest)
            clock = rest[: zone.start()] if zone else rest
            return day + _of_day(clock.strip()) - _offset(zone[1] if zone else "")
    return math.nan


def _midnight(parts: dict[str, str | None], month_first: bool) -> float:
    """Return the seconds from 1970 to the beginning of a day; NaN where there is no such day."""
    year, name = int(parts["year"] or 0), parts.get("name")
    if name is not None:
        if name.lower() not in _MONTHS:
            return math.nan
        month, day = _MONTHS.index(name.lower()) + 1, int(parts["day"] or 0)
    elif parts.get("first") is not None:
        first, second = int(parts["first"] or 0), int(parts["second"] or 0)
        month, day = (first, second) if month_first else (second, first)
    else:
        month, day = int(parts["month"] or 0), int(parts["day"] or 0)
    try:
        moment = datetime(year + 2000 if year < 100 else year, month, day, tzinfo=timezone.utc)
    except ValueError:
        return math.nan
    return moment.timestamp()


def _of_day(clock: str) -> float:
    """Return the seconds since midnight, also of hours and minutes alone and without colons."""
    if compact := _COMPACT.fullmatch(clock):
        clock = ":".join(compact.groups())
    return _time_of_day(f"{clock}:00" if clock.count(":") == 1 else clock)


def _offset(zone: str) -> float:
    """Return by how much a zone is ahead of UTC [s]."""
    if not zone.startswith(("+", "-")):
        return 0.0
    digits = zone[1:].replace(":", "")
    seconds = 3600.0 * int(digits[:2]) + 60.0 * int(digits[2:] or 0)
    return seconds if zone[0] == "+" else -seconds


def _time_of_day(text: str) -> float:
    """Return the seconds of `[hours:]minutes:seconds[.fraction] [AM|PM]`; NaN for other texts."""
    tidy, before = text.strip(), 0
    if days := _DAYS.match(tidy):
        tidy, before = tidy[days.end() :], int(days[1])
    match = _CLOCK.fullmatch(tidy)
    if match is None:
        return math.nan
    hours, minutes, seconds, half = match.groups()
    whole, _, fraction = seconds.replace(",", ".").replace(":", ".").partition(".")
    hour = int(hours or 0)
    if half:
        hour = hour % 12 + (12 if half.lower().startswith("p") else 0)
    hour += 24 * before
    return 3600.0 * hour + 60.0 * int(minutes) + int(whole) + float(f"0.{fraction or 0}")


def _round(texts: Sequence[str]) -> float:
    """Return after how many seconds times of day start again: a day, or an hour without hours."""
    first = next((text for text in texts if math.isfinite(_time_of_day(text))), "")
    return DAY if first.count(":") > 1 else HOUR
