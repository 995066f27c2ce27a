"""Output that is not read is lost; the node does not wait for it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")

PROGRAM = """
import os
from twbr_estimation.nodes.output import never_wait
never_wait()
lost = 0
for _ in range(1000):
    try:
        lost += os.write(2, b"x" * 1000) < 1000
    except BlockingIOError:
        lost += 1
os.write(1, b"%d\\n" % lost)
"""


@pytest.mark.parametrize("kind", ["terminal", "pipe", "socket"])
def test_a_stream_that_is_not_read_is_not_waited_for(kind: str) -> None:
    if kind == "socket":
        pair = socket.socketpair()
        ours, its = (each.detach() for each in pair)
    else:
        ours, its = os.openpty() if kind == "terminal" else os.pipe()
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, stderr=its, timeout=60
        )
        assert int(done.stdout) > 500 and done.returncode == 0
        assert os.get_blocking(its) is (kind != "socket"), "the shell's own stream is as it was"
    finally:
        os.close(ours)
        os.close(its)
