"""Input of a filter node: corrected Imu messages, or raw ones that it corrects."""

from __future__ import annotations

import math
from collections import Counter

from ..checks.live import LiveChecks
from ..pipeline.pairing import MotorCommand
from ..pipeline.physical import NOT_FINITE
from ..pipeline.step_code import StepCode
from ..robot import Setup
from .corrected import CorrectedStream, has_angle, is_default, readings_of
from .correction import CorrectionStream
from .device.stamping import Stamping
from .guarded import StampedSamples
from .inputs import InputSettings, wheel_input
from .messages import decode_imu, decode_temperature

SWITCH_AFTER = 10
"""Messages of the other kind, corrected or raw, in a row before the input counts as that kind."""


class TiltInput:
    """Serialised messages in, corrected samples out; raw input is recognised automatically.

    Raw are messages that report no orientation (REP-145), whose orientation is no number, or
    the identity of a driver that never sets one. Single messages of the other kind are left out.
    """

    def __init__(self, settings: InputSettings, setup: Setup) -> None:
        """Start without a past; `setup` is for messages that report no orientation."""
        self.raw = False
        """Whether the messages report no orientation and are corrected here."""
        self.default_orientation = False
        """Whether that is because no orientation so far has been set."""
        self._decided, self._oriented = False, False
        self._others, self._left_out = 0, 0
        self._corrected = CorrectedStream(settings.wheel_wait)
        self.checks = LiveChecks(setup)
        """What the raw messages show about themselves."""
        self._correction = CorrectionStream(
            setup, settings.wheel_wait, loop_period=settings.loop_period, checks=self.checks
        )
        self._setup = setup
        self._wheels = wheel_input(settings, lambda: self._setup.robot.wheel_radius)
        self._stamping = Stamping(settings.stamps, "imu/data_raw")

    @property
    def paired(self) -> bool:
        """Whether corrected samples wait for their wheels and get their motors."""
        return self._corrected.paired

    @paired.setter
    def paired(self, wanted: bool) -> None:
        self._corrected.paired = wanted

    @property
    def needs_wheels(self) -> bool:
        """Whether wheel readings make a difference."""
        return self.raw or self.paired

    @property
    def _stream(self) -> CorrectionStream | CorrectedStream:
        """The stream that takes messages of the present kind."""
        return self._correction if self.raw else self._corrected

    def use(self, code: StepCode | None) -> None:
        """Correct raw messages by machine code; the numbers stay the same."""
        self._correction.use(code)

    def configure(self, setup: Setup) -> None:
        """Correct raw messages with another setup from the next one on."""
        if setup is self._setup:
            return
        self._setup = setup
        self._correction.configure(setup)

    def add_temperature(self, data: bytes) -> None:
        """Take a serialised Temperature of the IMU, for raw messages.

        Raises:
            MessageError: the message cannot be read.
        """
        self._correction.add_temperature(decode_temperature(data))

    def add_imu(self, data: bytes, now: int = 0) -> StampedSamples:
        """Take a serialised Imu at `now` [ns]; return the samples that are ready.

        Raises:
            MessageError: the message cannot be read.
        """
        stamp, values = decode_imu(data)
        raw = not self._reports_angle(values)
        if not self._decided:
            self._decided, self.raw = True, raw
        ready: StampedSamples = []
        if raw is self.raw:
            self._others = 0
        else:
            self._others += 1
            if self._others < SWITCH_AFTER:
                self._leave_out(values)
                return []
            ready = self.flush()
            self._others, self.raw = 0, raw
            self._stream.begin_afresh()
        if raw:
            stamp = self._stamping.stamp(stamp, now)
            return ready + self._correction.add_imu(stamp, readings_of(values))
        return ready + self._corrected.add_imu(stamp, values)

    def _leave_out(self, values: tuple[float, ...]) -> None:
        if math.isfinite(sum(values[:4])):
            self._left_out += 1
        else:
            self._corrected.imu_guard.skip(NOT_FINITE)

    def _reports_angle(self, values: tuple[float, ...]) -> bool:
        """Whether a message reports an orientation; the identity counts once another has come."""
        if not has_angle(values):
            self.default_orientation = False
            return False
        self._oriented = self._oriented or not is_default(values)
        self.default_orientation = not self._oriented
        return self._oriented

    def add_wheels(self, data: bytes, now: int = 0) -> StampedSamples:
        """Take a serialised JointState at `now` [ns]; return the samples it completes.

        Raises:
            MessageError: the message cannot be read.
        """
        reading = self._wheels.decode(data, now)
        if reading is None:
            return []
        return self._stream.add_wheels(reading)

    def add_motors(self, command: MotorCommand) -> None:
        """Take a command to the motors."""
        self._stream.add_motors(command)

    def flush(self) -> StampedSamples:
        """Return the samples that still wait for a wheel, because nothing more arrives."""
        return self._stream.flush()

    def problems(self) -> tuple[str, ...]:
        """Return why messages are not used."""
        found = (self._stamping.problem, self._wheels.stamping.problem)
        return tuple(each for each in found if each)

    def counts(self) -> Counter[str]:
        """Return how often samples were skipped or started a new stream, by reason."""
        stream = self._stream
        found: Counter[str] = Counter()
        for prefix, guard in (("imu", stream.imu_guard), ("wheel", stream.wheel_guard)):
            found.update({f"{prefix}_{name}": count for name, count in guard.counts.items()})
        if self._left_out:
            found["imu_of_the_other_kind"] = self._left_out
        return found
