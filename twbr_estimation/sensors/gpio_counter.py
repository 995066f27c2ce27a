"""Encoders on plain GPIO lines: the kernel queues the edges, this decodes the quadrature."""

from __future__ import annotations

import importlib
from typing import Any

from ..errors import SensorError

EVENT_BUFFER = 1024
"""Edges the kernel keeps between two reads."""
INSTALL = "install the Python bindings of libgpiod 2: pip install 'gpiod>=2.1'"

# Change of the count by (previous A, B; new A, B): A leads B when it rises.
_STEPS = (0, -1, 1, 0, 1, 0, 0, -1, -1, 0, 0, 1, 0, 1, -1, 0)


class GpioCounter:
    """Counts four edges a line pair; lost edges are counted as errors."""

    def __init__(self, request: Any, line_a: int, line_b: int, line_index: int | None) -> None:
        """Begin at zero.

        Args:
            request: A `gpiod.LineRequest` of these lines with both edges, the index rising.
            line_a: Offset of the line that leads when the count rises.
            line_b: Offset of the line that follows.
            line_index: Offset of the index line, if any.
        """
        self.modulus = 0
        self.errors = 0
        self.zeroed_by_index = False
        self._request = request
        self._line_a, self._line_b, self._line_index = line_a, line_b, line_index
        self._count = 0
        self._index: int | None = None
        self._sequence: int | None = None
        self._state = self._levels()

    def _levels(self) -> int:
        a, b = self._request.get_values([self._line_a, self._line_b])
        return int(bool(a.value)) << 1 | int(bool(b.value))

    def read(self) -> int:
        """Decode the edges since the last read and return the count."""
        while self._request.wait_edge_events(0.0):
            for event in self._request.read_edge_events(EVENT_BUFFER):
                self._take(event)
        return self._count

    def _take(self, event: Any) -> None:
        if self._sequence is not None and event.global_seqno != self._sequence + 1:
            self.errors += event.global_seqno - self._sequence - 1
        self._sequence = event.global_seqno
        if event.line_offset == self._line_index:
            self._index = self._count
            return
        bit = 2 if event.line_offset == self._line_a else 1
        high = event.event_type == event.Type.RISING_EDGE
        state = self._state | bit if high else self._state & ~bit
        self.errors += state == self._state  # the edge before this one was missed
        self._count += _STEPS[self._state << 2 | state]
        self._state = state

    def index(self) -> int | None:
        """Return the count at the last index pulse."""
        return self._index

    def close(self) -> None:
        """Release the lines."""
        self._request.release()


def open_gpio_counter(
    chip: str, line_a: int, line_b: int, line_index: int | None = None
) -> GpioCounter:
    """Request the lines of one encoder and count from zero.

    Raises:
        SensorError: `gpiod` is missing or of its first generation, or the lines are not to
            be had.
    """
    gpiod = _bindings()
    line = importlib.import_module("gpiod.line")
    both = gpiod.LineSettings(direction=line.Direction.INPUT, edge_detection=line.Edge.BOTH)
    config: dict[tuple[int, ...], Any] = {(line_a, line_b): both}
    if line_index is not None:
        config[line_index,] = gpiod.LineSettings(
            direction=line.Direction.INPUT, edge_detection=line.Edge.RISING
        )
    try:
        request = gpiod.request_lines(
            chip, config=config, consumer="twbr_estimation", event_buffer_size=EVENT_BUFFER
        )
    except (OSError, ValueError) as error:
        raise SensorError(f"{chip}, lines {line_a} and {line_b}: {error}") from None
    return GpioCounter(request, line_a, line_b, line_index)


def _bindings() -> Any:
    try:
        gpiod = importlib.import_module("gpiod")
    except ImportError:
        raise SensorError(f"gpiod is not installed; {INSTALL}") from None
    if not hasattr(gpiod, "request_lines"):
        raise SensorError(f"this gpiod has the interface of libgpiod 1; {INSTALL}")
    return gpiod
