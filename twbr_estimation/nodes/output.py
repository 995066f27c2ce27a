"""Output that is not read must not stop a node that drives motors."""

from __future__ import annotations

import os
import stat
from contextlib import suppress

STREAMS = (1, 2)
"""Descriptors of standard output and standard error."""


def never_wait() -> None:
    """Let output to a terminal or pipe that takes none be lost, instead of waiting for it.

    The logger of rclpy writes while it holds the interpreter's lock: a terminal stopped by Ctrl-S,
    or a reader of a pipe that hangs, would stop every thread of the process, the one that cuts the
    motors included. Each stream is opened again for this, because the flag of the old one is shared
    with the shell. One that cannot be opened, such as a terminal of another user, stays as it is.
    """
    for stream in STREAMS:
        with suppress(OSError):
            kind = os.fstat(stream).st_mode
            if stat.S_ISSOCK(kind):  # of a service manager, for this process alone
                os.set_blocking(stream, False)
            elif os.isatty(stream) or stat.S_ISFIFO(kind):
                _open_anew(stream)


def _open_anew(stream: int) -> None:
    opened = os.open(f"/proc/self/fd/{stream}", os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
    os.dup2(opened, stream)
    os.close(opened)
