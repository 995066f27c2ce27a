"""Ctrl-C while worker processes start, and workers whose parent is killed."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

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


PROGRAM = """
import multiprocessing, os, time
from concurrent.futures import ProcessPoolExecutor
from twbr_estimation.processes import end_with_parent


def number(seconds):
    time.sleep(seconds)
    return os.getpid()


if __name__ == "__main__":
    context = multiprocessing.get_context("forkserver")
    with ProcessPoolExecutor(2, context, end_with_parent) as pool:
        found = set()
        while len(found) < 2:
            found |= set(pool.map(number, [0.1] * 4))
        print(*found, flush=True)
        time.sleep(600.0)
"""


def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    program = tmp_path / "pool.py"
    program.write_text(PROGRAM)
    with subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        workers = [int(word) for word in parent.stdout.readline().split()]
        assert len(workers) == 2 and all(map(_runs, workers))
        parent.kill()
    end = time.monotonic() + 60.0
    while any(map(_runs, workers)):
        assert time.monotonic() < end, f"{workers} outlive their parent"
        time.sleep(0.05)


def _runs(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
