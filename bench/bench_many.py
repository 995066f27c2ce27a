"""Many recordings: efficiency of two workers, a cluster with accidents, memory, as ratios.

    python bench/bench_many.py [--recordings 200] [--seconds 8]

All filters run on short simulated recordings by `twbr evaluate`. The efficiency of two processes
is the CPU time that one process takes for everything over that of two with their parent: on a
machine that others use, the clock shows the others, too. The figures of all runs must be equal to
the last bit, with a worker killed and the scheduler restarted on the way, and in a run that is cut
and started again. A run that is repeated must add nothing to its table.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rows import row

from twbr_estimation.cli.simulate import write_simulated
from twbr_estimation.simulation import simulate

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "test"))

EFFICIENCY = 0.9
"""Required of two workers."""
_ADOPT = 36  # PR_SET_CHILD_SUBREAPER
GROWTH = 1.1
"""Peak memory with all recordings over that with a quarter of them, at most."""


class Run(NamedTuple):
    """What one command took."""

    clock: float
    """[s]."""
    cpu: float
    """Of the process and its children [s]."""
    memory: float
    """Peak of the process itself [MB]."""
    figures: dict[tuple[str, str], object]
    """Results by content of the recording and filter."""


def figures_of(table: Path) -> dict[tuple[str, str], object]:
    """Return the results in a table."""
    rows = map(json.loads, table.read_text().splitlines())
    return {(row["recording"], row["filter"]): row["result"] for row in rows if row["result"]}


def adopt_orphans() -> None:
    """Become the parent of processes whose own parent ends: worker processes of a command."""
    if ctypes.CDLL(None).prctl(_ADOPT, 1, 0, 0, 0):
        raise SystemExit("many recordings: the CPU time of workers cannot be had on this system")


def cpu_of_orphans() -> float:
    """Wait for the processes that a command left, and return their CPU time [s]."""
    total = 0.0
    while True:
        try:
            _, _, usage = os.wait4(-1, 0)
        except ChildProcessError:
            return total
        total += usage.ru_utime + usage.ru_stime


def evaluated(
    places: list[Path], table: Path, *where: str, meanwhile: Callable[[Path], None] | None = None
) -> Run:
    """Evaluate recordings in a process of their own; `meanwhile` gets the growing table."""
    command = [sys.executable, "-m", "twbr_estimation.cli.main", "evaluate", *map(str, places)]
    begin = time.perf_counter()
    process = subprocess.Popen(
        [*command, "--results", str(table), *where],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    if meanwhile is not None:
        meanwhile(table)
    _, status, usage = os.wait4(process.pid, 0)
    clock = time.perf_counter() - begin
    if status:
        raise SystemExit(f"twbr evaluate {' '.join(where)} failed")
    figures = figures_of(table)
    cpu = usage.ru_utime + usage.ru_stime
    if meanwhile is None:
        cpu += cpu_of_orphans()
    return Run(clock, cpu, usage.ru_maxrss / 1024.0, figures)


def wait_for_rows(table: Path, share: float, expected: int) -> None:
    """Wait until a table holds this share of its rows."""
    while not table.exists() or table.read_bytes().count(b"\n") < share * expected:
        time.sleep(0.1)


def cut_and_continued(places: list[Path], folder: Path, expected: int) -> tuple[int, Run]:
    """Kill a run on two workers on the way and start it again.

    Returns:
        Rows that the first run left, and the second run, of which `figures` are those of both.
    """
    table = folder / "cut.jsonl"
    command = [sys.executable, "-m", "twbr_estimation.cli.main", "evaluate", *map(str, places)]
    process = subprocess.Popen(
        [*command, "--results", str(table), "--jobs", "2"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    wait_for_rows(table, 0.4, expected)
    process.kill()
    process.wait()
    cpu_of_orphans()
    left = table.read_bytes().count(b"\n")
    return left, evaluated(places, table, "--jobs", "2")


def with_accidents(places: list[Path], folder: Path, expected: int) -> Run | None:
    """Evaluate on a cluster, kill a worker on the way and restart the scheduler."""
    try:
        import distributed  # noqa: F401

        from workers.cluster import Cluster  # of the tests
    except ImportError:
        print("  cluster: needs the package distributed; left out")
        return None
    cluster = Cluster(folder)

    def accidents(table: Path) -> None:
        wait_for_rows(table, 0.2, expected)
        cluster.workers["first"].kill()
        wait_for_rows(table, 0.5, expected)
        cluster.kill()
        cluster.start()

    try:
        table = folder / "cluster.jsonl"
        return evaluated(places, table, "--dask", cluster.address, meanwhile=accidents)
    finally:
        cluster.kill()


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--recordings", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=8.0, help="length of each")
    arguments = parser.parse_args()
    adopt_orphans()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        places = [folder / f"run{number}" for number in range(arguments.recordings)]
        for number, place in enumerate(places):
            write_simulated(place, simulate("paper", 0.002, arguments.seconds, 1000 + number))
        evaluated(places[:1], folder / "warm.jsonl", "--jobs", "1")
        quarter = evaluated(places[: len(places) // 4], folder / "quarter.jsonl", "--jobs", "1")
        one = evaluated(places, folder / "one.jsonl", "--jobs", "1")
        two = evaluated(places, folder / "two.jsonl", "--jobs", "2")
        before = (folder / "two.jsonl").read_bytes()
        repeated = evaluated(places, folder / "two.jsonl", "--jobs", "2")
        unchanged = (folder / "two.jsonl").read_bytes() == before
        left, continued = cut_and_continued(places, folder, len(one.figures))
        many = with_accidents(places, folder, len(one.figures))
    again = report_again(one, repeated, unchanged, left, continued)
    return report(quarter, one, two, many) | again


def report_again(one: Run, repeated: Run, unchanged: bool, left: int, continued: Run) -> int:
    """Print how runs that are repeated and continued went, and return 1 where not as required."""
    print(f"many recordings, {len(one.figures)} parts (recordings x filters):")
    print(f"  repeated: {repeated.cpu:.1f} s of CPU")
    print(f"  killed after {left} rows and started again: {continued.cpu:.1f} s of CPU")
    same = continued.figures == one.figures
    row("table of a repeated run", "unchanged" if unchanged else "CHANGED", "unchanged")
    row("figures of a run that is cut and continued", "equal" if same else "DIFFER", "equal")
    return 0 if unchanged and same else 1


def report(quarter: Run, one: Run, two: Run, many: Run | None) -> int:
    """Print the figures and return 1 where one is not as required."""
    efficiency, growth = one.cpu / two.cpu, one.memory / quarter.memory
    same = one.figures == two.figures and (many is None or many.figures == one.figures)
    print(f"  one process {one.clock:.1f} s, {one.cpu:.1f} s of CPU, {one.memory:.0f} MB")
    print(f"  two processes {two.clock:.1f} s, {two.cpu:.1f} s of CPU with their parent")
    said = "left out" if many is None else f"{many.clock:.1f} s"
    print(f"  cluster, a worker killed and the scheduler restarted: {said}")
    by_clock = one.clock / (2.0 * two.clock)
    found = f"{efficiency:.2f} by CPU time, {by_clock:.2f} by the clock"
    row("efficiency of two workers", found, f"{EFFICIENCY:g}")
    row("memory with four times the recordings", f"x {growth:.2f}", f"x {GROWTH:g} at most")
    row("figures with one, two, and a cluster's workers", "equal" if same else "DIFFER", "equal")
    return 0 if same and efficiency >= EFFICIENCY and growth <= GROWTH else 1


if __name__ == "__main__":
    sys.exit(main())
