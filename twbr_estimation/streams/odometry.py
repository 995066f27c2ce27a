"""The wheels by a base's odometry: its forward speed, integrated, as the turn of one wheel."""

from __future__ import annotations

from collections.abc import Callable

from ..pipeline.pairing import WheelReading, wheel_reading
from ..samples import Stamps
from .device.stamping import Stamping
from .messages import decode_forward_speed
from .wheel_rates import WheelRates

TOPIC = "odom"


class OdometryDecoder:
    """Turns serialised `nav_msgs/Odometry` into readings of one wheel."""

    def __init__(
        self, radius: Callable[[], float], gear_ratio: float = 1.0, stamps: Stamps = Stamps.HEADER
    ) -> None:
        """Start at an angle of 0.

        Args:
            radius: Returns that of the wheels [m]; what is rolled becomes an angle by it.
            gear_ratio: By which the speed is divided, where the sender's is too large.
            stamps: Which clock stamps the readings.
        """
        self.stamping = Stamping(stamps, TOPIC)
        self.rates = WheelRates()
        self._radius = radius
        self._share = 1.0 / gear_ratio

    def decode(self, data: bytes, now: int = 0) -> WheelReading:
        """Return the wheel's reading.

        Args:
            data: The message; `twist.twist.linear.x` counts, in the frame of the base.
            now: Time of the node's clock [ns]; for stamps that are not the message's own.

        Raises:
            MessageError: not an Odometry in little-endian XCDR version 1.
        """
        header, speed = decode_forward_speed(data)
        stamp = self.stamping.stamp(header, now)
        return wheel_reading(stamp, self.rates.add(stamp, [self._share * speed / self._radius()]))
