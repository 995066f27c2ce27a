"""The wheels in serialised JointStates: which joints, their clock, their gear, angles or rates."""

from __future__ import annotations

from ..pipeline.pairing import WheelReading, wheel_reading
from ..samples import SINGLE_WHEEL_JOINT, Stamps
from .device.stamping import Stamping
from .messages import JointStateDecoder
from .wheel_rates import WheelRates

TOPIC = "joint_states"


class WheelDecoder:
    """Finds the wheels in serialised JointStates."""

    def __init__(
        self, left: str, right: str, gear_ratio: float = 1.0, stamps: Stamps = Stamps.HEADER
    ) -> None:
        """Look for joints of these names, one of them is enough, else for `wheel_joint`.

        Args:
            left: Joint of the left wheel.
            right: Joint of the right wheel.
            gear_ratio: Turns of the joints to one turn of the wheels.
            stamps: Which clock stamps the readings.
        """
        self.stamping = Stamping(stamps, TOPIC)
        self.rates = WheelRates()
        self._wheels, self._share = (left, right), 1.0 / gear_ratio
        self._joints = JointStateDecoder()
        self._names: tuple[str, ...] | None = None
        self._at: tuple[int, ...] = ()

    def decode(self, data: bytes, now: int = 0) -> WheelReading | None:
        """Return the wheels' reading; None where the message has neither of the joints.

        Args:
            data: The message. Without positions its velocities are integrated.
            now: Time of the node's clock [ns]; for stamps that are not the message's own.

        Raises:
            MessageError: not a JointState in little-endian XCDR version 1.
        """
        header, names, values = self._joints.decode(data)
        integrate = not names
        if integrate:
            names, values = self._joints.velocities(data)
        if names is not self._names:
            self._find(names)
        if not self._at:
            return None
        stamp = self.stamping.stamp(header, now)
        angles = [self._share * values[index] for index in self._at]
        return wheel_reading(stamp, self.rates.add(stamp, angles) if integrate else angles)

    def _find(self, names: tuple[str, ...]) -> None:
        self._names = names
        present = [wheel for wheel in self._wheels if wheel in names]
        if not present and SINGLE_WHEEL_JOINT in names:
            present = [SINGLE_WHEEL_JOINT]
        self._at = tuple(names.index(wheel) for wheel in present)
