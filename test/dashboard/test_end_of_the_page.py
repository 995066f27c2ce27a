"""How the page's node ends."""

from __future__ import annotations

import signal
import sys
from contextlib import suppress
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")
pytest.importorskip("nicegui", reason="needs the extra dashboard")

from dashboard.looking import free_port, running
from nodes.conftest import reserved_domain

NODE = "import sys; from twbr_estimation.nodes.dashboard_node import main; sys.exit(main())"
SHARED_MEMORY = Path("/dev/shm")
SEGMENTS = f"{SHARED_MEMORY}/fastrtps"


def mapped_by(process: str) -> set[Path]:
    """Return the segments that a process has mapped; a number, or a pattern."""
    found: set[Path] = set()
    for maps in Path("/proc").glob(f"{process}/maps"):
        with suppress(OSError):  # it has just ended, or belongs to another user
            words = maps.read_text().split()
            found |= {Path(word) for word in words if word.startswith(SEGMENTS)}
    return found


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_node_and_leaves_no_shared_memory(number: signal.Signals) -> None:
    command = [sys.executable, "-c", NODE, "--ros-args", "-p", f"port:={free_port()}"]
    before = set(SHARED_MEMORY.iterdir())  # of processes that were killed
    with reserved_domain() as domain, running(command, ROS_DOMAIN_ID=str(domain)) as (server, _):
        mapped = mapped_by(str(server.pid))
        assert mapped
        server.send_signal(number)
        output, _ = server.communicate(timeout=30)
        assert server.returncode == 0, output
        assert "Traceback" not in output
        # Ports from 7000 on are those of all domains: another node may have taken one over.
        left = mapped - before - mapped_by("[0-9]*")
        assert [path for path in left if path.exists()] == []
