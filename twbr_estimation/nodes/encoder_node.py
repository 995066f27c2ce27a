"""Publish wheel encoders on `joint_states`, or the reference encoder beside it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from ..errors import ConfigurationError
from ..sensors.encoder import Counter, Encoder, Tally
from ..sensors.joint_encoders import JointEncoderSettings, open_encoders
from ..streams.messages import JointStateEncoder
from .declarations import declarations_of, settings_from
from .diagnostics import Diagnostics, Level, Report
from .lifecycle import DeviceNode
from .parameters import NodeParameters
from .qos import overridable, published
from .spin import run

FAILED_POLLS = 5
"""Polls in a row that fail before the counters are opened again."""
SILENCE = 0.5
"""Time without a message that is an error, three periods at least [s]."""


class EncoderNode(DeviceNode):
    """Lifecycle node around one `Encoder` a joint."""

    def __init__(
        self,
        counters: Sequence[Counter] = (),
        listener: Callable[[int, Mapping[str, float]], None] | None = None,
        **options: Any,
    ) -> None:
        """Create the node.

        Args:
            counters: What to read instead of the devices, such as simulated counters.
            listener: Called with stamp [ns] and angles [rad] by joint at each reading, for a
                correction in the same process; then only topics with a subscriber are published.
            options: For `rclpy.node.Node`.
        """
        super().__init__("encoder_node", **options)
        self._given, self._listener = counters, listener
        self.encoders: list[Encoder] = []
        self.errors = 0
        """Reads that failed since the start."""
        self._failures = self._reported_errors = 0
        self._published_at = 0.0
        """When the last message went out, on the steady clock [s]."""
        self._tallies: dict[str, Tally] = {}
        """Errors of encoders that have been closed meanwhile, by joint."""
        self.parameters = NodeParameters(
            self, declarations_of(JointEncoderSettings()), JointEncoderSettings(), self._build
        )
        self._joints: tuple[str, ...] = ()
        self._diagnostics = Diagnostics(self, self.report, "encoders")
        self.create_service(Trigger, "~/set_zero", self._set_zero)
        self.begin()

    def _build(
        self, former: JointEncoderSettings, values: Mapping[str, Any]
    ) -> JointEncoderSettings:
        settings = settings_from(former, values)
        if self.is_open and settings != former:
            raise ConfigurationError("the encoders can only change while the node is unconfigured")
        return settings

    def open_device(self) -> None:
        """Open the counters."""
        settings = self.parameters.current
        self.encoders = open_encoders(settings, self.clock_now, self._given)
        self._failures = 0
        for encoder in self.encoders:
            if encoder.remark:
                self.get_logger().warning(encoder.remark)
        self._joints = settings.joints
        self._encoder = JointStateEncoder(settings.joints)
        self._publisher = self.create_lifecycle_publisher(
            JointState, settings.topic, published(), qos_overriding_options=overridable()
        )
        self._timer = self.poll_timer(1.0 / settings.poll_rate, self._poll)

    def close_device(self) -> None:
        """Release the counters."""
        self.destroy_timer(self._timer)
        self.destroy_lifecycle_publisher(self._publisher)
        self._tallies = self._tally()
        for encoder in self.encoders:
            encoder.close()
        self.encoders = []

    def _poll(self) -> None:
        stamp = self.clock_now()
        try:
            readings = [encoder.read(stamp) for encoder in self.encoders]
        except (OSError, ValueError) as error:
            self._failed(error)
            return
        self._failures = 0
        if not self.is_active:
            return
        positions = [reading.position for reading in readings]
        if self._listener is not None:
            self._listener(stamp, dict(zip(self._joints, positions, strict=True)))
        if self._listener is None or self._publisher.get_subscription_count():
            velocities = [reading.velocity for reading in readings]
            self._publisher.publish(self._encoder.encode(stamp, positions, velocities))
        self._published_at = time.monotonic()

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

    def _tally(self) -> dict[str, Tally]:
        """Return what went wrong since the start, by joint."""
        found = dict(self._tallies)
        for name, encoder in zip(self._joints, self.encoders, strict=False):
            found[name] = found.get(name, Tally()).plus(encoder.tally())
        return found

    def report(self) -> Report:
        """Return the status for `/diagnostics`."""
        values: dict[str, object] = {"read_errors": self.errors}
        tallies = self._tally()
        for name, tally in tallies.items():
            values |= {f"{name}.{key}": number for key, number in tally._asdict().items()}
        if not self.is_open:
            return self.idle_report(values)
        for name, encoder in zip(self._joints, self.encoders, strict=True):
            values[f"{name}.indexed"] = encoder.indexed
        failed, self._reported_errors = self.errors - self._reported_errors, self.errors
        if not self.is_active:
            return self.idle_report(values)
        return Report(*self._verdict(tallies, failed), values)

    def _verdict(self, tallies: Mapping[str, Tally], failed: int) -> tuple[Level, str]:
        """Return the worst of the messages, with so many reads that failed since the last."""
        silence = time.monotonic() - max(self._published_at, self._active_since)
        if self.is_settled and silence > max(SILENCE, 3.0 / self.parameters.current.poll_rate):
            return Level.ERROR, f"no joint states for {silence:.1f} s"
        if failed:
            return Level.WARN, f"{failed} reads failed"
        for name, tally in tallies.items():
            if fault := tally.described():
                return Level.WARN, f"{name}: {fault}"
        for encoder in self.encoders:
            if encoder.remark:
                return Level.WARN, encoder.remark
        return Level.OK, "reading"


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is asked to stop."""
    return run(EncoderNode, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
