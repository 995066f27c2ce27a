"""A web page for the robot: see it lean, switch its filter, change parameters, record.

Serve the page on `http://localhost:8080`. Plain topics, services and parameters are used, so
the nodes may run on another computer. Nothing is received while no browser looks. Bound to
another address than this computer's, the page needs a token, which the log gives.
"""

from __future__ import annotations

import signal
import threading
from dataclasses import dataclass
from typing import Annotated, Any

import rclpy
from rclpy.executors import Executor, ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ..dashboard.server import ServerSettings, serve
from ..errors import TwbrError
from ..parameters.bounds import Bounds, Meaning
from ..streams.callback_errors import described
from .graph_robot import GraphRobot
from .guard import GuardedNode
from .parameters import declare_settings
from .spin import WAKE_PERIOD, make_executor


@dataclass(frozen=True, slots=True)
class DashboardParameters:
    """Parameters of the node."""

    host: Annotated[
        str,
        Meaning("Address to serve on; 0.0.0.0 for every network of this computer, with a token."),
    ] = "127.0.0.1"
    port: Annotated[int, Bounds(1, 65535, "", "TCP port of the page.")] = 8080
    token: Annotated[
        str,
        Meaning("What a browser on another computer must give; empty: a new one at each start."),
    ] = ""
    read_only: Annotated[
        bool, Meaning("Whether the page only shows: no parameter, service or command is sent.")
    ] = False
    robots: Annotated[
        tuple[str, ...],
        Meaning("Namespaces of the robots to show, a tab each; empty is this node's own."),
    ] = ("",)
    record_folder: Annotated[str, Meaning("Folder for the recordings that the page makes.")] = (
        "recordings"
    )


class DashboardNode(GuardedNode):
    """Holds the parameters; what the page shows is a `GraphRobot` for each namespace."""

    def __init__(self, **options: Any) -> None:
        """Create the node and a robot for each namespace."""
        super().__init__("dashboard_node", **options)
        self.settings = declare_settings(self, DashboardParameters())
        # Fast topics are taken 30 times a second, so no executor wakes up for their messages.
        self._taker = Node(
            "dashboard_streams", namespace=self.get_namespace(), context=self.context
        )
        names = self.settings.robots or ("",)
        self.robots = [
            GraphRobot(self, self._taker, name, self.settings.record_folder) for name in names
        ]

    def destroy_node(self) -> None:
        """End recordings and leave the graph."""
        for robot in self.robots:
            try:
                robot.end()
            except TwbrError as error:
                self.get_logger().error(str(error))
        self._taker.destroy_node()
        super().destroy_node()


def main(arguments: list[str] | None = None) -> int:
    """Serve the page until the process is asked to stop."""
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    node: DashboardNode | None = None
    executor, stop = make_executor(), threading.Event()
    try:
        node = DashboardNode()
        executor.add_node(node)
        threading.Thread(target=_spin, args=(executor, node, stop), daemon=True).start()
        settings = node.settings
        server = ServerSettings(
            settings.host, settings.port, settings.token, settings.read_only, "twbr"
        ).secured()
        logger = node.get_logger()
        _interrupt_on_signals()
        serve(node.robots, server, lambda addresses: logger.info(f"open {addresses}"))
    except TwbrError as error:
        get_logger("dashboard_node").fatal(str(error))
        return 1
    except KeyboardInterrupt:
        pass
    finally:
        stop.set()
        executor.shutdown(timeout_sec=1.0)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _interrupt_on_signals() -> None:
    """Let SIGINT, SIGTERM and SIGHUP end the process cleanly, with its recordings complete.

    The server stops at the first two by itself and then raises the signal anew. A process that
    was started to outlive its terminal (`nohup`) ignores SIGHUP.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: signal.raise_signal(signal.SIGTERM))


def _spin(executor: Executor, node: Node, stop: threading.Event) -> None:
    """Serve what arrives until the end; a defect in one callback does not end the others."""
    while rclpy.ok() and not stop.is_set():
        try:
            executor.spin_once(timeout_sec=WAKE_PERIOD)
        except ExternalShutdownException:
            return
        except Exception as error:
            if stop.is_set() or not rclpy.ok():
                return
            node.get_logger().error(described(error), throttle_duration_sec=10.0)


if __name__ == "__main__":
    raise SystemExit(main())
