"""Loops compiled ahead of use: `python -m twbr_estimation.batch.precompile [FILTER ...]`.

Compiles the correction's loop and those of the filters named, or of all, in as many processes
as there are cores, and leaves them in the cache on disk. Loops that are there are left alone.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..errors import TwbrError, WorkerError
from ..filters.base import Filter, filter_named, filters
from ..live_code.files import folders
from ..pipeline import correction
from ..pipeline.coefficients import derive
from ..robot import Robot, Setup
from ..samples import STANDARD_GRAVITY, Sample, TiltEstimate
from .kernels import is_ours
from .loops import CORRECTION, CompiledLoop, loop_of_correction, loop_of_filter

SLOWEST_FIRST = ("ins_odometer", "dynamic_calibrating", "dynamic_yaw", "dynamic_planar", CORRECTION)
LONGEST = 600.0
"""Time that one loop may take to compile [s]."""
NO_BACKGROUND = "TWBR_NO_BACKGROUND"
"""Environment variable that keeps `compile_later` from starting a process."""

Report = Callable[[int, int], None]
"""Takes how many loops are compiled, and of how many."""


def missing(entries: Iterable[Filter]) -> list[str]:
    """Return the loops these filters need that a file could hold and does not, slowest first."""
    needed = [CORRECTION, *(entry.name for entry in entries if is_ours(entry))]
    names = [name for name in needed if _lacks(usual_loop(name))]
    order = {name: place for place, name in enumerate(SLOWEST_FIRST)}
    return sorted(names, key=lambda name: order.get(name, len(order)))


def _lacks(loop: CompiledLoop) -> bool:
    return loop.can_be_kept and not loop.is_ready


def usual_loop(name: str) -> CompiledLoop:
    """Return the loop of a filter, or of the correction, for the usual robot and calibration."""
    derived = derive(Setup())
    first = Sample(0.1, 0.0, 0.0, 0.0, 0.0, 0.0, STANDARD_GRAVITY)
    if name == CORRECTION:
        return loop_of_correction(first, derived)
    entry, sample = filter_named(name), correction.start(first, derived)[1]
    coefficients = entry.derive(entry.configure(), Robot())
    state = entry.reset(TiltEstimate(sample.angle, sample.gyro_y), sample, coefficients)
    return loop_of_filter(entry, sample, coefficients, state)


def compile_loop(name: str) -> None:
    """Compile one loop and keep it in a file."""
    usual_loop(name).compile()


def compile_missing(entries: Iterable[Filter], report: Report = lambda done, total: None) -> None:
    """Compile the loops that these filters need and the cache does not hold, on all cores.

    Args:
        entries: the filters; those of a user are left out.
        report: called after each loop.

    Raises:
        WorkerError: a process died.
    """
    names = missing(entries)
    if not names:
        return
    import multiprocessing  # which takes longer to import than most runs have time for

    from ..processes import end_with_parent, interrupts_held

    with interrupts_held():
        jobs = min(os.cpu_count() or 1, len(names))
        pool = multiprocessing.get_context("spawn").Pool(jobs, end_with_parent)
    with pool:
        compiled = pool.imap_unordered(compile_loop, names)
        for done in range(len(names)):
            report(done, len(names))
            try:
                compiled.next(LONGEST)
            except multiprocessing.TimeoutError:
                raise WorkerError(f"compiling: no loop was done within {LONGEST:g} s") from None
    report(len(names), len(names))


def compile_later(entries: Iterable[Filter]) -> bool:
    """Start a process of low priority that compiles what is missing, and return whether it is.

    It outlives this one. Only one of its kind runs at a time.
    """
    if os.environ.get(NO_BACKGROUND):
        return False
    names = missing(entries)
    if names:
        import subprocess

        subprocess.Popen(
            [sys.executable, "-m", __spec__.name, "--background", *names],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
    return bool(names)


def _lock_file() -> Path:
    """Return a file in the first folder for loops that can be written.

    Raises:
        WorkerError: there is none.
    """
    for folder in folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / "compiling.lock"
            path.touch()
        except OSError:
            continue
        return path
    raise WorkerError(
        f"none of {', '.join(map(str, folders()))} can be written: set `NUMBA_CACHE_DIR`"
    )


@contextmanager
def _alone(wait: bool) -> Iterator[None]:
    """Hold the lock of the cache's folder.

    Raises:
        BlockingIOError: another process holds it, and `wait` is not set.
    """
    with _lock_file().open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        yield


def main(arguments: Sequence[str] | None = None) -> int:
    """Compile and show how far it is; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[2])
    parser.add_argument("names", nargs="*", metavar="FILTER", help="default: all")
    parser.add_argument("--background", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    if chosen.background:
        os.nice(10)
    names = [name for name in chosen.names if name != CORRECTION]

    def report(done: int, total: int) -> None:
        print(f"\rcompiling: {done} of {total} loops", end="", file=sys.stderr, flush=True)

    try:
        entries = [filter_named(name) for name in names] if chosen.names else filters().values()
        with _alone(wait=not chosen.background):
            compile_missing(entries, report)
    except BlockingIOError:
        return 0
    except TwbrError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print(file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
