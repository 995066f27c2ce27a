"""What a command or a node does first, before numpy is imported, to be ready sooner."""

from __future__ import annotations

import gc
import os

GARBAGE_THRESHOLD = 200_000
"""Objects between two searches for garbage: at Python's 700 they take a fifth of a short command's
time, and a thirtieth of the start of a node."""


def start_quickly() -> None:
    """Seldom search for garbage, and keep numpy from starting threads unless the user wants some.

    They pay for large matrices, which we have few of, and wait busily for 0.1 s of CPU time.
    """
    gc.set_threshold(GARBAGE_THRESHOLD)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
