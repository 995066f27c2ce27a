"""Measure the live page: CPU and memory of dashboard_node without and with a browser.

A simulated robot runs at 500 Hz in processes of its own, and a headless Chromium looks at the
page. Printed are CPU seconds of the page's process for each second of the clock, pictures and
messages a second, memory of process and browser, and every script error. `--seconds 300` is the
long run.
"""

from __future__ import annotations

import argparse
import os
import socket
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tools")]

from browser import Browser, chromium  # noqa: E402
from node_processes import Graph  # noqa: E402

IMU_PERIOD = 0.002
TIMEOUT = 60.0
TICKS = os.sysconf("SC_CLK_TCK")


COUNTED = """
window.received = {messages: 0, bytes: 0};
window.WebSocket = class extends WebSocket {
  constructor(...given) {
    super(...given);
    this.addEventListener('message', ({data}) => {
      window.received.messages += 1;
      window.received.bytes += data.size ?? data.byteLength ?? data.length;
    });
  }
};
"""
"""Script that counts what the server sends to a page."""


class Usage(NamedTuple):
    """What a process has used so far."""

    clock: float
    cpu: float
    """User and system time [s]."""
    memory: float
    """Resident [MB]."""


def usage(process: int) -> Usage:
    """Return what a process has used so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    memory = pages * os.sysconf("SC_PAGE_SIZE") / 2**20
    return Usage(time.monotonic(), (int(fields[11]) + int(fields[12])) / TICKS, memory)


def percent(begin: Usage, end: Usage) -> float:
    """Return the share of a core between two looks [%]."""
    return 100.0 * (end.cpu - begin.cpu) / (end.clock - begin.clock)


def until(what: str, condition: Callable[[], object]) -> None:
    """Wait for a condition.

    Raises:
        RuntimeError: it does not come.
    """
    end = time.monotonic() + TIMEOUT
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError(f"not within {TIMEOUT:g} s: {what}")
        time.sleep(0.2)


def answers(port: int) -> bool:
    """Return whether something listens at a port."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def start(graph: Graph, port: int) -> int:
    """Start a robot that balances, and the page; return the page's process."""
    graph.start("simulator_node", {"world": "paper", "imu_period": IMU_PERIOD})
    graph.start("estimation_node", {"drivers": False, "compare": ["complementary"]})
    graph.start("controller_node", {"prepare_all": False})
    graph.start("dashboard_node", {"port": port})
    return graph.process("dashboard_node")


def look(browser: Browser, process: int, seconds: float) -> bool:
    """Look at the page for a while, print what that takes; return whether nothing was wrong."""
    frames = "window.twbr?.robots.get(0)?.frames"
    until("pictures in the browser", lambda: browser.evaluate(frames))
    time.sleep(5.0)
    heap = "performance.memory.usedJSHeapSize / 2**20"
    first, shown = usage(process), browser.evaluate(frames)
    messages, size = received(browser)
    collected = heap_after_collection(browser, heap)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(min(10.0, seconds))
        browser.evaluate("0")
    last, shown = usage(process), browser.evaluate(frames) - shown
    elapsed = last.clock - first.clock
    messages, size = (b - a for a, b in zip((messages, size), received(browser), strict=True))
    print(
        f"with a browser, {elapsed:.0f} s: {percent(first, last):.1f} % of a core, "
        f"{shown / elapsed:.1f} pictures a second, {messages / elapsed:.1f} messages and "
        f"{size / elapsed / 1000.0:.1f} kB a second, memory {first.memory:.1f} to "
        f"{last.memory:.1f} MB, browser's heap {collected:.1f} to "
        f"{heap_after_collection(browser, heap):.1f} MB"
    )
    complaints = browser.complaints()
    print(f"script errors: {len(complaints)}", *complaints, sep="\n")
    return not complaints


def received(browser: Browser) -> tuple[int, int]:
    """Return the number of messages from the server so far, and their size [bytes]."""
    seen = browser.evaluate("[received.messages, received.bytes]")
    return int(seen[0]), int(seen[1])


def heap_after_collection(browser: Browser, heap: str) -> float:
    """Return the browser's heap without garbage [MB]."""
    browser.call("HeapProfiler.collectGarbage")
    return float(browser.evaluate(heap))


def main() -> int:
    """Measure; return 1 where the page had a script error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="with the browser")
    parser.add_argument("--idle", type=float, default=10.0, help="without a browser [s]")
    parser.add_argument("--port", type=int, default=8123)
    parser.add_argument("--screenshots", type=Path, help="folder for two pictures of the page")
    given = parser.parse_args()
    for package in ("rclpy", "nicegui"):
        if find_spec(package) is None:
            print(f"live page: no {package} here, so there is nothing to measure")
            return 0
    if chromium() is None:
        print("live page: no Chromium here, so there is nothing to measure")
        return 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        graph = Graph(folder)
        try:
            return measure(graph, folder, given)
        finally:
            graph.close()


def measure(graph: Graph, folder: Path, given: argparse.Namespace) -> int:
    """Measure without and with a browser."""
    process = start(graph, given.port)
    until("the page", lambda: answers(given.port))
    time.sleep(8.0)
    graph.check()
    begin = usage(process)
    time.sleep(given.idle)
    print(f"no browser, {given.idle:.0f} s: {percent(begin, usage(process)):.1f} % of a core")
    with Browser(folder / "profile") as browser:
        browser.resize(1280, 900)
        browser.call("Page.addScriptToEvaluateOnNewDocument", source=COUNTED)
        browser.call("Page.navigate", url=f"http://127.0.0.1:{given.port}/")
        fine = look(browser, process, given.seconds)
        if given.screenshots:
            given.screenshots.mkdir(parents=True, exist_ok=True)
            (given.screenshots / "desktop.png").write_bytes(browser.screenshot(whole=True))
            browser.resize(390, 844, mobile=True)
            time.sleep(2.0)
            (given.screenshots / "phone.png").write_bytes(browser.screenshot(whole=True))
    begin = usage(process)
    time.sleep(given.idle)
    print(f"after it left, {given.idle:.0f} s: {percent(begin, usage(process)):.1f} % of a core")
    graph.check()
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
