"""Memory that is freed but not given back to the system."""

from __future__ import annotations

import ctypes
from contextlib import suppress

PERIOD = 60.0
"""Time between two times of giving back [s]."""


def give_back() -> None:
    """Return freed memory to the system.

    The arrays of a history that are allocated every second leave gaps between the middleware's
    small pieces, which glibc keeps: tens of megabytes in an hour. Other C libraries have no such
    function.
    """
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
