"""CPU time of tuning all filters on 60 s at 500 Hz, by `twbr tune` in one process and in two.

python bench/bench_tune.py [--seconds 60]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml
from rows import row

from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.simulation import simulate

REQUIRED = "4 s for 60 s on two idle processors"


def tuned(bag: Path, jobs: int) -> tuple[float, float, dict[str, Any]]:
    """Tune in a process of its own; return time on the clock, CPU time [s] and what was found."""
    target = bag.with_name(f"tuned{jobs}.yaml")
    command = [sys.executable, "-m", "twbr_estimation.cli.main", "tune", str(bag)]
    command += ["--overwrite", "-o", str(target), "--jobs", str(jobs)]
    begin = time.perf_counter()
    before = os.times()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = os.times()
    cpu = after.children_user + after.children_system
    cpu -= before.children_user + before.children_system
    elapsed = time.perf_counter() - begin
    found = yaml.safe_load(target.read_text())["/**"]["ros__parameters"]
    found.pop("provenance")  # names command and date
    return elapsed, cpu, found


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="length of the recording")
    arguments = parser.parse_args()
    subprocess.run([sys.executable, "-m", "twbr_estimation.batch.precompile"], check=True)
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder, "bag")
        write_simulated(bag, simulate("paper", 0.002, arguments.seconds, 77))
        one, two = (tuned(bag, jobs) for jobs in (1, 2))
    found = f"{one[1]:.1f} s of CPU in one process; in two {two[0]:.1f} s on the clock"
    row(
        f"tune all filters, {arguments.seconds:g} s at 500 Hz",
        found,
        REQUIRED,
    )
    row("tuned values by one process and two", "equal" if one[2] == two[2] else "DIFFER", "equal")
    return 0 if one[2] == two[2] else 1


if __name__ == "__main__":
    sys.exit(main())
