"""CPU time of commands as a user runs them, on the bundled recording of 40 s.

    python bench/bench_commands.py [--before CHECKOUT] [--warm]

With the checkout of an earlier version each command is measured there, too, in turns, and the
ratio is given. The first table is that of all filters with nothing compiled yet, on the clock;
`--warm` leaves it out.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rows import row

ROOT = Path(__file__).resolve().parent.parent
BAG = ROOT / "bags" / "verification"
TARGET = "TARGET"
"""Stands for a place to write to."""
COMMANDS = {
    "twbr --help": (["--help"], 0.21),
    "twbr report of 40 s": (["report", str(BAG), "--overwrite", "-o", TARGET], 0.4),
    "warm twbr evaluate --filter ins_odometer": (
        ["evaluate", str(BAG), "--filter", "ins_odometer", "--json", TARGET],
        0.57,
    ),
}
"""Commands, and their required share of what they took before."""
FIRST_TABLE = 8.0
"""Required of the first table on a fresh machine of two processors [s]."""


def measured(checkout: Path, command: list[str], **changed: str) -> tuple[float, float]:
    """Return time on the clock and CPU time [s] of `twbr` in a checkout."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(checkout),
        "PYTHONDONTWRITEBYTECODE": "",  # as users have it: modules are translated once
        "TWBR_NO_BACKGROUND": "1",
        **changed,
    }
    begin = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "twbr_estimation.cli.main", *command],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=environment,
        cwd=checkout,
    )
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"twbr {' '.join(command)} failed in {checkout}")
    return time.perf_counter() - begin, usage.ru_utime + usage.ru_stime


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--before", type=Path, help="checkout of an earlier version")
    parser.add_argument("--repeats", type=int, default=5, help="the best run counts")
    parser.add_argument("--warm", action="store_true", help="leave out the first table")
    arguments = parser.parse_args()
    checkouts = [ROOT, *([arguments.before] if arguments.before else [])]
    subprocess.run([sys.executable, "-m", "twbr_estimation.batch.precompile"], check=True, cwd=ROOT)
    with tempfile.TemporaryDirectory() as folder:
        for name, (command, required) in COMMANDS.items():
            target = str(Path(folder, command[0]))
            words = [target if word == TARGET else word for word in command]
            for checkout in checkouts:
                measured(checkout, words)
            runs = [
                [measured(checkout, words)[1] for checkout in checkouts]
                for _ in range(arguments.repeats)
            ]
            best = [min(each) for each in zip(*runs, strict=True)]
            found = f"{best[0]:.2f} s of CPU"
            if len(best) > 1:
                found += f", {best[0] / best[1]:.2f} of {best[1]:.2f} s before"
            row(name, found, f"{required:g} of what it was")
        if arguments.warm:
            return 0
        fresh = str(Path(folder, "nothing_compiled"))
        clock, cpu = measured(ROOT, ["evaluate", str(BAG)], NUMBA_CACHE_DIR=fresh)
    row("first table", f"{clock:.1f} s, {cpu:.1f} s of CPU", f"{FIRST_TABLE:g} s on two cores")
    return 0


if __name__ == "__main__":
    sys.exit(main())
