"""Run the live graph on a recording: replay, correction, all filters side by side, evaluator.

Run by `make demo`. It ends with the evaluator's table and says where its JSON lies. Each node
is a process of its own, in an unused ROS domain, as fast as the graph can take
the recording. Without ROS the recording is evaluated by `twbr evaluate` instead.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from node_processes import Graph

ROOT = Path(__file__).resolve().parent.parent
RECORDING = ROOT / "bags" / "verification"
PRESET = "table2"
PARAMETERS = ROOT / "twbr_estimation" / "presets" / PRESET / "2ms.yaml"
LOSSLESS = ROOT / "config" / "lossless.yaml"
START_TIMEOUT = 120.0
"""Longest time the whole graph may take [s]."""


def run_graph(bag: Path, target: Path, folder: Path) -> None:
    """Run the graph on one recording and leave the figures in `target`.

    Raises:
        RuntimeError: a node failed.
    """
    config = sorted((bag / "config").glob("*.yaml"))
    graph = Graph(folder)
    try:
        evaluator = {"json_file": str(target), "source": f"{bag.name}, live"}
        graph.start("evaluator_node", dict(evaluator), [LOSSLESS], aloud=True)
        graph.start("filter_node", {"compare": ["all"]}, [*config, PARAMETERS, LOSSLESS])
        graph.start("correction_node", {}, [*config, PARAMETERS, LOSSLESS])
        replay: dict[str, object] = {
            "bag": str(bag),
            "rate": 0.0,
            "exit_at_end": True,
            "wait_for": ["/imu/data_raw", "/imu/data_corrected", "/imu/data", "/tilt/compare"],
        }
        graph.start("replay_node", replay)
        graph.wait("replay_node", START_TIMEOUT)
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
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # or the nodes would stay behind
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
            except KeyboardInterrupt:
                status = 130
    if status == 0:
        print(f"The figures as JSON: {target}")
    return status


if __name__ == "__main__":
    sys.exit(main())
