"""A long run of everything.

A robot balances at 500 Hz in processes of its own, with all filters beside the default one, an
evaluator, and the live page open in a browser. Nothing may be lost, grow or stay behind.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from browser import Browser, chromium
from diagnostic_msgs.msg import DiagnosticArray
from node_processes import Graph as Processes
from sensor_msgs.msg import Imu

from reliability.graph import Graph
from reliability.row import Effort, Row, Skipped
from twbr_estimation.live_code import precompile
from twbr_estimation.streams.messages import decode_imu

PERIOD = 2_000_000
"""Of the samples [ns]."""
PORT = 8139
SETTLING = 20.0
"""Time that the nodes and the page get before anything is counted [s]."""
GROWTH = 3.0
"""Memory that the second half may add to one node [MB]."""
NODES: dict[str, dict[str, object]] = {
    "simulator_node": {"world": "paper", "imu_period": PERIOD * 1e-9},
    "estimation_node": {"drivers": False, "compare": ["all"]},
    "evaluator_node": {},
    "controller_node": {"prepare_all": False},
    "dashboard_node": {"port": PORT},
}
"""The nodes; `NODES[node]` are the parameters that differ from the defaults."""
REPORTING = {"simulator_node", "filter_node", "evaluator_node", "controller_node"}
"""Nodes whose counts are in the diagnostics."""
PICTURES = "window.twbr?.robots.get(0)?.frames ?? 0"
SHARED_MEMORY = Path("/dev/shm")


def rows(effort: Effort) -> Iterator[Row]:
    """Run everything, look at it twice, and end it.

    Raises:
        Skipped: there is no browser, or no page.
    """
    if chromium() is None or find_spec("nicegui") is None:
        raise Skipped("needs Chromium, and the page: pip install .[dashboard]")
    if precompile.main(["all"]):
        raise Skipped("the machine code of the filters cannot be compiled")
    half = 1800.0 * effort.hours * effort.scale
    before = set(os.listdir(SHARED_MEMORY))
    with tempfile.TemporaryDirectory() as name:
        processes = Processes(Path(name))
        graph = Graph(processes.domain)
        watch = Watch(graph)
        try:
            for node, parameters in NODES.items():
                processes.start(node, parameters)
            with Browser(Path(name) / "profile") as browser:
                yield from _looks(processes, watch, browser, half)
            segments = _segments(processes) - before
        finally:
            watch.end()
            graph.close()
            statuses = processes.close()
        yield _ends(statuses, segments)


class Watch:
    """An independent client: what it gets of the tilt, and what the nodes report."""

    def __init__(self, graph: Graph) -> None:
        """Listen."""
        self.tilts = self.missing = 0
        """Tilts that came, and samples without one between two tilts."""
        self.reported: dict[str, dict[str, str]] = {}
        self.gaps: list[float] = []
        """When they were missing [s]."""
        self._last = 0
        graph.probe.create_subscription(Imu, "imu/data", self._on_tilt, 1000, raw=True)
        graph.probe.create_subscription(DiagnosticArray, "/diagnostics", self._on_report, 50)
        # A thread of its own: a browser may take its time to answer.
        self._executor, self._ended = graph.executor, threading.Event()
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=0.1)

    def end(self) -> None:
        """Take no more messages."""
        self._ended.set()
        self._thread.join()

    def _on_tilt(self, data: bytes) -> None:
        stamp, _ = decode_imu(data)
        if self._last and (missing := abs(round((stamp - self._last) / PERIOD) - 1)):
            self.missing += missing
            self.gaps.append(time.monotonic())
        self._last = stamp
        self.tilts += 1

    def _on_report(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.reported[status.name] = {each.key: each.value for each in status.values}

    def lost(self) -> dict[str, int]:
        """Return what is missing here and what each node reports as lost."""
        keys = ("lost_samples", "messages_dropped", "callback_errors")
        counts = {
            f"{node} {key}": int(values.get(key, 0))
            for node, values in self.reported.items()
            for key in keys
        }
        return {**counts, "client": self.missing}


class Size(NamedTuple):
    """What a node occupies."""

    memory: float
    """[MB]."""
    descriptors: int


def sizes(processes: Processes) -> dict[str, Size]:
    """Return what each node occupies."""
    return {node: _size(processes.process(node)) for node in NODES}


def _size(process: int) -> Size:
    folder = Path(f"/proc/{process}")
    pages = int((folder / "statm").read_text().split()[1])
    return Size(pages * os.sysconf("SC_PAGE_SIZE") / 1e6, len(os.listdir(folder / "fd")))


def _looks(processes: Processes, watch: Watch, browser: Browser, half: float) -> Iterator[Row]:
    """Watch two halves of the run."""
    time.sleep(SETTLING / 2)
    browser.resize(1280, 900)
    browser.call("Network.disable")  # or it reports every message that the page gets
    browser.call("Page.navigate", url=f"http://127.0.0.1:{PORT}/")
    time.sleep(SETTLING / 2)
    before, tilts, shown = watch.lost(), watch.tilts, browser.evaluate(PICTURES)
    begin = time.monotonic()
    _wait(browser, half)
    middle = sizes(processes)
    _wait(browser, half)
    end, elapsed = sizes(processes), time.monotonic() - begin
    processes.check()
    taken, listened = watch.tilts - tilts, set(watch.reported) >= REPORTING
    lost = {what: n - before.get(what, 0) for what, n in watch.lost().items()}
    lost = {what: n for what, n in lost.items() if n}
    yield Row(
        f"all filters, an evaluator and the page at 500 Hz for {elapsed / 60.0:.0f} min",
        taken,
        "no node ended, no sample lost, no message dropped, no error in a callback",
        _lost(lost, [gap - begin for gap in watch.gaps if gap > begin]) or "nothing lost",
        not lost and listened and taken * PERIOD > 0.99e9 * elapsed,
    )
    grown = {node: end[node].memory - middle[node].memory for node in NODES}
    opened = {node: end[node].descriptors - middle[node].descriptors for node in NODES}
    yield Row(
        "memory and descriptors of the nodes in its second half",
        len(NODES),
        f"below {GROWTH:g} MB more, no descriptor more",
        ", ".join(f"{n} {grown[n]:+.1f} MB {opened[n]:+d}" for n in NODES),
        max(grown.values()) < GROWTH and max(opened.values()) <= 0,
    )
    pictures, complaints = browser.evaluate(PICTURES) - shown, browser.complaints()
    yield Row(
        "the page meanwhile",
        int(pictures),
        "a picture a second at least, no script error",
        f"{pictures / elapsed:.1f} pictures a second, {len(complaints)} errors",
        pictures > elapsed and not complaints,
    )


def _lost(lost: dict[str, int], gaps: list[float]) -> str:
    counts = ", ".join(f"{n} by {what}" for what, n in lost.items())
    if not gaps:
        return counts
    return f"{counts}; the client had {len(gaps)} gaps from {gaps[0]:.1f} s to {gaps[-1]:.1f} s"


def _wait(browser: Browser, seconds: float) -> None:
    """Wait, and take what the browser says meanwhile."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        time.sleep(min(10.0, left))
        browser.evaluate("0")


def _segments(processes: Processes) -> set[str]:
    """Return the names of the shared memory that the nodes have mapped."""
    found = set()
    for node in NODES:
        for line in Path(f"/proc/{processes.process(node)}/maps").read_text().splitlines():
            segment = line.partition(f"{SHARED_MEMORY}/")[2]
            if segment.startswith("fastrtps"):
                found.add(segment.removesuffix(" (deleted)"))
    return found


def _ends(statuses: dict[str, int], segments: set[str]) -> Row:
    """Return how the nodes ended, and what is left of their shared memory."""
    left = sorted(segments & set(os.listdir(SHARED_MEMORY)))
    failed = {node: status for node, status in statuses.items() if status}
    return Row(
        "SIGTERM to all nodes",
        len(statuses),
        "status 0 within 10 s, no shared memory left behind",
        f"{len(failed)} others {failed or ''}; {len(left)} of {len(segments)} left {left or ''}",
        not failed and not left and bool(segments),
    )
