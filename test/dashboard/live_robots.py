"""Two robots of real nodes for a page to show: one balances in lockstep, one is held upright."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from nodes.conftest import Graph
from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.simulator_node import SimulatorNode
from twbr_estimation.simulation.worlds import PAPER_CALIBRATION

CALIBRATION = {
    f"calibration__{name}": list(getattr(PAPER_CALIBRATION, name))
    for name in ("gyro_bias", "accel_bias", "accel_scale_x", "accel_scale_z")
}
LOSSLESS = ("imu/data_raw", "imu/data_corrected", "imu/data", "joint_states", "motor/command")
ROLLS_OUT = {"stillness__wheel_limit": 1.0}
"""Wheels of the fallen robot go on rolling slowly [rad]."""
LONGEST = 180.0
"""A wait for the robot's time [s]."""
SECOND = "second"
"""Namespace of the other robot."""


class LiveRobots:
    """Nodes that a thread spins; no faster than the clock, however fast the machine."""

    def __init__(self, domain: int) -> None:
        self.graph = graph = Graph(domain)
        shared: dict[str, Any] = {**graph.lossless(*LOSSLESS), "use_sim_time": True}
        robot: dict[str, Any] = {"world": "paper", "seed": 7, "lockstep": True, "duration": 5.0}
        lossless = graph.lossless(*LOSSLESS)
        self.simulator = graph.add(SimulatorNode(**graph.options(**robot, **lossless)))
        correction = graph.options(**shared, **CALIBRATION, **ROLLS_OUT, timeout=60.0)
        self.correction = graph.add(CorrectionNode(**correction))
        compared = {"compare": ["complementary"], "timeout": 60.0}
        self.filter = graph.add(FilterNode(**graph.options(**shared, **compared)))
        controller = {"clock_timeout": 60.0, "prepare_all": False}
        graph.add(ControllerNode(**graph.options(**shared, **controller)))
        held = graph.options(world="ideal", imu_period=0.02, duration=5.0)
        self.second = graph.add(SimulatorNode(namespace=SECOND, **held))
        self._todo: list[Callable[[], None]] = []
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self) -> None:
        begin, first = time.monotonic(), self.simulator.simulator.latest.stamp
        while not self._ends.is_set():
            while self._todo:
                self._todo.pop(0)()
            self.graph.executor.spin_once(timeout_sec=0.02)
            simulated = (self.simulator.simulator.latest.stamp - first) * 1e-9
            if (ahead := simulated - (time.monotonic() - begin)) > 0.0:
                time.sleep(min(ahead, 0.02))

    def wait(self, seconds: float) -> None:
        """Wait until the first robot has lived through so much of its own time [s]."""
        end = self.simulator.simulator.latest.stamp + round(seconds * 1e9)
        limit = time.monotonic() + LONGEST
        while self.simulator.simulator.latest.stamp < end:
            assert time.monotonic() < limit, "the robot's time stands still"
            time.sleep(0.05)

    def parameter(self, name: str) -> Any:
        """Return a parameter of the filter node."""
        return self.filter.get_parameter(name).value

    def lose(self, node: Any) -> None:
        """End a node."""

        def end() -> None:
            self.graph.executor.remove_node(node)
            self.graph.nodes.remove(node)
            node.destroy_node()

        self._todo.append(end)

    def close(self) -> None:
        """End all nodes."""
        self._ends.set()
        self._thread.join(30.0)
        self.graph.close()
