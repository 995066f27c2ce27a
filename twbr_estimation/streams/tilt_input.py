"""What a filter node hears: corrected Imu messages, or raw ones that it corrects itself."""

from __future__ import annotations

from collections import Counter

from ..pipeline.pairing import MotorCommand
from ..robot import Setup
from .corrected import CorrectedStream, has_angle, readings_of
from .correction import CorrectionStream, Stamped
from .inputs import InputSettings
from .messages import WheelDecoder, decode_imu


class TiltInput:
    """Serialised messages in, corrected samples out; raw input is recognised by itself."""

    def __init__(self, settings: InputSettings, setup: Setup) -> None:
        """Start without a past; `setup` is for messages that report no orientation."""
        self.raw = False
        """Whether the latest message reported no orientation and was corrected here."""
        self._corrected = CorrectedStream(settings.wheel_wait)
        self._correction = CorrectionStream(
            setup, settings.wheel_wait, loop_period=settings.loop_period
        )
        self._wheels = WheelDecoder(settings.left_wheel_joint, settings.right_wheel_joint)

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

    def configure(self, setup: Setup) -> None:
        """Correct raw messages with another setup from the next one on."""
        self._correction.configure(setup)

    def add_imu(self, data: bytes) -> Stamped:
        """Take a serialised Imu; return the samples that are ready.

        Raises:
            MessageError: the message cannot be read.
        """
        stamp, values = decode_imu(data)
        self.raw = not has_angle(values)
        if not self.raw:
            return self._corrected.add_imu(stamp, values)
        return self._correction.add_imu(stamp, readings_of(values))

    def add_wheels(self, data: bytes) -> Stamped:
        """Take a serialised JointState; return the samples it completes.

        Raises:
            MessageError: the message cannot be read.
        """
        reading = self._wheels.decode(data)
        if reading is None:
            return []
        return (self._correction if self.raw else self._corrected).add_wheels(reading)

    def add_motors(self, command: MotorCommand) -> None:
        """Take a command to the motors."""
        (self._correction if self.raw else self._corrected).add_motors(command)

    def flush(self) -> Stamped:
        """Return the samples that still wait for a wheel, because nothing more arrives."""
        return (self._correction if self.raw else self._corrected).flush()

    def counts(self) -> Counter[str]:
        """Return how often samples were skipped or started a new stream, by reason."""
        stream = self._correction if self.raw else self._corrected
        found: Counter[str] = Counter()
        for prefix, guard in (("imu", stream.imu_guard), ("wheel", stream.wheel_guard)):
            found.update({f"{prefix}_{name}": count for name, count in guard.counts.items()})
        return found
