"""The systemd unit of the examples gives the nodes what they need, and no more."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

UNIT = Path(__file__).resolve().parents[1] / "examples" / "systemd" / "twbr_estimation.service"
PROGRAM = "import sys; from twbr_estimation.nodes.mpu6050_node import main; sys.exit(main())"


def _settings() -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for line in UNIT.read_text().splitlines():
        name, equals, value = line.partition("=")
        if equals and not line.startswith("#"):
            found.setdefault(name, []).append(value)
    return found


def test_logs_go_where_systemd_makes_a_folder() -> None:
    unit = _settings()
    environment = dict(each.split("=", 1) for each in unit["Environment"])
    (folder,) = unit["RuntimeDirectory"]
    assert environment["ROS_LOG_DIR"] == f"/run/{folder}"
    assert unit["ProtectSystem"] == ["strict"]
    assert unit["Restart"] == ["always"] and unit["StartLimitIntervalSec"] == ["0"]
    assert {"i2c", "dialout"} <= set(unit["SupplementaryGroups"][0].split())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_driver_runs_in_that_environment_without_a_home(tmp_path: Path, number: int) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
    environment = dict(each.split("=", 1) for each in _settings()["Environment"])
    environment["ROS_LOG_DIR"] = str(tmp_path)
    kept = ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "AMENT_PREFIX_PATH", "ROS_DOMAIN_ID")
    environment |= {name: os.environ[name] for name in kept if name in os.environ}
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "--ros-args", "-p", "simulated:=true"],
        env=environment,
        cwd="/",
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    said = ""
    for line in process.stdout:
        said += line
        if "active" in line:
            process.send_signal(number)
            break
    said += process.stdout.read()
    assert process.wait(30) == 0, said
