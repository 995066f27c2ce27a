"""`make demo`: the live graph in processes of its own, and what happens without ROS."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.bags import write_recording
from twbr_estimation.drives import load
from twbr_estimation.scoring.score import as_json
from twbr_estimation.simulation import simulate, world_named

DEMO = Path(__file__).resolve().parent.parent / "tools" / "demo.py"
WITHOUT_ROS = (
    "import os, runpy, sys; sys.modules['rclpy'] = None; sys.argv = sys.argv[1:]; "
    "sys.path.insert(0, os.path.dirname(sys.argv[0])); "
    "runpy.run_path(sys.argv[0], run_name='__main__')"
)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated drive of three seconds."""
    folder = tmp_path_factory.mktemp("drive") / "bag"
    run = simulate(world_named("paper"), dt=0.002, duration=3.0, seed=5)
    write_recording(folder, run.recording)
    return folder


def figures(command: list[str], target: Path) -> tuple[str, dict[str, Any]]:
    """Run the demo; return what it printed and its figures by estimator."""
    result = subprocess.run(
        [*command, "--json", str(target)], capture_output=True, text=True, timeout=90
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert str(target) in result.stdout
    (recording,) = json.loads(target.read_text())["recordings"]
    return result.stdout, recording["estimators"]


def offline(bag: Path) -> dict[str, Any]:
    document: Any = as_json([load(bag, preset="table2").run().scores()])
    return dict(document["recordings"][0]["estimators"])


def test_the_live_graph_gives_the_offline_figures(bag: Path, tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
    printed, live = figures([sys.executable, str(DEMO), str(bag)], tmp_path / "live.json")
    assert "ins_odometer" in printed and "MSE" in printed
    for name, expected in offline(bag).items():
        assert live[name] == pytest.approx(expected, rel=1e-6, abs=1e-9), name


def test_without_ros_it_evaluates_offline_and_says_so(bag: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-c", WITHOUT_ROS, str(DEMO), str(bag)]
    printed, found = figures(command, tmp_path / "offline.json")
    assert "No ROS 2 here" in printed
    assert set(found) == set(offline(bag))


def test_a_failing_node_is_reported(tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
    result = subprocess.run(
        [sys.executable, str(DEMO), str(tmp_path / "none"), "--json", str(tmp_path / "x.json")],
        capture_output=True,
        text=True,
        timeout=90,
    )
    assert result.returncode == 1
    assert "replay_node ended with status 1" in result.stderr and "none" in result.stderr


def test_a_demo_that_is_terminated_leaves_no_node_behind(tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
    process = subprocess.Popen(
        [sys.executable, str(DEMO), "--json", str(tmp_path / "x.json")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    nodes = []
    until = time.monotonic() + 60.0
    while len(nodes) < 4 and time.monotonic() < until:
        nodes = children(process.pid)
        time.sleep(0.05)
    process.terminate()
    assert process.wait(60.0) == 130
    assert len(nodes) == 4
    assert not [node for node in nodes if Path(f"/proc/{node}").exists()]


def children(parent: int) -> list[int]:
    """Return the processes that a process has started."""
    return [
        int(each) for each in Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    ]
