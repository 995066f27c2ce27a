"""The acceptance test of a live robot: asks for steps, watches, and returns all findings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from ..checks.finding import Finding, Severity, noteworthy
from ..checks.recent import RecentChecks
from ..checks.suitability import suitability
from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..pipeline.pairing import DEFAULT_WAIT, Pairer, WheelReading
from ..pipeline.physical import imu_fault, wheel_fault
from ..robot import Setup
from ..samples import Sample
from .acceptance_steps import Step, steps

WATCH = "let the robot balance, or lean it, roll it to and fro and turn it on the floor"
"""What is asked for while everything is watched."""
LEAST_TIME = 0.5
"""Share of the time that the stamps must cover."""
REFRESH = 5.0
"""Time between two sets of findings while it watches [s]."""


@dataclass(frozen=True, slots=True)
class AcceptanceSettings:
    """How long a robot is watched.

    Raises:
        ConfigurationError: a number out of bounds.
    """

    seconds: Annotated[
        float, Bounds(8.0, 600.0, "s", "Time, by the stamps, that the moving robot is watched")
    ] = 20.0
    patience: Annotated[
        float, Bounds(1.0, 600.0, "s", "Longest wait for the first sample and for each step")
    ] = 20.0
    ask: Annotated[
        bool,
        Meaning(
            "Whether to ask for rest, turns of each wheel and a lean first; false for a robot "
            "that balances by itself."
        ),
    ] = True

    def __post_init__(self) -> None:
        require_bounds(self)


class Acceptance:
    """Takes readings as they arrive; `look` goes on to the next step.

    Wheels turned by hand while the body is held contradict the IMU; so each step looks at
    the data since it began, and the checks at those after the steps.
    """

    def __init__(
        self, setup: Setup, settings: AcceptanceSettings, wait: float = DEFAULT_WAIT
    ) -> None:
        """Start without data.

        Args:
            setup: robot and calibration as configured.
            settings: how long.
            wait: how much later [s] than a sample its wheel reading may be stamped.
        """
        self.ended = False
        """Whether all is done."""
        self.request = "waiting for imu/data_raw"
        """What is waited for, or asked for."""
        self.found: tuple[Finding, ...] = ()
        """Findings so far; all of them at the end."""
        self.counts: Counter[str] = Counter()
        """Readings left out, by reason."""
        self._setup, self._settings = setup, settings
        self._checks = RecentChecks(setup, settings.seconds + settings.patience)
        self._pairer = Pairer(wait)
        self._steps: list[Step] = list(steps()) if settings.ask else []
        self._done: list[Finding] = []
        self._begun: float | None = None
        self._refreshed = 0.0
        self._last = 0
        self._receiving = False

    def add_imu(self, stamp: int, values: tuple[float, ...]) -> None:
        """Take gyro x, y, z [rad/s] and accelerometer x, y, z [m/s^2] stamped `stamp` [ns]."""
        fault = imu_fault(values) or ("zero_stamp" if stamp <= 0 else "")
        if fault or stamp == self._last:
            self.counts[fault or "repeated_stamp"] += 1
            return
        if stamp < self._last:
            self.counts["earlier_stamp"] += 1
            self._pairer.restart(stamp)
        self._last, self._receiving = stamp, True
        self._keep(self._pairer.add_imu(stamp, values))

    def add_wheels(self, reading: WheelReading) -> None:
        """Take a reading of the wheel encoders."""
        if fault := wheel_fault(reading.angle, reading.difference):
            self.counts[f"wheel_{fault}"] += 1
            return
        self._keep(self._pairer.add_wheels(reading))

    def add_reference(self, stamp: int, tilt: float) -> None:
        """Take a reading of the reference encoder [rad], stamped [ns]."""
        self._checks.add_reference(stamp, tilt)

    def _keep(self, samples: Sequence[tuple[int, Sample]]) -> None:
        for stamp, sample in samples:
            self._checks.add(stamp, sample)

    def look(self, now: float) -> None:
        """Go on as far as the data allow; call it some times a second.

        Args:
            now: time of a steady clock [s].
        """
        if self._begun is None:
            self._begun, self._refreshed = now, now
        if self.ended:
            return
        if not self._receiving:
            self._wait(now - self._begun)
        elif self.request.startswith("waiting"):
            self._begin(now)
        elif self._steps:
            self._step(now, self._begun)
        else:
            self._watch(now, self._begun)

    def _wait(self, waited: float) -> None:
        if waited <= self._settings.patience:
            return
        left_out = ", ".join(f"{count} {name}" for name, count in self.counts.items())
        text = f"no usable sample on imu/data_raw within {self._settings.patience:g} s"
        because = f" ({left_out})" if left_out else ": start the driver, or remap the topic"
        self._finish([Finding(Severity.FAIL, "IMU", "presence", f"{text}{because}")])

    def _begin(self, now: float) -> None:
        """Ask for the next step; after the last one, for the motion to watch."""
        self._begun = self._refreshed = now
        self.request = self._steps[0].request if self._steps else WATCH

    def _step(self, now: float, begun: float) -> None:
        step, recording = self._steps[0], self._checks.recording()
        found = [] if recording is None else step.judge(recording, self._setup)
        if not found and now - begun > self._settings.patience:
            text = f"not seen within {self._settings.patience:g} s: {step.request}"
            found = [Finding(Severity.SKIP, "step", step.name, text)]
        if found:
            self._done += found
            self.found = tuple(self._done)
            self._steps.pop(0)
            self._checks.restart()
            self._begin(now)

    def _watch(self, now: float, begun: float) -> None:
        recording, settings = self._checks.recording(), self._settings
        duration = 0.0 if recording is None else recording.duration
        if duration >= settings.seconds or now - begun > settings.seconds + settings.patience:
            found = list(self._checks.findings())
            clock = self._clock(duration, now - begun)
            ready = [] if recording is None else list(suitability(recording, found))
            self._finish([*clock, *found, *ready])
        elif now - self._refreshed >= REFRESH:
            self._refreshed = now
            self.found = (*self._done, *self._checks.findings())

    def _clock(self, duration: float, passed: float) -> list[Finding]:
        """Return that stamps stand still or jump, where watching took longer than it should."""
        if duration >= self._settings.seconds or duration >= LEAST_TIME * passed:
            return []
        text = (
            f"the stamps of imu/data_raw cover {duration:.3g} s of {passed:.3g} s: samples stay "
            "away, or their clock jumps or runs in another unit"
        )
        return [Finding(Severity.FAIL, "IMU", "clock", text, duration / max(passed, 1e-9))]

    def _finish(self, found: list[Finding]) -> None:
        self.found, self.ended = (*self._done, *_merged(self._done, found)), True
        self.request = "done"


def _merged(done: Sequence[Finding], found: Sequence[Finding]) -> list[Finding]:
    """Return what was found without what a step has named already."""
    named = {(each.subject, each.check) for each in noteworthy(done)}
    return [each for each in found if (each.subject, each.check) not in named]
