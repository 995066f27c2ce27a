"""Count the instructions of a sample on an emulated arm64, for those parts that need no ROS.

    python bench/instructions_arm64.py SYSTEM [PART ...]

SYSTEM is a folder with an arm64 Debian that has Python and the package's dependencies. Needs gcc,
QEMU for programs (Debian's `qemu-user`; the static one has no plugins) and its header
`qemu-plugin.h`, from the folder `include/qemu` of its source. The parts are those of
`bench/instructions.py`, interpreted.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
SUBJECTS = HERE / "instruction_subjects.py"
PARTS = (
    "correction_step",
    "correction_stream",
    "filter_step",
    "watched_filter",
    "read_fifo",
    "read_burst",
    "read_encoders",
    "quick_checks",
)
_MARK = re.compile(r"^marked at (\d+)$", re.MULTILINE)


def compiled(headers: Path, folder: Path) -> Path:
    """Compile the plugin into a folder."""
    plugin = folder / "libmarked_count.so"
    command = ["gcc", "-O2", "-shared", "-fPIC", f"-I{headers}", "-o", str(plugin)]
    subprocess.run([*command, str(HERE / "qemu_plugin" / "marked_count.c")], check=True)
    return plugin


def counted(part: str, turns: int, emulator: list[str], packages: Path) -> float:
    """Return the instructions of one turn of a part.

    Raises:
        RuntimeError: it failed.
    """
    search = os.pathsep.join(str(each) for each in (HERE.parent, packages))
    fixed = {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": search}
    process = subprocess.run(
        [*emulator, str(SUBJECTS), part, str(turns)],
        env={**os.environ, **fixed},
        capture_output=True,
        text=True,
        check=False,
    )
    marks = [int(each) for each in _MARK.findall(process.stderr)]
    if process.returncode or len(marks) != 2:
        raise RuntimeError(f"{part}: {process.stderr[-2000:]}")
    return (marks[1] - marks[0]) / turns


def main() -> int:
    """Count what the command line asks for, or everything."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("system", type=Path, help="folder of the arm64 system")
    parser.add_argument("parts", nargs="*", metavar="PART")
    parser.add_argument("--turns", type=int, default=100, help="that are counted")
    parser.add_argument("--qemu", default="qemu-aarch64", help="QEMU with plugins")
    parser.add_argument("--headers", type=Path, default=Path("/usr/include"), help="its header")
    parser.add_argument("--python", default="usr/bin/python3", help="in the system")
    parser.add_argument("--packages", default="usr/lib/python3/dist-packages", help="in the system")
    given = parser.parse_args()
    system = given.system.resolve()
    with tempfile.TemporaryDirectory() as folder:
        plugin = compiled(given.headers, Path(folder))
        emulator = [given.qemu, "-L", str(system), "-plugin", str(plugin)]
        emulator.append(str(system / given.python))
        for part in given.parts or PARTS:
            count = counted(part, given.turns, emulator, system / given.packages)
            print(f"{part:24}{count:12,.0f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
