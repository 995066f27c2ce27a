"""A recording on the page: the same pictures as live, with a slider for the time."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from ..drives.runs import Runs
from ..recording import FloatArray, StampArray, TiltTrack
from .source import ParameterInfo, ShownOutcome, ShownRobot, Source, Status, StreamRate
from .telemetry import ACTIVE, REFERENCE, Telemetry

STEP = 0.01
"""Time between two points of a trace [s]."""
Trace = tuple[StampArray, FloatArray, FloatArray]
"""Stamps, tilt [rad] and its variance [rad^2], zeros where that is not known."""
BEFORE = 10.0
"""Time that is drawn before the one sought [s]."""


class RecordedSource(Source):
    """Plays what filters make of a recording."""

    live = False

    def __init__(self, name: str, runs: Runs) -> None:
        """Show `runs` under a name; the first filter is drawn as the active one."""
        self.name = name
        self.telemetry = Telemetry()
        self._robot = runs.drive.setup.robot
        self._warnings = runs.warnings
        self.active = next(iter(runs.tracks), "")
        self._tracks = self._named(runs, runs.recording.reference)
        wheels = runs.recording.wheels
        self._wheels = None if wheels is None else (wheels.stamps, wheels.angle.mean(axis=1))
        stamps = runs.recording.imu.stamps
        self._first, self._last = int(stamps[0]), int(stamps[-1])
        self._shown = self._begin = self._first
        self._started: float | None = None

    def _named(self, runs: Runs, reference: TiltTrack | None) -> dict[str, Trace]:
        """Return what is drawn by trace; the first estimator is the active one."""
        found = {}
        if reference is not None:
            found[REFERENCE] = _thinned(reference)
        for index, (name, track) in enumerate(runs.tracks.items()):
            variance = runs[name].tilt_variance if name in runs else None
            found[ACTIVE if index == 0 else name] = _thinned(track, variance)
        return found

    def open(self) -> None:
        """Play."""
        self._play()

    def close(self) -> None:
        """Stop: no page is open."""
        self._pause()

    def _play(self) -> None:
        self._begin = self._shown if self._shown < self._last else self._first
        self._started = time.monotonic()
        if self._shown >= self._last:
            self.seek(0.0)

    def _pause(self) -> None:
        self._started = None

    def want(self, traces: Collection[str]) -> None:
        """Ignore: everything is drawn."""

    def poll(self) -> None:
        """Pass the samples up to the present time of the playback."""
        if self._started is None:
            return
        now = self._begin + int((time.monotonic() - self._started) * 1e9)
        self._pass_on(self._shown, min(now, self._last))
        if now >= self._last:
            self._pause()

    def _pass_on(self, begin: int, end: int) -> None:
        self.telemetry.seconds(self._first)
        for name, columns in self._tracks.items():
            a, b = np.searchsorted(columns[0], (begin, end), side="right")
            points = zip(*(column[a:b].tolist() for column in columns), strict=True)
            for stamp, tilt, variance in points:
                if name == REFERENCE:
                    self.telemetry.add_reference(int(stamp), tilt)
                else:
                    self.telemetry.add_estimate(name, int(stamp), tilt, variance)
        self._shown = end
        if self._wheels is not None:
            angle, lean = float(np.interp(end, *self._wheels)), self.telemetry.pose.tilt
            self.telemetry.pose.wheel = angle + (0.0 if math.isnan(lean) else lean)

    def geometry(self) -> ShownRobot:
        """Return the dimensions of the recorded robot."""
        robot = self._robot
        radius = robot.wheel_radius
        height = max(2.0 * abs(robot.body_height), 2.0 * radius)
        return ShownRobot(radius, robot.track_width or 4.0 * radius, height)

    def words(self) -> tuple[str, str]:
        """Return the time of the picture, and WARN where the recording has warnings."""
        state = "playing" if self._started is not None else "paused"
        text = f"{self.position():.2f} of {self.duration():.2f} s, {state}"
        return text, "WARN" if self._warnings else "OK"

    def statuses(self) -> Sequence[Status]:
        """Return the warnings about the recording."""
        return [Status(self.name, "WARN", text) for text in self._warnings]

    def rates(self) -> Sequence[StreamRate]:
        """Return nothing: no topic arrives."""
        return ()

    def nodes(self) -> Sequence[str]:
        """Return nothing: there are no nodes."""
        return ()

    def revision(self, node: str) -> int:
        """Return 0: nothing changes."""
        return 0

    async def parameters(self, node: str) -> Sequence[ParameterInfo]:
        """Return nothing."""
        return ()

    async def set_parameter(self, node: str, name: str, value: Any) -> ShownOutcome:
        """Refuse."""
        return ShownOutcome(False, "a recording has no parameters to change")

    def actions(self) -> Sequence[str]:
        """Return what can be done."""
        return ("play", "pause")

    async def act(self, action: str) -> ShownOutcome:
        """Play or pause."""
        if action == "play":
            self._play()
        elif action == "pause":
            self._pause()
        else:
            return ShownOutcome(False, f"{action!r} is not known")
        return ShownOutcome(True, action)

    def drive(self, speed: float, yaw_rate: float) -> None:
        """Ignore: it was driven already."""

    def seek(self, time: float) -> None:
        """Show another time [s] of the recording, with what came shortly before."""
        sought = min(self._first + int(time * 1e9), self._last)
        self.telemetry.forget()
        self._pass_on(max(self._first, sought - int(BEFORE * 1e9)) - 1, sought)
        if self._started is not None:
            self._play()

    def position(self) -> float:
        """Return the time that is shown [s]."""
        return max(self._shown - self._first, 0) * 1e-9

    def duration(self) -> float:
        """Return the length [s]."""
        return (self._last - self._first) * 1e-9


def _thinned(track: TiltTrack, variance: FloatArray | None = None) -> Trace:
    """Return about a point each `STEP`."""
    stamps = track.stamps
    known = np.zeros(stamps.size) if variance is None else variance
    period = float(np.median(np.diff(stamps))) * 1e-9 if stamps.size > 1 else STEP
    every = max(int(STEP / max(period, 1e-6)), 1)
    return stamps[::every], track.tilt[::every], np.where(np.isfinite(known), known, 0.0)[::every]
