"""Samples of one robot between two pictures: traces, errors against the reference, pose.

The page draws some 30 pictures a second. A trace keeps what has come since the last one, and
the errors are taken where reference and estimate overlap in time. What is not finite is counted
and dropped. Free of ROS and of the page.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

DEGREES = 180.0 / math.pi
HISTORY = 30.0
"""Time that a browser gets when it opens the page [s]."""
REFERENCE = "reference"
ACTIVE = "active"
LARGEST_GAP = 0.2
"""Between two references; within a longer one nothing is interpolated [s]."""
REFERENCES_KEPT = 256
LARGEST = 1e4
"""Largest tilt or turn that is drawn [rad]; what is beyond is counted as not finite."""
REPEATED = 1.0
"""A trace begins again where it goes back by more than this, as in a repeated recording [s]."""


@dataclass
class Sums:
    """Running figures of one estimator against the reference."""

    samples: int = 0
    total: float = 0.0
    squares: float = 0.0
    slopes: float = 0.0
    """Sum of error times reference rate, and of the rate's square: their ratio is the delay."""
    rates: float = 0.0

    def add(self, error: float, rate: float) -> None:
        """Take one error [deg] at a rate of the reference [deg/s]."""
        self.samples += 1
        self.total += error
        self.squares += error * error
        self.slopes += error * rate
        self.rates += rate * rate

    def row(self, name: str) -> dict[str, Any]:
        """Return a row of the table: MSE [deg^2], bias [deg], delay [ms]."""
        count = max(self.samples, 1)
        delay = -1e3 * self.slopes / self.rates if self.rates > count else 0.0
        return {
            "name": name,
            "mse": round(self.squares / count, 4),
            "bias": round(self.total / count, 3),
            "delay": round(delay, 1),
            "samples": self.samples,
        }


@dataclass
class Pose:
    """Where the drawn robot stands and how it leans; angles [rad], lengths [m]."""

    tilt: float = math.nan
    roll: float = 0.0
    heading: float = 0.0
    wheel: float = 0.0
    """Turn of the wheels against the ground."""
    reference: float = math.nan

    def values(self) -> dict[str, float | None]:
        """Return numbers by name; None where unknown or beyond all turns."""
        return {
            name: (round(float(value), 5) if abs(value) < LARGEST else None)
            for name, value in vars(self).items()
        }


@dataclass
class Telemetry:
    """Collects samples and gives a picture's worth of them at a time."""

    pose: Pose = field(default_factory=Pose)
    sums: dict[str, Sums] = field(default_factory=dict)
    _new: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    _errors: list[tuple[float, float, float]] = field(default_factory=list)
    _references: deque[tuple[float, float]] = field(
        default_factory=lambda: deque(maxlen=REFERENCES_KEPT)
    )
    _waiting: deque[tuple[str, float, float, float]] = field(
        default_factory=lambda: deque(maxlen=REFERENCES_KEPT)
    )
    not_finite: int = 0
    """Samples that were dropped."""
    _latest: dict[str, float] = field(default_factory=dict)
    """Time of each trace's last sample [s]."""
    _origin: int | None = None
    _past: deque[dict[str, Any]] = field(default_factory=deque)
    _reset: bool = False

    def seconds(self, stamp: int) -> float:
        """Return a stamp [ns] on the page's time axis [s]."""
        if self._origin is None:
            self._origin = stamp
        return (stamp - self._origin) * 1e-9

    def add_reference(self, stamp: int, tilt: float) -> None:
        """Take the reference's tilt [rad]."""
        time = self._time(REFERENCE, stamp, tilt)
        if time is None or (self._references and time <= self._references[-1][0]):
            return
        self._references.append((time, tilt * DEGREES))
        self.pose.reference = tilt
        self._new.setdefault(REFERENCE, []).append((time, tilt * DEGREES))

    def add_estimate(self, name: str, stamp: int, tilt: float, variance: float = 0.0) -> None:
        """Take an estimated tilt [rad] and its variance [rad^2]; 0 where unknown."""
        time = self._time(name, stamp, tilt)
        if time is None:
            return
        known = 0.0 < variance < math.inf
        deviation = math.sqrt(variance) * DEGREES if known else 0.0
        self._new.setdefault(name, []).append((time, tilt * DEGREES))
        if name == ACTIVE:
            self.pose.tilt = tilt
        self._waiting.append((name, time, tilt * DEGREES, deviation))

    def add_angle(self, name: str, stamp: int, tilt: float) -> None:
        """Take an angle that is drawn and not scored [rad]."""
        time = self._time(name, stamp, tilt)
        if time is not None:
            self._new.setdefault(name, []).append((time, tilt * DEGREES))

    def _time(self, name: str, stamp: int, tilt: float) -> float | None:
        """Return a sample's time [s]; None for one that is dropped because it is not finite."""
        if not abs(tilt) < LARGEST:
            self.not_finite += 1
            return None
        time = self.seconds(stamp)
        if time < self._latest.get(name, -math.inf) - REPEATED:
            self.forget()
        self._latest[name] = time
        return time

    def restart_figures(self) -> None:
        """Clear the running figures."""
        self.sums.clear()

    def frame(self) -> dict[str, Any]:
        """Return the samples since the last call, newest pose and errors; lists of [s, deg]."""
        self._score()
        frame: dict[str, Any] = {
            "traces": {name: _rounded(points) for name, points in self._new.items()},
            "errors": _rounded(self._errors),
            "pose": self.pose.values(),
        }
        if self._reset:
            frame["reset"] = True
        self._new, self._errors, self._reset = {}, [], False
        self._keep(frame)
        return frame

    def history(self) -> dict[str, Any]:
        """Return the last `HISTORY` seconds as one frame, for a browser that has just come."""
        return {**merged(self._past), "pose": self.pose.values(), "reset": True}

    def forget(self) -> None:
        """Drop everything: another part of a recording, or another time."""
        self._past.clear()
        self._references.clear()
        self._waiting.clear()
        self._latest.clear()
        self._new, self._errors, self._reset = {}, [], True

    def _keep(self, frame: Mapping[str, Any]) -> None:
        if not frame["traces"]:
            return
        self._past.append(dict(frame))
        newest = _last_time(frame)
        while self._past and _last_time(self._past[0]) < newest - HISTORY:
            self._past.popleft()

    def _score(self) -> None:
        """Compare the estimates that the reference has passed."""
        while self._waiting and self._references:
            name, time, tilt, deviation = self._waiting[0]
            if time > self._references[-1][0]:
                return
            self._waiting.popleft()
            found = self._reference_at(time)
            if found is None:
                continue
            error = (tilt - found[0] + 180.0) % 360.0 - 180.0
            self.sums.setdefault(name, Sums()).add(error, found[1])
            if name == ACTIVE:
                self._errors.append((time, error, deviation))

    def _reference_at(self, time: float) -> tuple[float, float] | None:
        """Return the reference [deg] and its rate [deg/s] at a time; None where unknown."""
        at = bisect_left(self._references, (time, -math.inf))
        if at == 0:
            first = self._references[0]
            return (first[1], 0.0) if first[0] == time else None
        (t0, y0), (t1, y1) = self._references[at - 1], self._references[at]
        if t1 - t0 > LARGEST_GAP:
            return None
        rate = ((y1 - y0 + 180.0) % 360.0 - 180.0) / (t1 - t0)
        return y0 + rate * (time - t0), rate


def merged(frames: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return consecutive frames as one, with the newest pose."""
    traces: dict[str, list[list[float]]] = {}
    errors: list[list[float]] = []
    joined: dict[str, Any] = {}
    for frame in frames:
        if frame.get("reset"):
            traces, errors, joined = {}, [], {"reset": True}
        for name, points in frame["traces"].items():
            traces.setdefault(name, []).extend(points)
        errors.extend(frame["errors"])
        joined["pose"] = frame["pose"]
    return {"traces": traces, "errors": errors, **joined}


def _rounded(points: Iterable[tuple[float, ...]]) -> list[list[float]]:
    return [[round(value, 4) for value in point] for point in points]


def _last_time(frame: Mapping[str, Any]) -> float:
    times: list[float] = [points[-1][0] for points in frame["traces"].values() if points]
    return max(times)
