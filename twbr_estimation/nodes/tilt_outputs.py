"""Outputs of a filter node: `tilt`, `tilt_deg`, `imu/data`, `tilt/compare`, `tilt/valid`."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Float64

from ..samples import CorrectedSample, TiltEstimate
from ..streams.corrected import imu_values
from ..streams.messages import ImuEncoder, JointStateEncoder, encode_float64
from .qos import latched, overridable, published


class TiltOutputs:
    """Publishers of one filter node with their serialisers."""

    def __init__(self, node: Node, frame: str) -> None:
        """Create the publishers; nothing is published yet.

        Args:
            node: The node that publishes.
            frame: Frame id of `imu/data`.
        """
        options = {"qos_overriding_options": overridable()}
        self._tilt = node.create_publisher(Float64, "tilt", published(), **options)
        self._degrees = node.create_publisher(Float64, "tilt_deg", published(), **options)
        self._plotted = False
        self._imu = node.create_publisher(Imu, "imu/data", published(), **options)
        self._compare = node.create_publisher(JointState, "tilt/compare", published(), **options)
        self._valid = node.create_publisher(Bool, "tilt/valid", latched())
        self._imu_encoder = ImuEncoder(frame)
        self._compare_names: tuple[str, ...] = ()
        self._compare_encoder = JointStateEncoder(())
        self._was_valid: bool | None = None

    def publish(
        self,
        stamp: int,
        sample: CorrectedSample,
        estimate: TiltEstimate,
        tilt: float,
        variance: float,
    ) -> None:
        """Publish `tilt` first, then `imu/data`, then `tilt_deg` where a node subscribes to it.

        Args:
            stamp: Stamp of the sample [ns].
            sample: The corrected sample.
            estimate: The active filter's estimate.
            tilt: For the controller: with sign, offset and prediction [rad].
            variance: Variance of the estimate [rad^2].
        """
        self._tilt.publish(encode_float64(tilt))
        if self._imu.get_subscription_count():  # costs less than encoding in vain
            values = imu_values(sample, estimate.tilt, variance, estimate.rate)
            self._imu.publish(self._imu_encoder.encode(stamp, values))
        if self._plotted:
            self._degrees.publish(encode_float64(math.degrees(tilt)))

    def find_plotters(self) -> None:
        """Note whether a node subscribes to `tilt_deg`; costs too much for every sample."""
        self._plotted = self._degrees.get_subscription_count() > 0

    def publish_comparison(self, stamp: int, estimates: Mapping[str, TiltEstimate]) -> None:
        """Publish the estimates of the filters that run beside; those not finite are left out.

        Nothing is encoded while no node subscribes.
        """
        if not estimates or not self._compare.get_subscription_count():
            return
        finite = {name: e for name, e in estimates.items() if math.isfinite(e.tilt + e.rate)}
        if not finite:
            return
        names = tuple(finite)
        if names != self._compare_names:
            self._compare_names, self._compare_encoder = names, JointStateEncoder(names)
        tilts = [estimate.tilt for estimate in finite.values()]
        rates = [estimate.rate for estimate in finite.values()]
        self._compare.publish(self._compare_encoder.encode(stamp, tilts, rates))

    def publish_valid(self, valid: bool, always: bool = True) -> None:
        """Publish whether the tilt can be used; only a change unless `always`."""
        if always or valid is not self._was_valid:
            self._was_valid = valid
            self._valid.publish(Bool(data=valid))
