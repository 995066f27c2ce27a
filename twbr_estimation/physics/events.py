"""Events of the robot, as periods with names."""

from __future__ import annotations

from collections.abc import Iterable

from ..recording import Event

LYING, AFTER = "lying", "after"
SETTLED = 2.0
"""From the end of what disturbs to where `after` begins [s]."""
DISTURBING = frozenset(
    {
        LYING,
        "airborne",
        "carried",
        "held",
        "ice",
        "leaning",
        "lifted",
        "spinning",
        "upside down",
        "wall",
    }
)
"""Events after which an estimate must return."""


class Diary:
    """Periods as they begin and end; times in steps of the caller."""

    def __init__(self) -> None:
        """Start with none."""
        self._open: dict[str, int] = {}
        self._closed: list[Event] = []

    def mark(self, name: str, present: bool, stamp: int) -> None:
        """Say whether something happens at `stamp` [ns]."""
        if present and name not in self._open:
            last = self._closed[-1] if self._closed else None
            goes_on = last is not None and last.name == name and last.end == stamp
            self._open[name] = self._closed.pop().begin if goes_on else stamp
        elif not present and name in self._open:
            self._closed.append(Event(name, self._open.pop(name), stamp))

    def events(self, end: int) -> tuple[Event, ...]:
        """Return all periods up to `end` [ns], those that come after others included."""
        still = [Event(name, begin, end) for name, begin in self._open.items()]
        found = [*self._closed, *still]
        return tuple(sorted([*found, *after(found, end)], key=lambda each: each[1:]))


def after(events: Iterable[Event], end: int) -> list[Event]:
    """Return the undisturbed periods that begin `SETTLED` after something that disturbs.

    Args:
        events: what happened.
        end: of the recording [ns].
    """
    disturbing = sorted((e for e in events if e.name in DISTURBING), key=lambda e: e.begin)
    found, latest = [], None
    for event in [*disturbing, Event("", end, end)]:
        if latest is not None:
            begin = latest + round(SETTLED * 1e9)
            if begin < event.begin:
                found.append(Event(AFTER, begin, event.begin))
        latest = max(latest or 0, event.end)
    return found
