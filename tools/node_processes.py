"""Processes of nodes in a ROS domain of their own, for the tools that demonstrate them."""

from __future__ import annotations

import os
import random
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from pathlib import Path

import yaml

DISCOVERY_PORT, PORTS_A_DOMAIN = 7400, 250
"""Where DDS puts the ports of a domain."""
SHUTDOWN_TIMEOUT = 10.0
"""Longest time a node may take to stop [s]."""


class Graph:
    """Node processes of one demonstration; whatever happens, none of them stays behind."""

    def __init__(self, folder: Path) -> None:
        """`folder` takes parameter files and logs."""
        self._folder = folder
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self.domain = unused_domain()
        """The ROS domain of all of them, which no other program on this machine uses."""
        self._environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(self.domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "PYTHONUNBUFFERED": "1",
        }

    def start(
        self,
        node: str,
        parameters: dict[str, object],
        files: Sequence[Path] = (),
        *,
        aloud: bool = False,
    ) -> None:
        """Start a node of this package.

        Args:
            node: Its name.
            parameters: These take precedence over those of the files.
            files: Parameter files.
            aloud: Whether its output goes to the terminal; otherwise it is kept for error messages.
        """
        own = self._folder / f"{node}.yaml"
        own.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}))
        program = f"import sys; from twbr_estimation.nodes.{node} import main; sys.exit(main())"
        command = [sys.executable, "-c", program, "--ros-args", "--log-level", "warn"]
        for file in (*files, own):
            command += ["--params-file", str(file)]
        with nullcontext() if aloud else self._log(node).open("wb") as output:
            self._running[node] = subprocess.Popen(
                command, env=self._environment, stdout=output, stderr=output
            )

    def process(self, node: str) -> int:
        """Return the number of a node's process."""
        return self._running[node].pid

    def wait(self, node: str, limit: float) -> None:
        """Wait until a node has ended by itself.

        Raises:
            RuntimeError: it took too long, or a node ended with an error; with what it said.
        """
        try:
            status = self._running[node].wait(limit)
        except subprocess.TimeoutExpired:
            raise RuntimeError(f"{node} did not end within {limit:g} s") from None
        del self._running[node]
        if status != 0:
            said = self._log(node).read_text() if self._log(node).exists() else ""
            raise RuntimeError(f"{node} ended with status {status}\n{said}")

    def check(self) -> None:
        """Raise where a node has ended.

        Raises:
            RuntimeError: with what the node said.
        """
        for node, process in self._running.items():
            if process.poll() is not None:
                said = self._log(node).read_text()
                raise RuntimeError(f"{node} ended with status {process.returncode}\n{said}")

    def stop(self, node: str) -> None:
        """Ask a node to stop, and wait for it."""
        self._running[node].terminate()  # SIGINT is ignored below a script's background job
        self.wait(node, SHUTDOWN_TIMEOUT)

    def close(self) -> dict[str, int]:
        """End every node that still runs; return their statuses."""
        for process in self._running.values():
            process.terminate()
        for process in self._running.values():
            try:
                process.wait(SHUTDOWN_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
        return {node: process.wait() for node, process in self._running.items()}

    def _log(self, node: str) -> Path:
        return self._folder / f"{node}.log"


def unused_domain() -> int:
    """Return a ROS domain whose discovery port is free on this machine, and hold it.

    Who looks for an unused domain does not take it between two nodes of this process either.
    """
    for domain in random.sample(range(1, 102), 101):
        port = DISCOVERY_PORT + PORTS_A_DOMAIN * domain
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
            probe.bind(("", port))
            probe.close()
            held = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as DDS does
            held.bind(("", port))
            _held.append(held)
            return domain
    raise RuntimeError("every ROS domain is in use on this machine")


_held: list[socket.socket] = []
