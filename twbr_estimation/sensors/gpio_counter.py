"""Encoders on plain GPIO lines: the kernel queues the edges, this decodes the quadrature."""

from __future__ import annotations

import errno
import importlib
import os
from enum import Enum
from glob import glob
from typing import Any

from ..errors import SensorError

EVENT_BUFFER = 1024
"""Edges the kernel keeps between two reads."""
EVENTS_PER_READ = 4096
"""Edges decoded in one read at most; more would keep everything else waiting."""
ONE_INTERRUPT = 20_000
"""Edges of A and B closer than this were served by one interrupt, in an unknown order [ns]."""
SEQUENCE_NUMBERS = 2**32
"""The kernel numbers the edges of a request from 1, with so many numbers."""
INSTALL = "install the Python bindings of libgpiod 2: pip install 'gpiod>=2.1'"
CHIPS = "/dev/gpiochip*"
ADVICE = {
    errno.EACCES: "is the user in the group that a udev rule gives the chip to?",
    errno.EPERM: "is the user in the group that a udev rule gives the chip to?",
    errno.EBUSY: "another program or a kernel driver holds a line; gpioinfo shows which",
    errno.ENXIO: "the chip has no interrupts for these lines, as an expander without its own",
    errno.EINVAL: "does the chip have these lines, with interrupts and this bias?",
}
"""Likely cause, by the error."""

# Change of the count by (previous A, B; new A, B): A leads B when it rises.
_STEPS = (0, -1, 1, 0, 1, 0, 0, -1, -1, 0, 0, 1, 0, 1, -1, 0)


class Bias(str, Enum):
    """The chip's own resistor on a line."""

    AS_IS = "as_is"
    """As the device tree left it."""
    PULL_UP = "pull_up"
    """For encoders with open-collector outputs."""
    PULL_DOWN = "pull_down"
    DISABLED = "disabled"


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
        self.ambiguous = 0
        self.behind = 0
        self.zeroed_by_index = False
        self.remark = ""
        self._request = request
        self._line_a, self._line_b, self._line_index = line_a, line_b, line_index
        self._count = 0
        self._index: int | None = None
        self._sequence = 0
        self._last_edge, self._last_line = -ONE_INTERRUPT, line_a
        self._state = self._levels()
        self._uncertain = 0
        """Bits of the lines whose level is not known since edges were lost."""

    def _levels(self) -> int:
        a, b = self._request.get_values([self._line_a, self._line_b])
        return int(bool(a.value)) << 1 | int(bool(b.value))

    def read(self) -> int:
        """Decode the edges since the last read, not more than so many, and return the count."""
        left = EVENTS_PER_READ
        while self._request.wait_edge_events(0.0):
            if left <= 0:
                self.behind += 1
                break
            events = self._request.read_edge_events(EVENT_BUFFER)
            left -= len(events)
            for event in events:
                self._take(event)
        return self._count

    def _take(self, event: Any) -> None:
        self._follow_sequence(event.global_seqno)
        line = event.line_offset
        if line == self._line_index:
            self._index = self._count
            return
        if line != self._last_line and event.timestamp_ns - self._last_edge < ONE_INTERRUPT:
            self.ambiguous += 1
        self._last_edge, self._last_line = event.timestamp_ns, line
        bit = 2 if line == self._line_a else 1
        high = event.event_type == event.Type.RISING_EDGE
        if self._uncertain & bit:  # this edge gives its level before; counted already
            self._uncertain &= ~bit
            self._state = self._state & ~bit if high else self._state | bit
        state = self._state | bit if high else self._state & ~bit
        self.errors += state == self._state  # the edge before this one was missed
        self._count += _STEPS[self._state << 2 | state]
        self._state = state

    def _follow_sequence(self, number: int) -> None:
        """Count the numbers that are left out; one that comes late was counted already."""
        half = SEQUENCE_NUMBERS // 2
        ahead = (number - self._sequence + half) % SEQUENCE_NUMBERS - half
        if ahead > 0:
            self._sequence = number
            if ahead > 1:
                self.errors += ahead - 1
                self._uncertain = 3
        else:
            self.errors -= 1

    def index(self) -> int | None:
        """Return the count at the last index pulse."""
        return self._index

    def close(self) -> None:
        """Release the lines."""
        self._request.release()


def open_gpio_counter(
    chip: str,
    line_a: int,
    line_b: int,
    line_index: int | None = None,
    bias: Bias = Bias.AS_IS,
) -> GpioCounter:
    """Request the lines of one encoder and count from zero.

    Args:
        chip: Path of the chip, its label, such as `pinctrl-rp1`, or its name, as `gpiochip0`.
        line_a: Offset of the line that leads when the count rises.
        line_b: Offset of the line that follows.
        line_index: Offset of the index line, if any.
        bias: The chip's own resistors on the lines.

    Raises:
        SensorError: `gpiod` is missing or of its first generation, or the lines are not to
            be had.
    """
    gpiod = _bindings()
    line = importlib.import_module("gpiod.line")
    common = {"direction": line.Direction.INPUT, "bias": getattr(line.Bias, bias.name)}
    both = gpiod.LineSettings(edge_detection=line.Edge.BOTH, **common)
    config: dict[tuple[int, ...], Any] = {(line_a, line_b): both}
    if line_index is not None:
        config[line_index,] = gpiod.LineSettings(edge_detection=line.Edge.RISING, **common)
    path = chip if chip.startswith("/") else _path_of(gpiod, chip)
    try:
        request = gpiod.request_lines(
            path, config=config, consumer="twbr_estimation", event_buffer_size=EVENT_BUFFER
        )
    except (OSError, ValueError) as error:
        advice = ADVICE.get(getattr(error, "errno", None) or 0, _available(gpiod))
        raise SensorError(f"{path}, lines {line_a} and {line_b}: {error}; {advice}") from None
    return GpioCounter(request, line_a, line_b, line_index)


def _labels(gpiod: Any) -> dict[str, str]:
    """Return the labels of the chips by path; of one that cannot be opened, why.

    Links are left out: they are second names of chips that are there already.
    """
    found = {}
    for path in sorted(glob(CHIPS)):
        if os.path.islink(path):
            continue
        try:
            with gpiod.Chip(path) as chip:
                found[path] = str(chip.get_info().label) or "no label"
        except OSError as error:
            found[path] = error.strerror or str(error)
    return found


def _available(gpiod: Any) -> str:
    labels = _labels(gpiod)
    listed = ", ".join(f"{path} ({label})" for path, label in labels.items())
    return f"there are: {listed}" if listed else "this computer has no GPIO chip"


def _path_of(gpiod: Any, name: str) -> str:
    """Return the path of the chip with that label, or with that name in /dev."""
    labels = _labels(gpiod)
    found = [path for path, label in labels.items() if label == name]
    if len(found) > 1:
        raise SensorError(f"gpio_chip: {' and '.join(found)} are labelled {name!r}; give a path")
    if found or f"/dev/{name}" in labels:
        return found[0] if found else f"/dev/{name}"
    denied = errno.EACCES if os.strerror(errno.EACCES) in labels.values() else 0
    advice = f"; {ADVICE[denied]}" if denied else ""
    raise SensorError(f"gpio_chip: no chip is labelled {name!r}; {_available(gpiod)}{advice}")


def _bindings() -> Any:
    try:
        gpiod = importlib.import_module("gpiod")
    except ImportError:
        raise SensorError(f"gpiod is not installed; {INSTALL}") from None
    if not hasattr(gpiod, "request_lines"):
        raise SensorError(f"this gpiod has the interface of libgpiod 1; {INSTALL}")
    return gpiod
