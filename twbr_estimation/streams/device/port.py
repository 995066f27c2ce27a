"""Bytes of a serial port to samples with stamps: split, decoded, related to our clock, counted."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from .binary_frames import DeviceSample, FrameError
from .clock import DeviceClock

LONGEST = 4096
"""Bytes without an end after which they are dropped: another baud rate, or no such device."""

Decode = Callable[[bytes], "DeviceSample | None"]


class PortStream:
    """Takes bytes as they come and gives samples."""

    def __init__(self, decode: Decode, end: bytes, clock: DeviceClock | None) -> None:
        """Read a port.

        Args:
            decode: Returns the sample of the bytes between two ends, None for none; raises
                `FrameError`.
            end: The byte that ends a frame or a line.
            clock: Relates the device's time to ours; None stamps samples with their arrival.
        """
        self._decode, self._end, self._clock = decode, end, clock
        self._rest = b""
        self._synchronised = False
        self._last = 0
        self.counts = {"samples": 0, "unreadable": 0, "dropped_bytes": 0}
        self.problem = ""
        """Why the last unreadable frame was so."""

    @property
    def restarts(self) -> int:
        """Number of times the clocks were related again."""
        return 0 if self._clock is None else self._clock.restarts

    def restart(self) -> None:
        """Forget a partial frame: the port was opened again."""
        self._rest, self._synchronised = b"", False

    def add(self, data: bytes, arrival: int) -> Iterator[tuple[int, DeviceSample]]:
        """Yield stamp [ns] and sample of each frame that `data`, come at `arrival` [ns], ends."""
        *frames, self._rest = (self._rest + data).split(self._end)
        if len(self._rest) > LONGEST:
            self.counts["dropped_bytes"] += len(self._rest)
            self.problem = f"{LONGEST} bytes without an end of a frame: is the baud rate right?"
            self._rest, self._synchronised = b"", False
        for frame in frames:
            first, self._synchronised = not self._synchronised, True
            try:
                sample = self._decode(frame) if frame else None
            except FrameError as error:
                if not first:  # the port was opened in the middle of a frame
                    self.counts["unreadable"] += 1
                    self.problem = str(error)
                continue
            if sample is not None:
                self.counts["samples"] += 1
                yield self._stamp(sample, arrival), sample

    def _stamp(self, sample: DeviceSample, arrival: int) -> int:
        if self._clock is None or sample.ticks is None:
            self._last = max(arrival, self._last + 1)
            return self._last
        return self._clock.stamp(sample.ticks, arrival)


def text_decoder(decode: Callable[[str], DeviceSample | None]) -> Decode:
    """Return a decoder of bytes for one of text; bytes that are no text are a `FrameError`."""

    def decoded(data: bytes) -> DeviceSample | None:
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError as error:
            raise FrameError(f"a line is no text: {error.reason}") from None
        return decode(text)

    return decoded
