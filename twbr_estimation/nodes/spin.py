"""Start nodes, spin them until they are asked to stop, and clean up: written once."""

from __future__ import annotations

import gc
import inspect
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType

import rclpy
from rclpy.context import Context
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ..errors import ConfigurationError, TwbrError
from ..starting import search_as_usual
from ..streams.callback_errors import described
from .command_line import CommandLine, prepared, temporary_folder
from .guard import Guard
from .shared_memory import remove_half_made
from .start import REFUSED, refusal, start_warnings

SWITCH = 1e-4
"""Time after which a thread lets another one run that waits for the interpreter [s]."""
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
    package and what rcl refuses at the start are logged in one line; anything else at the start
    is a defect and keeps its traceback.

    Args:
        create: Returns the node or nodes; called once the context is up.
        arguments: Command line; that of the process by default.

    Returns:
        Exit status: 0 after a normal shutdown, 1 after an error.
    """
    nodes: list[Node] = []
    stop = threading.Event()
    _interrupt_raises()
    try:
        line = _initialised(sys.argv if arguments is None else arguments)
        _stop_on_signals(stop)
        executor = make_executor()
        created = _created(create, line)
        nodes.extend(created if isinstance(created, Sequence) else [created])
        for warning in start_warnings(nodes, line.files):
            nodes[0].get_logger().warning(warning)
        for node in nodes:
            executor.add_node(node)
        _prepare_to_run()
        _spin(executor, nodes, stop)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    except TwbrError as error:
        get_logger(nodes[0].get_name() if nodes else _program()).fatal(str(error))
        return 1
    finally:
        _clean_up(nodes)
    return 0


def _initialised(arguments: list[str]) -> CommandLine:
    """Start rclpy; return the command line that it was given.

    Raises:
        ConfigurationError: rcl refuses the arguments or the environment.
    """
    for path in remove_half_made():
        get_logger(_program()).warning(f"removed {path}, which a killed process left half made")
    with temporary_folder() as folder:
        line = prepared(arguments, Path(folder))
        try:
            # Not rclpy's own handlers: they end the context under a callback that is publishing.
            rclpy.init(args=line.arguments, signal_handler_options=SignalHandlerOptions.NO)
        except (RuntimeError, ValueError) as error:
            raise ConfigurationError(refusal(error)) from None
    return line


def _created(
    create: Callable[[], Node | Sequence[Node]], line: CommandLine
) -> Node | Sequence[Node]:
    try:
        return create()
    except (*REFUSED, ConfigurationError) as error:
        problem = refusal(error) if isinstance(error, REFUSED) else str(error)
        raise ConfigurationError(line.located(problem)) from None


def _prepare_to_run() -> None:
    """Do what would otherwise make samples wait: 0.05 s and more at the first line of the log."""
    sys.setswitchinterval(SWITCH)
    inspect.stack()  # as the log does for each line; the first time it searches all modules
    gc.freeze()  # what lives as long as the process need not be searched while it runs
    search_as_usual()


def _spin(executor: Executor, nodes: list[Node], stop: threading.Event) -> None:
    """Spin until shutdown; what a guard could not catch is counted by the first guarded node."""
    guarded = [node for node in nodes if isinstance(node, Guard)]
    for node in guarded:
        node.backlog.begin()
    while rclpy.ok() and not stop.is_set():
        try:
            executor.spin_once(timeout_sec=WAKE_PERIOD)
        except (TwbrError, ExternalShutdownException):
            raise
        except Exception as error:
            if not guarded or not rclpy.ok():
                raise
            guarded[0].note_error("the executor", error)


def _program() -> str:
    """Return the name of the command, before there is a node with a name."""
    return Path(sys.argv[0]).stem or "twbr_estimation"


def _interrupt_raises() -> None:
    """Let SIGINT raise KeyboardInterrupt again, which it does not while modules are imported."""
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _stop_on_signals(stop: threading.Event) -> None:
    """Let the first SIGINT, SIGTERM or SIGHUP set `stop`.

    A second SIGINT or SIGTERM acts as usual; SIGHUP often comes twice, from the terminal and from
    its shell. A process that was started to outlive its terminal (`nohup`) ignores SIGHUP.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    usual = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        usual[signal.SIGHUP] = signal.SIG_IGN

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
        try:
            node.destroy_node()
        except Exception as error:  # the other nodes must still stop what they drive
            get_logger(node.get_name()).error(f"while it ended: {described(error)}")
    rclpy.try_shutdown()
    _ignore_interrupts()  # the shutdown has put the old handler back


def _ignore_interrupts() -> None:
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
