"""Publish wheel encoders on `joint_states`, or the reference encoder beside it."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from ..errors import ConfigurationError
from ..sensors.encoder import Counter, Encoder
from ..sensors.joint_encoders import JointEncoderSettings, open_encoders
from .declarations import declarations_of, settings_from
from .diagnostics import Diagnostics, Level, Report
from .lifecycle import DeviceNode
from .parameters import NodeParameters
from .qos import overridable, published
from .spin import run

FAILED_POLLS = 5
"""Polls in a row that fail before the counters are opened again."""


class EncoderNode(DeviceNode):
    """Lifecycle node around one `Encoder` a joint."""

    def __init__(
        self,
        counters: Sequence[Counter] = (),
        listener: Callable[[JointState], None] | None = None,
        **options: Any,
    ) -> None:
        """Create the node.

        Args:
            counters: What to read instead of the devices, such as simulated counters.
            listener: Called with each message before it is published, for a correction in
                the same process; the message is reused.
            options: For `rclpy.node.Node`.
        """
        super().__init__("encoder_node", **options)
        self._given, self._listener = counters, listener
        self.encoders: list[Encoder] = []
        self.errors = 0
        """Reads that failed since the start."""
        self._failures = self._reported_errors = 0
        self.parameters = NodeParameters(self, declarations_of(JointEncoderSettings()), self._build)
        self._message = JointState()
        self._diagnostics = Diagnostics(self, self.report, "encoders")
        self.create_service(Trigger, "~/set_zero", self._set_zero)
        self.begin()

    def _build(self, values: Mapping[str, Any]) -> JointEncoderSettings:
        settings = settings_from(JointEncoderSettings(), values)
        if self.is_open and settings != self.parameters.current:
            raise ConfigurationError("the encoders can only change while the node is unconfigured")
        return settings

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def open_device(self) -> None:
        """Open the counters."""
        settings = self.parameters.current
        self.encoders = open_encoders(settings, self._now, self._given)
        self._failures = 0
        self._message = JointState(name=list(settings.joints))
        self._message.position = array("d", [0.0] * len(settings.joints))
        self._message.velocity = array("d", [0.0] * len(settings.joints))
        self._publisher = self.create_lifecycle_publisher(
            JointState, settings.topic, published(), qos_overriding_options=overridable()
        )
        self._timer = self.poll_timer(1.0 / settings.poll_rate, self._poll)

    def close_device(self) -> None:
        """Release the counters."""
        self.destroy_timer(self._timer)
        self.destroy_lifecycle_publisher(self._publisher)
        for encoder in self.encoders:
            encoder.close()
        self.encoders = []

    def _poll(self) -> None:
        stamp = self._now()
        try:
            readings = [encoder.read(stamp) for encoder in self.encoders]
        except (OSError, ValueError) as error:
            self._failed(error)
            return
        self._failures = 0
        if not self.is_active:
            return
        message = self._message
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        for index, reading in enumerate(readings):
            message.position[index] = reading.position
            message.velocity[index] = reading.velocity
        if self._listener is not None:
            self._listener(message)
        self._publisher.publish(message)

    def _failed(self, error: Exception) -> None:
        self.errors += 1
        self._failures += 1
        if self._failures >= FAILED_POLLS:
            self.lose_device(f"the counters cannot be read: {error}")

    def _set_zero(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Call the present position the start angle."""
        angle = self.parameters.current.start_angle
        if not self.encoders:
            response.success, response.message = False, "no encoder is open"
        elif any(encoder.indexed for encoder in self.encoders):
            response.success, response.message = False, "the index pulse sets the zero"
        else:
            for encoder in self.encoders:
                encoder.set_angle(angle)
            response.success, response.message = True, f"now at {angle:g} rad"
        return response

    def report(self) -> Report:
        """Return what `/diagnostics` says."""
        if not self.is_open:
            return Report(Level.STALE, self.failure or "not configured", {"errors": self.errors})
        values: dict[str, object] = {"read_errors": self.errors}
        level, message = Level.OK, "active" if self.is_active else "inactive"
        for name, encoder in zip(self.parameters.current.joints, self.encoders, strict=True):
            values[f"{name}.lost_counts"] = encoder.lost_counts
            values[f"{name}.missed_edges"] = encoder.missed_edges
            values[f"{name}.indexed"] = encoder.indexed
            if encoder.lost_counts or encoder.missed_edges:
                level, message = Level.WARN, f"{name}: counts were lost"
        if self.errors > self._reported_errors:
            level, message = Level.WARN, f"{self.errors - self._reported_errors} reads failed"
        self._reported_errors = self.errors
        return Report(level, message, values)


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is asked to stop."""
    return run(EncoderNode, arguments)
