"""Count the instructions of a sample in each part of the live path, and what of a core that is.

    python bench/instructions.py [PART ...]

Needs valgrind. A part runs in callgrind, which counts between two marks after the start. What the
kernel does is not counted. Correction and filter of the nodes run as machine code where numba is
installed; beside each count is what ran.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import instruction_code

SUBJECTS = Path(__file__).with_name("instruction_subjects.py")
TURNS = 500
"""Turns that are counted; a first fifth of them is not."""
MARK = "getpriority"
"""Function of the C library that a subject calls before and after what is counted."""
_TOTAL = re.compile(r"^(?:summary|totals): (\d+)", re.MULTILINE)


class Count(NamedTuple):
    """What one turn of a part takes."""

    instructions: float
    form: str
    """What ran: machine code or interpreted; empty where there is no choice."""


def counted(part: str, code: Path, turns: int = TURNS) -> Count:
    """Count the instructions of one turn of a part.

    Args:
        part: Its name.
        code: Folder with machine code.
        turns: That are counted.

    Raises:
        RuntimeError: it failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}"]
        command += ["--instr-atstart=no", f"--dump-before={MARK}"]
        command += [sys.executable, str(SUBJECTS), part, str(turns), "callgrind"]
        environment = {**os.environ, "PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1"}
        environment |= instruction_code.environment(code)
        process = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False
        )
        profile = out.with_suffix(".2")
        if process.returncode or not profile.exists():
            raise RuntimeError(f"{part}: {process.stderr[-2000:]}")
        found = _TOTAL.search(profile.read_text())
        assert found is not None
        return Count(int(found.group(1)) / turns, process.stdout.strip())


def prepared(code: Path) -> str:
    """Prepare machine code in a folder; return why there is none, or an empty text."""
    command = [sys.executable, str(SUBJECTS.with_name("instruction_code.py"))]
    environment = {**os.environ, **instruction_code.environment(code)}
    result = subprocess.run(
        command, env=environment, stderr=subprocess.PIPE, text=True, check=False
    )
    return result.stderr.strip().rpartition("\n")[2] if result.returncode else ""


class Whole(NamedTuple):
    """A whole process: what it does beside its turns."""

    rate: float
    """Turns a second."""
    timers: int
    """Timers that make up a turn."""
    nodes: int
    """Each reports once a second."""
    watchdogs: int
    """Each looks 20 times a second."""


WHOLE = {
    "mpu6050_burst": Whole(500.0, 1, 1, 0),
    "estimation": Whole(200.0, 2, 5, 2),
    "estimation_interpreted": Whole(200.0, 2, 5, 2),
    "estimation_burst": Whole(500.0, 2, 5, 2),
    "estimation_control": Whole(200.0, 2, 6, 3),
}
BESIDE = ("executor_turn", "watchdog", "diagnostics")
"""Parts whose counts go into those of whole processes."""
PER_SECOND = {"Pi Zero 2": 0.33e9, "Pi 3B+": 0.47e9, "Pi 4": 1.0e9, "Pi 5": 1.85e9}
"""Instructions of an interpreter a second, assumed: see docs/wiring.md."""


def shares(counts: dict[str, float]) -> list[str]:
    """Return lines of what part of a core each whole process needs."""
    lines = [f"{'share of a core':24}" + "".join(f"{name:>11}" for name in PER_SECOND)]
    for name, whole in WHOLE.items():
        if name not in counts or not all(each in counts for each in BESIDE):
            continue
        turn = counts[name] + whole.timers * counts["executor_turn"]
        second = whole.rate * turn + whole.nodes * counts["diagnostics"]
        second += 20.0 * whole.watchdogs * counts["watchdog"]
        columns = "".join(f"{second / speed:11.2f}" for speed in PER_SECOND.values())
        lines.append(f"{name:24}{columns}   at {whole.rate:g} Hz")
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Count what the command line asks for, or everything."""
    if shutil.which("valgrind") is None:
        print("instructions: no valgrind here, so there is nothing to count with")
        return 0
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART")
    parser.add_argument("--turns", type=int, default=TURNS, help="that are counted")
    chosen = parser.parse_args(arguments)
    from instruction_subjects import subjects

    counts = {}
    with tempfile.TemporaryDirectory() as folder:
        code = Path(folder)
        if problem := prepared(code):
            print(f"no machine code: {problem}")
        for name in chosen.parts or subjects():
            found = counted(name, code, chosen.turns)
            counts[name] = found.instructions
            print(f"{name:24}{found.instructions:12,.0f}  {found.form}", flush=True)
    print(*shares(counts), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
