"""What the page shows: a robot in the graph or a recording, behind one interface."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from .telemetry import Telemetry


@dataclass(frozen=True, slots=True)
class ParameterInfo:
    """One parameter of a node as its descriptor gives it."""

    name: str
    value: Any
    """bool, int, float, str, or a list of one of them."""
    description: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    read_only: bool = False


@dataclass(frozen=True, slots=True)
class ShownOutcome:
    """The result of a request."""

    done: bool
    text: str
    """What was done, or why it was refused."""


@dataclass(frozen=True, slots=True)
class Status:
    """The latest diagnostics of one node."""

    name: str
    level: str
    """OK, WARN, ERROR or STALE."""
    message: str
    values: dict[str, str] = field(default_factory=dict)
    age: float = 0.0
    """Time since it was received [s]."""


@dataclass(frozen=True, slots=True)
class StreamRate:
    """How one topic arrives."""

    topic: str
    rate: float
    """Messages published per second [1/s]."""
    age: float
    """Time since the newest message was received [s]; infinite before the first."""
    longest: float = 0.0
    """Longest time without a message while a page is open [s]."""
    unreadable: int = 0
    """Messages that the page could not decode."""


@dataclass(frozen=True, slots=True)
class ShownRobot:
    """Dimensions of the drawn robot [m]."""

    wheel_radius: float = 0.0375
    track_width: float = 0.16
    body_height: float = 0.18


class Source(Protocol):
    """A robot that can be looked at and, where it is live, be asked for something."""

    name: str
    """What the page calls it."""
    live: bool
    telemetry: Telemetry
    active: str = ""
    """Filter that is drawn as the active one; empty where its node says so."""
    on_request: tuple[str, ...] = ()
    """Traces that are drawn on request only."""

    def open(self) -> None:
        """Begin to receive: the first browser looks."""

    def close(self) -> None:
        """Stop receiving: no page is open."""

    def want(self, traces: Collection[str]) -> None:
        """Draw these of the traces that are drawn on request only."""

    def poll(self) -> None:
        """Pass what has arrived to the telemetry; called about 30 times a second."""

    def geometry(self) -> ShownRobot:
        """Return the dimensions to draw."""

    def words(self) -> tuple[str, str]:
        """Return the robot's state in words, and its level: OK, WARN, ERROR or STALE."""

    def statuses(self) -> Sequence[Status]:
        """Return the latest diagnostics by node."""

    def rates(self) -> Sequence[StreamRate]:
        """Return how the topics arrive."""

    def nodes(self) -> Sequence[str]:
        """Return the nodes whose parameters can be changed."""

    def revision(self, node: str) -> int:
        """Return a number that changes with the parameters of a node."""

    async def parameters(self, node: str) -> Sequence[ParameterInfo]:
        """Return the parameters of a node; raises `TwbrError` where it does not answer."""

    async def set_parameter(self, node: str, name: str, value: Any) -> ShownOutcome:
        """Change a parameter."""

    def actions(self) -> Sequence[str]:
        """Return the names that `act` takes now."""

    async def act(self, action: str) -> ShownOutcome:
        """Do something: a service of a node, or the recorder."""

    def drive(self, speed: float, yaw_rate: float) -> None:
        """Command a speed [m/s] and a yaw rate [rad/s]."""

    def seek(self, time: float) -> None:
        """Go to a time of a recording [s]."""

    def position(self) -> float:
        """Return the time [s] of a recording that is shown; 0 where live."""

    def duration(self) -> float:
        """Return the length of a recording [s]; 0 where live."""
