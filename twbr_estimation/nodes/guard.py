"""No callback ends a node: an error is counted, logged in one line, and the node goes on.

A message that cannot be decoded is only counted.

The guard is around every subscription, timer, service and parameter callback, those of rclpy
itself included. `SystemExit` ends the process as before; a node raises it on purpose.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from ..errors import ConfigurationError, MessageError, TwbrError
from ..streams.callback_errors import CallbackErrors, described
from .backlog import Backlog
from .parameter_requests import admitted

Callback = Callable[..., Any]


class Guard:
    """Mixed in before `rclpy.node.Node`: wraps each callback the node is given."""

    def __init__(self, name: str, **options: Any) -> None:
        """Create the node; the arguments are those of `rclpy.node.Node`."""
        self.callback_errors = CallbackErrors()
        """Errors of callbacks."""
        self.unreadable = 0
        """Messages that could not be decoded."""
        self.backlog = Backlog()
        """Messages that are dropped where the node cannot keep up."""
        self.failure = ""
        """Why the node could not be set up the last time, or lost its device; it is logged then."""
        super().__init__(name, **options)  # type: ignore[call-arg]

    def clock_now(self) -> int:
        """Return the time of the node's clock [ns]; without the object that rclpy makes of it."""
        return int(self.get_clock().handle.get_now().nanoseconds)  # type: ignore[attr-defined]

    def note_error(self, where: str, error: BaseException) -> None:
        """Count an error of the callback `where`, and log it where that is due."""
        line = self.callback_errors.note(where, error, time.monotonic())
        if line and self.context.ok():  # type: ignore[attr-defined]
            self.get_logger().error(line)  # type: ignore[attr-defined]

    def guarded(
        self, where: str, callback: Callback, otherwise: Callback | None = None
    ) -> Callback:
        """Return `callback` with the guard round it.

        Args:
            where: What to call it in counts and log.
            callback: What is called.
            otherwise: Called with the error and the arguments after an error; its value is
                returned. None returns None.
        """

        def call(*arguments: Any) -> Any:
            try:
                return callback(*arguments)
            except MessageError:
                self.unreadable += 1
                return None
            except Exception as error:
                self.note_error(where, error)
                return None if otherwise is None else otherwise(error, *arguments)

        return call

    def create_subscription(
        self, kind: Any, topic: str, callback: Callback, *arguments: Any, **options: Any
    ) -> Any:
        """Subscribe; as `rclpy.node.Node.create_subscription`.

        Serialised messages, those of the fast topics, are dropped where the node cannot keep up.
        """
        raw = options.get("raw", False)
        if kind is Clock and not raw:
            callback = self._without_negative(callback)
        taken = self.guarded(topic, callback)
        if raw:
            taken = self._unless_behind(taken)
        made = super().create_subscription(  # type: ignore[misc]
            kind, topic, taken, *arguments, **options
        )
        if raw:
            self.backlog.add_queue(topic, made.qos_profile)
        return made

    @staticmethod
    def _without_negative(callback: Callback) -> Callback:
        """Return `callback` for times on `/clock`; one before 1970 is an error in plain words."""

        def call(message: Clock) -> None:
            if message.clock.sec < 0:
                raise TwbrError(f"{message.clock.sec} s is before 1970; it is ignored")
            callback(message)

        return call

    def _unless_behind(self, callback: Callback) -> Callback:
        drops = self.backlog.drops

        def call(message: Any) -> None:
            if not drops():
                callback(message)

        return call

    def create_timer(self, period: float, callback: Callback, **options: Any) -> Any:
        """Create a timer; as `rclpy.node.Node.create_timer`."""
        name = getattr(callback, "__name__", "callback").lstrip("_")
        guarded = self.guarded(f"timer {name}", callback)
        clock = options.get("clock")
        if clock is None or clock.clock_type is not ClockType.STEADY_TIME:
            return super().create_timer(period, guarded, **options)  # type: ignore[misc]

        def call() -> None:
            self.backlog.ticked(period)
            guarded()

        timer = super().create_timer(period, call, **options)  # type: ignore[misc]
        self.backlog.add_timer(period, timer)
        return timer

    def create_service(self, kind: Any, name: str, callback: Callback, **options: Any) -> Any:
        """Offer a service; as `rclpy.node.Node.create_service`. An error is a negative answer."""
        return super().create_service(  # type: ignore[misc]
            kind, name, self.guarded(f"service {name}", callback, _refusal), **options
        )

    def add_on_set_parameters_callback(self, callback: Callback) -> None:
        """Check parameters; as `rclpy.node.Node`. An error refuses the request."""
        checked = self.guarded("parameters", callback, _refused_parameters)
        super().add_on_set_parameters_callback(checked)  # type: ignore[misc]

    def add_post_set_parameters_callback(self, callback: Callback) -> None:
        """Take over parameters; as `rclpy.node.Node`."""
        super().add_post_set_parameters_callback(  # type: ignore[misc]
            self.guarded("parameters", callback)
        )

    def set_parameters(self, parameters: list[Parameter]) -> list[SetParametersResult]:
        """Set each separately; as `rclpy.node.Node`, but a wrong name is a negative result."""
        return [self.set_parameters_atomically([each]) for each in parameters]

    def set_parameters_atomically(self, parameters: list[Parameter]) -> SetParametersResult:
        """Set all or none; as `rclpy.node.Node`, but a wrong name is a negative result."""
        try:
            wanted = admitted(self, parameters)
        except ConfigurationError as error:
            return SetParametersResult(successful=False, reason=str(error))
        if not wanted:
            return SetParametersResult(successful=True)
        result: SetParametersResult = super().set_parameters_atomically(wanted)  # type: ignore[misc]
        return result


class GuardedNode(Guard, Node):
    """A node that no callback ends."""


def _refusal(error: Exception, request: Any, response: Any) -> Any:
    """Return a response that reports failure as far as its type can."""
    if hasattr(response, "success"):
        response.success = False
    if hasattr(response, "message"):
        response.message = described(error)
    if hasattr(response, "results"):
        refused = _refused_parameters(error)
        response.results = [refused for _ in getattr(request, "parameters", ())]
    if isinstance(getattr(response, "result", None), SetParametersResult):
        response.result = _refused_parameters(error)
    return response


def _refused_parameters(error: Exception, *_: Any) -> SetParametersResult:
    return SetParametersResult(successful=False, reason=described(error))
