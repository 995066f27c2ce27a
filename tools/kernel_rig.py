"""Run the tests of `test/hardware` in a Linux kernel of their own, without root or KVM.

User-Mode Linux is built once from Debian's `linux-source` and kept in a cache folder outside the
checkout; with the files of `test/kernel_rig` it has an I2C adapter, counters and GPIO lines for
the drivers to read. The file system inside is that of this machine, read-only.

    python tools/kernel_rig.py                          # builds what is missing, then tests
    python tools/kernel_rig.py --tests test/hardware/test_drivers.py
    python tools/kernel_rig.py --source linux-source-6.12.tar.xz

It needs an x86-64 machine with gcc, make, flex, bison and bc, 2 GB of disk and about 12 minutes of
one core the first time; without `--source` also Debian's apt-get.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RIG = ROOT / "test" / "kernel_rig"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "twbr_estimation"
TOOLS = ("gcc", "make", "flex", "bison", "bc", "xz", "tar")
LONGEST_RUN = 900.0
"""Time after which a kernel that does not end is killed [s]."""
CONSOLE = ("con=null", "con0=fd:0,fd:1", "console=tty0")


class RigError(Exception):
    """The rig cannot be built or run; the text says why."""


def run(command: Sequence[str | Path], folder: Path) -> None:
    """Run one step of the build.

    Raises:
        RigError: it fails.
    """
    print("+", *command, flush=True)
    done = subprocess.run([str(part) for part in command], cwd=folder, check=False)
    if done.returncode:
        raise RigError(f"{command[0]} ended with status {done.returncode}")


def require_tools() -> None:
    """Check what the build needs.

    Raises:
        RigError: a program is missing.
    """
    if missing := [name for name in TOOLS if shutil.which(name) is None]:
        raise RigError(f"missing: {', '.join(missing)}; apt-get install {' '.join(missing)}")


def source_archive(folder: Path, given: Path | None) -> Path:
    """Return the archive of the kernel's source, downloaded where it is not given.

    Raises:
        RigError: there is none to be had.
    """
    if given is not None:
        return given.resolve()
    if found := sorted(folder.glob("usr/src/linux-source-*.tar.xz")):
        return found[-1]
    listed = subprocess.run(
        ["apt-cache", "search", "--names-only", r"^linux-source-[0-9.]+$"],
        capture_output=True,
        text=True,
        check=False,
    ).stdout
    names = re.findall(r"^linux-source-([0-9.]+)", listed, re.MULTILINE)
    if not names:
        raise RigError("apt has no linux-source; apt-get update, or give --source ARCHIVE")
    newest = max(names, key=lambda name: [int(part) for part in name.split(".")])
    run(["apt-get", "download", f"linux-source-{newest}"], folder)
    for package in folder.glob("linux-source-*.deb"):
        run(["dpkg-deb", "-x", package, folder], folder)
    if found := sorted(folder.glob("usr/src/linux-source-*.tar.xz")):
        return found[-1]
    raise RigError("the package of linux-source holds no .tar.xz; give --source ARCHIVE")


def build_kernel(folder: Path, given: Path | None, jobs: int) -> Path:
    """Return the folder of the built kernel; a kernel of the same configuration is kept."""
    archive = source_archive(folder, given)
    key = hashlib.sha256(f"{archive.name}\n{(RIG / 'config').read_text()}".encode()).hexdigest()
    build, source = folder / f"build-{key[:12]}", folder / archive.name.removesuffix(".tar.xz")
    if (build / "linux").exists():
        return build
    if not (source / "Makefile").exists():
        run(["tar", "-xJf", archive], folder)
    build.mkdir(exist_ok=True)
    make = ["nice", "make", "-s", f"-j{jobs}", "ARCH=um", f"O={build}"]
    run([*make, "tinyconfig"], source)
    merge = ["scripts/kconfig/merge_config.sh", "-m", "-O", str(build), str(build / ".config")]
    run([*merge, RIG / "config"], source)
    run([*make, "olddefconfig"], source)
    run([*make, "linux", "modules"], source)
    return build


def build_modules(build: Path, jobs: int) -> Path:
    """Return the folder of the rig's modules, built for this kernel."""
    folder = build / "rig"
    folder.mkdir(exist_ok=True)
    for path in (*RIG.glob("*.c"), RIG / "Makefile"):
        if (
            not (folder / path.name).exists()
            or path.read_text() != (folder / path.name).read_text()
        ):
            shutil.copy(path, folder)
    run(["make", "-s", f"-j{jobs}", "ARCH=um", f"M={folder}", "modules"], build)
    return folder


def boot(build: Path, modules: Path, tests: str, memory: str) -> int:
    """Boot the kernel with the tests as its only purpose; return pytest's exit status.

    Raises:
        RigError: it ends before the tests do.
    """
    given = {
        "RIG_MODULES": modules,
        "RIG_PROJECT": ROOT,
        "RIG_PYTHON": sys.executable,
        "RIG_TESTS": tests,
    }
    command = [str(build / "linux"), f"mem={memory}", "root=/dev/root", "rootfstype=hostfs"]
    command += ["rootflags=/", "ro", "quiet", *CONSOLE, f"init={RIG / 'init'}"]
    command += [f'{name}="{value}"' for name, value in given.items()]  # values may hold spaces
    print("+", *command, flush=True)
    status = None
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, errors="replace"
    ) as kernel:
        assert kernel.stdout is not None
        for line in kernel.stdout:
            print(line, end="", flush=True)
            if found := re.search(r"rig: exit (\d+)", line):
                status = int(found[1])
                break
        try:
            kernel.wait(10.0 if status is not None else LONGEST_RUN)
        except subprocess.TimeoutExpired:
            kernel.kill()
    if status is None:
        raise RigError("the kernel ended before the tests did")
    return status


def main() -> int:
    """Build what is missing, run, and return the exit status of the tests."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cache", type=Path, default=CACHE / "kernel_rig", help="build folder")
    parser.add_argument("--source", type=Path, help="archive of a kernel's source, .tar.xz")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="compilers at once")
    parser.add_argument("--memory", default="512M", help="of the kernel")
    parser.add_argument("--tests", default="test/hardware", help="what pytest runs")
    given = parser.parse_args()
    try:
        require_tools()
        given.cache.mkdir(parents=True, exist_ok=True)
        build = build_kernel(given.cache.resolve(), given.source, given.jobs)
        modules = build_modules(build, given.jobs)
        return boot(build, modules, given.tests, given.memory)
    except RigError as error:
        print(f"kernel_rig: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
