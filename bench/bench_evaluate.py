"""How long `twbr evaluate` takes for a ten-minute recording at 500 Hz with all filters.

The whole command in a fresh process: imports, reading, correction, every filter, figures. It
runs once beforehand, so that compiled loops come from the cache as they do for a user. CPU time
stands beside the time on the clock because other work on the machine stretches only the latter.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from bench_reading import PERIOD_NS, make_recording

from twbr_estimation.bags import write_recording

REQUIRED_SECONDS = 3.0
REQUIRED_MEGABYTES = 600.0


def measured(command: list[str]) -> tuple[float, float, float]:
    """Run a command; return its time on the clock [s], CPU time [s] and peak memory [MB]."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    elapsed = time.perf_counter() - start
    if status:
        raise SystemExit(f"{' '.join(command)} failed")
    return elapsed, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--repeats", type=int, default=3, help="the best run counts")
    arguments = parser.parse_args()
    samples = round(arguments.minutes * 60e9 / PERIOD_NS)
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder, "bag")
        write_recording(bag, make_recording(samples))
        command = [sys.executable, "-m", "twbr_estimation.cli.main", "evaluate", str(bag)]
        measured(command)
        runs = [measured(command) for _ in range(arguments.repeats)]
    clock, cpu, memory = (min(values) for values in zip(*runs, strict=True))
    print(
        f"twbr evaluate, all filters, {samples} samples: {clock:.2f} s on the clock, {cpu:.2f} s "
        f"of CPU (required {REQUIRED_SECONDS:g} s on an idle machine), "
        f"peak memory {memory:.0f} MB (required {REQUIRED_MEGABYTES:g} MB)"
    )


if __name__ == "__main__":
    main()
