"""What workers are: a function, its units, and an outcome for each of them."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

Report = Callable[[Any], None]
"""Takes a message that a unit sends while it is worked on."""
Outcomes = Generator["UnitResult", None, None]
"""Outcomes as they come; closed, the workers stop."""


class Channel(Protocol):
    """Connection of a unit to the process that asked for it."""

    def send(self, message: Any) -> None:
        """Send a message that can be pickled."""
        ...

    def require_wanted(self) -> None:
        """Return where the result is still wanted.

        Raises:
            WorkerError: the work was given up.
        """
        ...


@dataclass(frozen=True, slots=True)
class Work:
    """A function with what all its units share; both are sent to a worker once."""

    function: Callable[[Any, Any, Channel], Any]
    """A function of a module, which takes `shared`, a unit and the unit's channel."""
    shared: Any


@dataclass(frozen=True, slots=True)
class UnitResult:
    """A unit and what became of it."""

    unit: Any
    result: Any = None
    lost: str = ""
    """Why there is no result: its processes died each time. Empty where there is one."""


class Workers(Protocol):
    """Something that does units of work: this process, others, or a cluster."""

    def run(self, work: Work, units: Iterable[Any], report: Report) -> Outcomes:
        """Yield the outcome of each unit as it is done, in any order.

        Units are taken as workers become free. What the function raises is raised here.

        Args:
            work: what is done.
            units: of the work; each can be pickled.
            report: called with the messages of the units.

        Raises:
            WorkerError: there are no workers any more.
        """
        ...


class _Direct:
    """Channel within one process."""

    def __init__(self, report: Report) -> None:
        self.send = report

    def require_wanted(self) -> None:
        pass


class ThisProcess:
    """Does one unit after the other, here."""

    def run(self, work: Work, units: Iterable[Any], report: Report) -> Outcomes:
        """As `Workers`."""
        channel = _Direct(report)
        for unit in units:
            yield UnitResult(unit, work.function(work.shared, unit, channel))
