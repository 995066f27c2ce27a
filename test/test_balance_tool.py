"""`make balance`: the whole graph in processes, on lines and in a terminal."""

from __future__ import annotations

import contextlib
import fcntl
import math
import os
import pty
import select
import signal
import socket
import struct
import subprocess
import sys
import termios
import time
import urllib.request
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from twbr_estimation.controllers import listed_controllers
from twbr_estimation.filters import listed_filters

TOOLS = Path(__file__).resolve().parent.parent / "tools"
TOOL = TOOLS / "balance.py"
LEAVE_SCREEN, SHOW_CURSOR = b"\x1b[?1049l", b"\x1b[?25h"
TIMEOUT = 180.0


@pytest.fixture
def view(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(TOOLS))
    import balance_view

    return balance_view


def test_the_page_fits_into_a_small_terminal(view: Any) -> None:
    shown = view.Shown(filter="alpha_beta_theta_wa_a", controller="lqr_sun2014_printed")
    shown.reference, shown.estimate, shown.speed, shown.voltage = -123.45, 123.45, -1.23, -12.0
    shown.standing = "motors cut: waiting for tilt and wheels, and more that does not matter"
    shown.message = "x" * 200
    shown.mse, shown.falls = 12345.6789, 12
    for index in range(100):
        shown.take_time(1000.0 * index)
        shown.history.append((100.0 * math.sin(index), math.nan if index == 50 else 3.0))
    console = Console(width=80, height=24, file=open(os.devnull, "w"), force_terminal=True)  # noqa: SIM115
    lines = console.render_lines(view.page(shown), pad=False)
    texts = ["".join(segment.text for segment in line) for line in lines]
    assert len(texts) <= 23 and max(map(len, texts)) <= 80
    everything = "\n".join(texts)
    for part in ("alpha_beta_theta_wa_a", "lqr_sun2014_printed", "-123.45°", "●", "○", "q quit"):
        assert part in everything


def test_falls_and_upright_time_are_counted(view: Any) -> None:
    shown = view.Shown()
    for time_, tilt in ((1.0, 0.0), (2.0, 0.0), (3.0, 40.0), (4.0, -40.0), (5.0, 1.0), (6.0, 1.0)):
        shown.reference = tilt
        shown.take_time(time_)
    assert shown.falls == 1
    assert shown.upright == pytest.approx(4.0)
    assert shown.upright_since == 5.0
    assert "falls 1" in shown.line()


def test_without_a_terminal_it_prints_lines_and_ends() -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
    result = subprocess.run(
        [sys.executable, str(TOOL), "--seconds", "4", "--filter", "complementary"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    lines = result.stdout.splitlines()
    assert 2 <= len(lines) <= 6, "one a second at most, and the last"
    assert "complementary MSE" in lines[-1] and "falls 0" in lines[-1]
    assert "\x1b" not in result.stdout


class Terminal:
    """A pseudo-terminal with the tool in it."""

    def __init__(self, *arguments: str) -> None:
        self.master, self.slave = pty.openpty()
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        self.before = termios.tcgetattr(self.slave)
        self.process = subprocess.Popen(
            [sys.executable, str(TOOL), *arguments],
            stdin=self.slave,
            stdout=self.slave,
            stderr=self.slave,
            env={
                **{key: text for key, text in os.environ.items() if "PYTEST" not in key},
                "TERM": "xterm-256color",
            },
            start_new_session=True,
        )
        self.output = b""

    def read_until(self, text: str) -> None:
        """Read on until the text has come after what was asked for before."""
        start, end = len(self.output), time.monotonic() + TIMEOUT
        while text.encode() not in self.output[start:]:
            assert time.monotonic() < end, self.output[-3000:].decode(errors="replace")
            if select.select([self.master], [], [], 0.1)[0]:
                self.output += os.read(self.master, 65536)

    def press(self, keys: str) -> None:
        os.write(self.master, keys.encode())

    def finish(self) -> int:
        """Read to the end; return the exit status."""
        end = time.monotonic() + TIMEOUT
        while self.process.poll() is None and time.monotonic() < end:
            if select.select([self.master], [], [], 0.1)[0]:
                self.output += os.read(self.master, 65536)
        while select.select([self.master], [], [], 0.1)[0]:
            self.output += os.read(self.master, 65536)
        return self.process.wait(1.0)


def after(name: str, names: Iterable[str]) -> str:
    """Return the name that follows in the list."""
    listed = list(names)
    return listed[listed.index(name) + 1]


def test_keys_act_and_the_terminal_is_left_as_it_was() -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
    terminal = Terminal("--terminal", "--filter", "complementary", "--controller", "pid")
    try:
        terminal.read_until("balancing")
        terminal.press("f")
        terminal.read_until(f"filter {after('complementary', listed_filters())}")
        terminal.press("c")
        terminal.read_until(f"controller {after('pid', listed_controllers())}")
        terminal.press("\x1b[C")
        terminal.read_until("pushed by +3 N")
        terminal.press("w")
        terminal.read_until("driving at +0.1 m/s")
        terminal.press("q")
        assert terminal.finish() == 0
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(terminal.process.pid, signal.SIGKILL)  # its nodes, too
    assert terminal.output.rfind(LEAVE_SCREEN) > terminal.output.rfind(b"\x1b[?1049h")
    assert SHOW_CURSOR in terminal.output[terminal.output.rfind(b"\x1b[?25l") :]
    assert termios.tcgetattr(terminal.slave) == terminal.before


def test_it_opens_the_page_and_ends_with_every_node() -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
    pytest.importorskip("nicegui", reason="needs the extra dashboard")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    terminal = Terminal("--filter", "complementary", "--port", str(port))
    try:
        terminal.read_until(f"http://127.0.0.1:{port}/")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=TIMEOUT) as page:
            assert b"/dashboard/live.js" in page.read()
        terminal.process.send_signal(signal.SIGINT)
        assert terminal.finish() == 0
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(terminal.process.pid, signal.SIGKILL)


def test_what_cannot_be_simulated_is_reported() -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
    result = subprocess.run(
        [sys.executable, str(TOOL), "--world", "moon"],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    assert result.returncode == 1
    assert "moon" in result.stderr and "Traceback" not in result.stderr
