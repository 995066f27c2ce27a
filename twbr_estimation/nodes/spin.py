"""Start nodes, spin them until they are asked to stop, and clean up: written once."""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Callable, Sequence
from types import FrameType

import rclpy
from rclpy.context import Context
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ..errors import TwbrError

WAKE_PERIOD = 0.2
"""Longest time the executor sleeps before it looks for a signal again [s]."""


def make_executor(context: Context | None = None) -> Executor:
    """Return the events executor, or the single-threaded one before rclpy 7.1.4."""
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)


def run(create: Callable[[], Node | Sequence[Node]], arguments: list[str] | None = None) -> int:
    """Create one node or several in one process and spin them until shutdown.

    A node ends its process by raising `SystemExit(status)` in a callback. Errors of this
    package are logged in one line; anything else is a defect and keeps its traceback.

    Args:
        create: Returns the node or nodes; called once the context is up.
        arguments: Command line; that of the process by default.

    Returns:
        Exit status: 0 after a normal shutdown, 1 after an error.
    """
    nodes: list[Node] = []
    stop = threading.Event()
    try:
        # Not rclpy's own handlers: they end the context under a callback that is publishing.
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        _stop_on_signals(stop)
        executor = make_executor()
        created = create()
        nodes.extend(created if isinstance(created, Sequence) else [created])
        for node in nodes:
            executor.add_node(node)
        gc.freeze()  # what lives as long as the process need not be searched while it runs
        while rclpy.ok() and not stop.is_set():
            executor.spin_once(timeout_sec=WAKE_PERIOD)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    except TwbrError as error:
        get_logger(nodes[0].get_name() if nodes else "twbr_estimation").fatal(str(error))
        return 1
    finally:
        _clean_up(nodes)
    return 0


def _stop_on_signals(stop: threading.Event) -> None:
    """Let the first SIGINT or SIGTERM set `stop`, and a second one act as usual."""
    if threading.current_thread() is not threading.main_thread():
        return
    usual = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def handle(number: int, frame: FrameType | None) -> None:
        stop.set()
        signal.signal(number, usual[signal.Signals(number)])

    for number in usual:
        signal.signal(number, handle)


def _clean_up(nodes: list[Node]) -> None:
    """Destroy the nodes, the last first; from here on SIGINT changes nothing any more.

    A second Ctrl-C, or launch's own SIGINT after the terminal's, would be raised inside C++
    destructors and abort the process. What hangs can still be ended by SIGTERM.
    """
    _ignore_interrupts()
    for node in reversed(nodes):
        node.destroy_node()
    rclpy.try_shutdown()
    _ignore_interrupts()  # the shutdown has put the old handler back


def _ignore_interrupts() -> None:
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
