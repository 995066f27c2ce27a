"""A scheduler and workers on the loopback address, each a process."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from pathlib import Path

TEST_FOLDER = Path(__file__).resolve().parent.parent


class Cluster:
    """A Dask cluster of two workers, whose parts can be killed and started."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.workers: dict[str, subprocess.Popen[bytes]] = {}
        self.start()

    def start(self) -> None:
        """Start the scheduler and two workers, and wait until they are connected."""
        place = ("--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard", "--no-show")
        self.scheduler = self._start("scheduler", *place)
        for name in ("first", "second"):
            self.start_worker(name)
        self.wait()

    def start_worker(self, name: str) -> None:
        """Start one worker."""
        alone = ("--no-nanny", "--nthreads", "1", "--local-directory", str(self.folder))
        place = ("--host", "127.0.0.1", "--no-dashboard", "--name", name, *alone)
        self.workers[name] = self._start("worker", self.address, *place)

    def _start(self, role: str, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{role}", *arguments]
        path = os.pathsep.join([str(TEST_FOLDER), os.environ.get("PYTHONPATH", "")])
        return subprocess.Popen(
            command,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": path},
        )

    def wait(self) -> None:
        """Wait for both workers."""
        import distributed

        limit = time.monotonic() + 60.0
        while True:
            try:
                client = distributed.Client(self.address, timeout=5.0, set_as_default=False)
                break
            except OSError:
                assert time.monotonic() < limit, "the scheduler did not start"
        with client:
            client.wait_for_workers(2, timeout=60.0)

    def worker_of(self, process: int) -> subprocess.Popen[bytes]:
        """Return the worker with this process number."""
        (found,) = [each for each in self.workers.values() if each.pid == process]
        return found

    def alive(self) -> int:
        """Return how many workers run."""
        return sum(process.poll() is None for process in self.workers.values())

    def kill(self) -> None:
        """Kill everything."""
        for process in (*self.workers.values(), self.scheduler):
            process.kill()
            process.wait()
