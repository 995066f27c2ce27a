"""A thread that cuts the motors if the node does not respond in time.

The executor may be stuck in a callback, or wait on a system clock that was set back. The thread
sleeps on the steady clock and publishes zeros. It does not log, which can block, too.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event, Thread

from ..streams.control.deadline import Deadline

LONGEST_SLEEP = 0.1
"""Time after which it looks whether it is stopped [s]."""


class MotorWatch:
    """Runs from its creation until `stop`."""

    def __init__(self, deadline: Deadline, cut: Callable[[], None]) -> None:
        """Start the thread.

        Args:
            deadline: What it watches.
            cut: Cuts the motors; called in this thread.
        """
        self._deadline, self._cut = deadline, cut
        self._stopped = Event()
        self._thread = Thread(target=self._run, name="motor watch", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stopped.set()
        self._thread.join(10.0 * LONGEST_SLEEP)

    def _run(self) -> None:
        while not self._stopped.is_set():
            due, sleep = self._deadline.check(time.monotonic())
            if due:
                try:
                    self._cut()
                except Exception:  # a context that ends; the next attempt comes at once
                    self._stopped.wait(0.0)
            # Not Event.wait, which may wait on the system's clock.
            time.sleep(max(min(sleep, LONGEST_SLEEP), 0.001))
