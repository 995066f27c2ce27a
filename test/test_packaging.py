"""What installs the package agrees with the package."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import twbr_estimation

ROOT = Path(__file__).resolve().parent.parent
LAUNCHER = "run_node"


def test_every_node_has_its_launcher() -> None:
    nodes = {path.stem for path in (ROOT / "twbr_estimation" / "nodes").glob("*_node.py")}
    linked = {path.name for path in (ROOT / "scripts").iterdir()} - {LAUNCHER}
    assert linked == nodes, "for each node: ln -s run_node scripts/NAME, its file's name"
    for name in linked:
        link = ROOT / "scripts" / name
        assert link.readlink() == Path(LAUNCHER)
        assert os.access(link, os.X_OK)


def test_every_command_is_there() -> None:
    program = "from distutils.core import run_setup; import json, setuptools; "
    program += "print(json.dumps(run_setup('setup.py', stop_after='init').entry_points))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    commands = json.loads(done.stdout.splitlines()[-1])["console_scripts"]
    assert len(commands) == len(list((ROOT / "scripts").iterdir()))
    for line in commands:
        name, _, value = line.partition(" = ")
        entry = EntryPoint(name, value, "console_scripts")
        assert callable(entry.load())


def test_tests_import_each_other_by_their_full_names() -> None:
    relative = [
        path.relative_to(ROOT)
        for path in (ROOT / "test").rglob("*.py")
        if re.search(r"^\s*from \.", path.read_text(), re.MULTILINE)
    ]
    assert not relative, "pytest 7.4 cannot collect these: write `from nodes.simulated import ...`"


def test_ros_and_python_name_the_same_version() -> None:
    package = ET.parse(ROOT / "package.xml").getroot()
    assert package.findtext("name") == "twbr_estimation"
    assert package.findtext("version") == twbr_estimation.__version__
    assert (ROOT / "resource" / "twbr_estimation").is_file()


def test_nodes_need_nothing_that_only_pip_has() -> None:
    """`rosdep install -t exec` brings apt packages only, and they are enough for every node."""
    package = ET.parse(ROOT / "package.xml").getroot()
    needed = [each.text or "" for each in package.iter("exec_depend")]
    assert not [key for key in needed if key.endswith("-pip") or key == "mcap-ros2-support"]
    program = (
        "import sys, importlib\n"
        "for name in ('mcap', 'rosbags', 'zstandard', 'lz4', 'cobs', 'nicegui'):\n"
        "    sys.modules[name] = None\n"
        "for name in sys.argv[1:]:\n"
        "    importlib.import_module(f'twbr_estimation.nodes.{name}')\n"
    )
    pytest.importorskip("rclpy", reason="needs ROS 2")
    nodes = [path.stem for path in (ROOT / "twbr_estimation" / "nodes").glob("*_node.py")]
    command = [sys.executable, "-c", program, *nodes]
    subprocess.run(command, check=True, cwd=ROOT, timeout=120)
