"""Run every bench of a folder, one after the other, and say which could not run and which failed.

    python tools/run_benches.py [FOLDER]

A bench that lacks a package or a program says what it needs and counts as left out; any other
exit status than 0 counts as a failure. The exit status is 1 where a bench failed.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "bench"
OWN = "twbr_estimation"
TABLE = "TWBR_BENCH_TABLE"
"""Environment variable with the file to which benches append rows of the table at the end."""
MISSING = re.compile(r"^ModuleNotFoundError: No module named '([\w.]+)'$", re.MULTILINE)


def missing_package(errors: str, folder: Path) -> str | None:
    """Return the package from elsewhere whose lack ended a bench, or None for another reason."""
    found = MISSING.findall(errors)
    package = str(found[-1]).partition(".")[0] if found else OWN
    ours = package == OWN or (folder / f"{package}.py").exists()
    return None if ours else package


def run(bench: Path) -> tuple[int, str]:
    """Run a bench and pass on what it writes; return its exit status and its error output."""
    process = subprocess.Popen([sys.executable, str(bench)], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    errors = []
    for line in process.stderr:
        errors.append(line)
        print(line, end="", file=sys.stderr, flush=True)
    return process.wait(), "".join(errors)


def main(folder: Path = FOLDER) -> int:
    """Run `bench_*.py` of a folder in alphabetical order."""
    left_out, failed = [], []
    with tempfile.NamedTemporaryFile("r", encoding="utf-8") as rows:
        os.environ[TABLE] = rows.name
        for bench in sorted(folder.glob("bench_*.py")):
            print(f"\n== {bench.stem}", flush=True)
            status, errors = run(bench)
            if status and (package := missing_package(errors, folder)):
                left_out.append(f"{bench.stem}: needs the package {package}")
            elif status:
                failed.append(f"{bench.stem}: exit status {status}")
        if lines := rows.read():
            print(f"\n| measure | found | required |\n|---|---|---|\n{lines}", end="")
    for title, found in (("left out", left_out), ("failed", failed)):
        for text in found:
            print(f"{title}: {text}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:2])))
