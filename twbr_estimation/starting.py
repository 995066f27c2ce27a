"""What a command or a node does first, before numpy is imported, to be ready sooner."""

from __future__ import annotations

import gc
import os
import signal

GARBAGE_THRESHOLD = 200_000
"""Objects between two searches for garbage: at Python's 700 they take a fifth of a short command's
time, and a thirtieth of the start of a node."""
THREADS = ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS")
"""Variables from which numpy takes its number of threads, the first that is set."""
_USUAL = gc.get_threshold()[0]


def start_quickly() -> None:
    """Seldom search for garbage, and keep numpy from starting threads unless the user wants some.

    They pay for large matrices, which we have few of, and wait busily for 0.1 s of CPU time.
    """
    gc.set_threshold(GARBAGE_THRESHOLD)
    if not any(name in os.environ for name in THREADS):
        os.environ["OPENBLAS_NUM_THREADS"] = "1"


def start_node() -> None:
    """Start quickly; Ctrl-C ends the process without a traceback while it imports its node."""
    start_quickly()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def search_as_usual() -> None:
    """Search for garbage as before `start_quickly`, where it was called."""
    if gc.get_threshold()[0] == GARBAGE_THRESHOLD:
        gc.set_threshold(_USUAL)
