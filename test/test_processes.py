"""Ctrl-C while worker processes start."""

import os
import signal
import threading

import pytest

from twbr_estimation.processes import interrupts_held


def test_ctrl_c_waits_for_the_end_although_another_thread_receives_it():
    idle = threading.Event()
    thread = threading.Thread(target=idle.wait)  # its signals are not blocked
    thread.start()
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    reached: list[int] = []

    def work() -> None:
        with interrupts_held():
            os.kill(os.getpid(), signal.SIGINT)
            for step in range(100_000):  # a handler would run between two steps
                reached[:] = [step]

    try:
        with pytest.raises(KeyboardInterrupt):
            work()
        assert reached == [99_999]
    finally:
        signal.signal(signal.SIGINT, before)
        idle.set()
        thread.join()


def test_without_ctrl_c_everything_is_as_before():
    handler, mask = signal.getsignal(signal.SIGINT), signal.pthread_sigmask(signal.SIG_BLOCK, ())
    with interrupts_held():
        assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert signal.getsignal(signal.SIGINT) == handler
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == mask
