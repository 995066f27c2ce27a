"""Set up `.venv` with this package and its tools; run by `make venv`, standard library only.

Does nothing when the last set-up still fits: same interpreter, same ROS, same requirements.
"""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
import sysconfig
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
STAMP = VENV / "set_up_for"
MADE_BY = VENV / "made_by"
"""Names the interpreter, so that `make` goes on with the one a user chose."""
NAME = "twbr_estimation"
REQUIREMENT_FILES = ("setup.py", "setup.cfg", "pyproject.toml", "tools/make_venv.py")
WHEELS_LOST = """\
No ROS 2 here: its wheels exist for Linux on x86-64 only, and no ROS 2 Jazzy is sourced.
The library, `twbr` and the recordings work; ROS nodes will not. On a Raspberry Pi take
Ubuntu 24.04 with ros-jazzy-ros-base from apt, source it, and run this again."""


def check_interpreter() -> None:
    """Stop with advice where this interpreter cannot make the environment."""
    if sys.version_info < (3, 10):  # noqa: UP036 - this is what checks it
        stop(f"Python 3.10 or newer is needed, {sys.executable} is {platform.python_version()}")
    if find_spec("venv") is None or find_spec("ensurepip") is None:
        version = f"{sys.version_info[0]}.{sys.version_info[1]}"
        stop(
            f"{sys.executable} cannot make virtual environments (no venv or ensurepip).\n"
            f"On Debian and Ubuntu: sudo apt install python3-venv (or python{version}-venv)"
        )


def stop(reason: str) -> None:
    """Exit with a reason on stderr."""
    sys.exit(f"make venv: {reason}\nAnother interpreter: make venv PYTHON=/path/to/python3")


def sourced_ros() -> bool:
    """Return whether a ROS 2 Jazzy is sourced and this interpreter can use it."""
    distribution = os.environ.get("ROS_DISTRO")
    if distribution is None:
        return False
    if distribution != "jazzy":
        stop(f"ROS {distribution} is sourced; use ROS 2 Jazzy, or a shell without ROS")
    if find_spec("rclpy") is None:
        stop(f"ROS 2 Jazzy is sourced, but {sys.executable} cannot import rclpy")
    return True


def wanted_extras(ros_is_sourced: bool) -> str:
    """Return the extras to install on this machine."""
    has_wheels = sys.platform == "linux" and platform.machine() == "x86_64"
    return "dev,ros" if has_wheels and not ros_is_sourced else "dev"


def fingerprint(extras: str, ros_is_sourced: bool) -> str:
    """Return a digest of all that decides what the environment holds."""
    digest = hashlib.sha256()
    for part in (sys.version, sysconfig.get_platform(), str(ROOT), extras, str(ros_is_sourced)):
        digest.update(part.encode())
    for name in REQUIREMENT_FILES:
        digest.update((ROOT / name).read_bytes())
    digest.update(" ".join(nodes()).encode())
    return digest.hexdigest()


def nodes() -> list[str]:
    """Return the names of the ROS nodes."""
    return sorted(path.name for path in (ROOT / "scripts").glob("*_node") if path.is_symlink())


def install(extras: str, ros_is_sourced: bool) -> None:
    """Make a new environment and install the package, editable, with its tools."""
    print(f"Setting up {VENV} for Python {platform.python_version()} ({extras})", flush=True)
    site = ["--system-site-packages"] if ros_is_sourced else []
    subprocess.run([sys.executable, "-m", "venv", "--clear", *site, str(VENV)], check=True)
    pip = [str(VENV / "bin" / "python"), "-m", "pip", "install", "--disable-pip-version-check"]
    # An older pip, such as that of Python 3.10, may try versions of indirect requirements for ever.
    subprocess.run([*pip, "--quiet", "--upgrade", "pip"], check=False)
    subprocess.run([*pip, "--editable", f".[{extras}]"], check=True, cwd=ROOT)
    link_data_files()
    python = str(VENV / "bin" / "python")
    for what, module in (("over recordings", "batch"), ("live", "live_code")):
        print(f"Compiling the default filter, {what}", flush=True)
        command = [python, "-m", f"{NAME}.{module}.precompile", "ins_odometer"]
        subprocess.run(command, check=False, cwd=ROOT)  # without it, it is interpreted at first


def link_data_files() -> None:
    """Link what ROS looks for outside Python packages; an editable install leaves it out."""
    links = {
        f"share/ament_index/resource_index/packages/{NAME}": f"resource/{NAME}",
        f"share/{NAME}/package.xml": "package.xml",
        f"share/{NAME}/config": "config",
        f"share/{NAME}/launch": "launch",
        **{f"lib/{NAME}/{node}": f"scripts/{node}" for node in nodes()},
    }
    for link, target in links.items():
        (VENV / link).parent.mkdir(parents=True, exist_ok=True)
        (VENV / link).symlink_to(ROOT / target)


def main() -> None:
    """Set the environment up where it is missing or out of date."""
    check_interpreter()
    ros_is_sourced = sourced_ros()
    extras = wanted_extras(ros_is_sourced)
    wanted = fingerprint(extras, ros_is_sourced)
    if STAMP.is_file() and STAMP.read_text() == wanted:
        return
    try:
        install(extras, ros_is_sourced)
    except subprocess.CalledProcessError as error:
        stop(f"{' '.join(error.cmd[:4])} ... failed with status {error.returncode}, see above")
    if "ros" not in extras and not ros_is_sourced:
        print(WHEELS_LOST)
    MADE_BY.write_text(sys.executable)
    STAMP.write_text(wanted)


if __name__ == "__main__":
    main()
