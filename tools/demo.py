"""Run the live graph on a recording: replay, correction, all filters side by side, evaluator.

Run by `make demo`. It ends with the evaluator's table and says where its JSON lies. Each node
is a process of its own, in a ROS domain that nobody else uses, as fast as the graph can take
the recording. Without ROS the recording is evaluated by `twbr evaluate` instead.
"""

from __future__ import annotations

import argparse
import os
import random
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parent.parent
RECORDING = ROOT / "bags" / "verification"
PRESET = "table2"
PARAMETERS = ROOT / "twbr_estimation" / "presets" / PRESET / "2ms.yaml"
LOSSLESS = ROOT / "config" / "lossless.yaml"
PATIENCE = 120.0
"""Longest time the whole graph may take [s]."""
DISCOVERY_PORT, PORTS_A_DOMAIN = 7400, 250
"""Where DDS puts the ports of a domain."""
GOODBYE = 10.0
"""Longest time a node may take to stop [s]."""


class Graph:
    """The processes of the demo; whatever happens, none of them stays behind."""

    def __init__(self, folder: Path) -> None:
        """`folder` takes parameter files and logs."""
        self._folder = folder
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(unused_domain()),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "PYTHONUNBUFFERED": "1",
        }

    def start(self, node: str, parameters: dict[str, object], files: Sequence[Path] = ()) -> None:
        """Start a node with parameter files and, ruling over them, single parameters."""
        own = self._folder / f"{node}.yaml"
        own.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}))
        program = f"import sys; from twbr_estimation.nodes.{node} import main; sys.exit(main())"
        command = [sys.executable, "-c", program, "--ros-args", "--log-level", "warn"]
        for file in (*files, own):
            command += ["--params-file", str(file)]
        # The evaluator speaks to the terminal; what the others say matters if they fail.
        output = None if node == "evaluator_node" else self._log(node).open("wb")
        self._running[node] = subprocess.Popen(
            command, env=self._environment, stdout=output, stderr=output or None
        )

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

    def stop(self, node: str) -> None:
        """Ask a node to stop, and wait for it."""
        self._running[node].terminate()  # SIGINT is ignored below a script's background job
        self.wait(node, GOODBYE)

    def close(self) -> None:
        """End every node that still runs."""
        for process in self._running.values():
            process.terminate()
        for process in self._running.values():
            try:
                process.wait(GOODBYE)
            except subprocess.TimeoutExpired:
                process.kill()

    def _log(self, node: str) -> Path:
        return self._folder / f"{node}.log"


def unused_domain() -> int:
    """Return a ROS domain whose discovery port nobody on this machine holds."""
    for domain in random.sample(range(1, 102), 101):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
            probe.bind(("", DISCOVERY_PORT + PORTS_A_DOMAIN * domain))
            return domain
    raise RuntimeError("every ROS domain is in use on this machine")


def run_graph(bag: Path, target: Path, folder: Path) -> None:
    """Run the graph on one recording and leave the figures in `target`.

    Raises:
        RuntimeError: a node failed.
    """
    config = sorted((bag / "config").glob("*.yaml"))
    graph = Graph(folder)
    try:
        evaluator = {"json_file": str(target), "source": f"{bag.name}, live"}
        graph.start("evaluator_node", dict(evaluator), [LOSSLESS])
        graph.start("filter_node", {"compare": ["all"]}, [*config, PARAMETERS, LOSSLESS])
        graph.start("correction_node", {}, [*config, PARAMETERS, LOSSLESS])
        replay: dict[str, object] = {
            "bag": str(bag),
            "rate": 0.0,
            "exit_at_end": True,
            "wait_for": ["/imu/data_raw", "/imu/data_corrected", "/imu/data", "/tilt/compare"],
        }
        graph.start("replay_node", replay)
        graph.wait("replay_node", PATIENCE)
        graph.stop("evaluator_node")
    finally:
        graph.close()


def evaluate_without_ros(bag: Path, target: Path) -> int:
    """Evaluate the recording without a graph."""
    print("No ROS 2 here, so no live graph: `twbr evaluate` runs the same filters instead.")
    arguments = ["evaluate", str(bag), "--preset", PRESET, "--json", str(target)]
    command = [sys.executable, "-m", "twbr_estimation.cli.main", *arguments]
    return subprocess.run(command, check=False).returncode


def main() -> int:
    """Run the demo and say where its figures lie."""
    parser = argparse.ArgumentParser(description="Run the live graph on a recording.")
    parser.add_argument("bag", nargs="?", type=Path, default=RECORDING)
    parser.add_argument("--json", type=Path, default=ROOT / "build" / "demo.json", metavar="FILE")
    arguments = parser.parse_args()
    target: Path = arguments.json.resolve()
    target.parent.mkdir(parents=True, exist_ok=True)
    if find_spec("rclpy") is None:
        status = evaluate_without_ros(arguments.bag, target)
    else:
        status = 0
        print(
            f"Replaying {arguments.bag} through correction, filters and evaluator ...", flush=True
        )
        with tempfile.TemporaryDirectory() as folder:
            try:
                run_graph(arguments.bag.resolve(), target, Path(folder))
            except RuntimeError as error:
                print(f"demo: error: {error}", file=sys.stderr)
                status = 1
    if status == 0:
        print(f"The figures as JSON: {target}")
    return status


if __name__ == "__main__":
    sys.exit(main())
